"""Figs 8 to 10 of the paper on SVALSE: GOSPA, its parts and RMSE against the SNR."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from arrivals.plots.study import METHOD_COLOURS, plot_metric
from arrivals.scenarios.bounds.snapshot import LineBound, line_bound
from arrivals.scenarios.experiments.methods import tracker_name
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.claims import negative, verdict
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.figures_4_to_7 import NAN, batch_of, table_methods
from arrivals.scenarios.reproduce.svalse.plots import panels
from arrivals.scenarios.reproduce.svalse.published_values import SWEEP, SWEPT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCENES = {"svalse_scenario1": "three static sources", "svalse_scenario2": "six static sources"}
SNR_DB = tuple(float(snr) for snr in range(0, 45, 5))
MEASURED = ("gospa", "distance", "missed", "false", "rmse", "converged")


@lru_cache(maxsize=2)  # Fig. 10 uses the results of Figs 8 and 9
def sweep(name: str, runs: int, seed: int, out: Path | None, quick: bool) -> Study:
    """Run all methods on a scene at every SNR; the cases are the SNRs."""
    cases = {f"{snr:g}": create(name, snr_db=snr) for snr in SNR_DB}
    settings = StudySettings(MEASURED, out, batch=batch_of(runs))
    return compute_study(cases, table_methods(quick), runs, seed, settings)


def fig8(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """GOSPA and its parts against the SNR, three static sources (scenario 1)."""
    return parts("svalse_scenario1", "Fig. 8", runs, seed, out, quick)


def fig9(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """GOSPA and its parts against the SNR, six static sources (scenario 2)."""
    return parts("svalse_scenario2", "Fig. 9", runs, seed, out, quick)


def parts(name: str, figure: str, runs: int, seed: int, out: Path | None, quick: bool) -> Report:
    """Return the table and the figure of one sweep."""
    study = sweep(name, runs, seed, out, quick)
    rows = [_row(study, name, snr, method) for snr in SNR_DB for method in study.methods]
    columns = ("snr_db", "method", "GOSPA", "std of runs", "distance", "missed", "false", "RMSE",
               "rebuilt", "rebuilt RMSE")  # fmt: skip
    remarks = [*_claims(study, name), BOUND]
    bounds = _bounds(name, runs, seed)
    title = f"{figure}: GOSPA against the SNR, {SCENES[name]}, {runs} runs, degrees"
    return Report(title, columns, rows, remarks, {"parts": _draw_parts(study, name, bounds)})


BOUND = (
    "Bound: an efficient estimator from one snapshot with a known number of sources; a method with "
    "memory may be below it. The rebuilt figures are means of 3 runs."
)


def _bounds(name: str, runs: int, seed: int) -> dict[str, LineBound]:
    made = {f"{snr:g}": create(name, snr_db=snr) for snr in SNR_DB}
    return {case: line_bound(one, min(runs, 6), seed) for case, one in made.items()}  # type: ignore[arg-type]  # lines


def _row(study: Study, name: str, snr: float, method: str) -> tuple[Any, ...]:
    case = f"{snr:g}"
    means = [study.mean(m, method, case) for m in ("distance", "missed", "false", "rmse")]
    reference = (
        SWEEP[name][snr][SWEPT.index(tracker_name(method))]
        if tracker_name(method) in SWEPT
        else (NAN, NAN)
    )
    gospa, spread = study.mean("gospa", method, case), study.spread("gospa", method, case)
    return (snr, method, gospa, spread, *means, *reference)


def _claims(study: Study, name: str) -> list[str]:
    def mean(metric: str, method: str, snr: int) -> float:
        return study.mean(metric, method, f"{snr}")

    def lowest(snr: int) -> bool:
        four = {method: mean("gospa", method, snr) for method in SWEPT}
        return min(four, key=four.__getitem__) == "svalse"

    low = [snr for snr in (0, 5, 10, 15, 20) if lowest(snr)]
    lines = [
        verdict("svalse has the lowest GOSPA of the four up to 20 dB", len(low) == 5,
              f"at {', '.join(map(str, low)) or 'no'} dB"),
        verdict("below 10 dB sbl and ssbl have false directions",
              mean("false", "ssbl", 5) > 2 * mean("false", "svalse", 5),
              f"false at 5 dB: ssbl {mean('false', 'ssbl', 5):.1f}, "
              f"svalse {mean('false', 'svalse', 5):.1f}"),
        verdict("from 30 dB on, on-grid sources favour ssbl",
              mean("gospa", "ssbl", 40) < mean("gospa", "svalse", 40),
              f"at 40 dB: ssbl {mean('gospa', 'ssbl', 40):.2f}, "
              f"svalse {mean('gospa', 'svalse', 40):.2f}"),
    ]  # fmt: skip
    if name == "svalse_scenario2":
        lines.append(
            verdict("at 0 dB the RMSE, which ignores false directions, favours ssbl over svalse",
                  mean("rmse", "ssbl", 0) < mean("rmse", "svalse", 0),
                  f"{mean('rmse', 'ssbl', 0):.1f} and {mean('rmse', 'svalse', 0):.1f}")
        )  # fmt: skip
    return lines


def _draw_rebuilt(ax: Axes, name: str, part: int) -> None:
    """Draw the rebuilt GOSPA (part 0) or RMSE (1) as crosses, in the methods' colours."""
    for n, method in enumerate(SWEPT):
        values = [reference[n][part] for reference in SWEEP[name].values()]
        label = "rebuilt" if n == 0 else None
        ax.plot(SNR_DB, values, "x", color=METHOD_COLOURS[method], markersize=5, label=label)


def _draw_parts(study: Study, name: str, bounds: dict[str, LineBound]) -> Figure:
    figure, axes = panels(2, 2, (11.0, 7.5))
    titles = {"gospa": "GOSPA", "distance": "distance", "missed": "missed", "false": "false"}
    for ax, (metric, title) in zip(axes, titles.items(), strict=True):
        bound = {case: one.gospa for case, one in bounds.items()} if metric == "gospa" else None
        if metric == "gospa":
            _draw_rebuilt(ax, name, 0)
        plot_metric(study, metric, x="snr_db", bound=bound, ax=ax)
        ax.set(xlabel="SNR, dB", ylabel=f"{title}, degrees")
        legend = ax.get_legend()
        if metric != "gospa" and legend is not None:
            legend.remove()
    return figure


def fig10(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """RMSE against the SNR, both scenarios."""
    rows: list[tuple[Any, ...]] = []
    remarks: list[str] = []
    figure, axes = panels(1, 2, (11.0, 4.2))
    for ax, name in zip(axes, SCENES, strict=False):
        study, bounds = sweep(name, runs, seed, out, quick), _bounds(name, runs, seed)
        _draw_rebuilt(ax, name, 1)
        plot_metric(study, "rmse", x="snr_db", ax=ax,
                    bound={case: one.rmse for case, one in bounds.items()})  # fmt: skip
        minimum = min(study.mean("rmse", method, case) for method in study.methods
                    for case in study.cases)  # fmt: skip
        ax.set(xlabel="SNR, dB", ylabel="RMSE, degrees", yscale="log", title=SCENES[name])
        ax.set_ylim(bottom=max(minimum / 3, 1e-4))  # an interval may extend to zero
        remarks += _rmse_claims(study, SCENES[name])
        for snr in SNR_DB:
            rows += [(name, *_rmse_row(study, name, snr, method), bounds[f"{snr:g}"].rmse)
                     for method in study.methods]  # fmt: skip
    columns = ("scenario", "snr_db", "method", "RMSE", "std of runs", "rebuilt", "bound")
    title = f"Fig. 10: RMSE against the SNR, {runs} runs, degrees"
    return Report(title, columns, rows, (*remarks, BOUND), {"rmse": figure})


def _rmse_claims(study: Study, scene: str) -> Iterator[str]:
    """Check that the RMSE, which ignores false directions, favours ssbl at low SNR only."""
    for snr, better, worse in ((0, "ssbl", "svalse"), (20, "svalse", "ssbl"), (20, "ssbl", "sbl")):
        d = study.paired("rmse", better, worse, f"{snr}")
        values = [study.mean("rmse", method, f"{snr}") for method in (better, worse)]
        numbers = f"{values[0]:.2f} and {values[1]:.2f}, difference {d.mean:.2f} ± {d.error:.2f}"
        claim = f"{scene}, {snr} dB: {better} has a lower RMSE than {worse}"
        yield verdict(claim, negative(d.mean, d.error), numbers)


def _rmse_row(study: Study, name: str, snr: float, method: str) -> tuple[Any, ...]:
    case = f"{snr:g}"
    reference = (
        SWEEP[name][snr][SWEPT.index(tracker_name(method))][1]
        if tracker_name(method) in SWEPT
        else NAN
    )
    return (
        snr,
        method,
        study.mean("rmse", method, case),
        study.spread("rmse", method, case),
        reference,
    )
