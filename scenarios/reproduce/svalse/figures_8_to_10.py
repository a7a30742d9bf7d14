"""Figs 8 to 10 of the paper on SVALSE: GOSPA, its parts and RMSE against the SNR."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from arrivals.plots.colours import METHOD_COLOURS
from arrivals.plots.study import plot_metric
from arrivals.scenarios.base import Scenario
from arrivals.scenarios.bounds.snapshot import LineBound, line_bound
from arrivals.scenarios.experiments.methods import Method, methods
from arrivals.scenarios.experiments.monte_carlo import StudySettings, compute_study
from arrivals.scenarios.experiments.results_file import Results
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.metrics.registry import METRICS
from arrivals.scenarios.registry import create
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.reproduce.svalse.decisions import results_of
from arrivals.scenarios.reproduce.svalse.forms import (
    FAST,
    FORMS_SEEN,
    NAN,
    PAPER_FORM,
    batch_of,
    paper_forms,
)
from arrivals.scenarios.reproduce.svalse.plots import panels
from arrivals.scenarios.reproduce.svalse.published_values import SWEEP, SWEPT
from arrivals.scenarios.reproduce.svalse.step_metrics import STEP_METRICS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCENES = {"svalse_scenario1": "three static sources", "svalse_scenario2": "six static sources"}
SNR_DB = tuple(float(snr) for snr in range(0, 45, 5))
SLOW_DB, SLOW_RUNS = 15.0, 3  # from this SNR on the paper's forms take 10 to 60 s a run
OFF_GRID_DB = (30.0, 40.0)
OFF_GRID = 0.25  # degrees, halfway between the directions of (S)SBL
PARTS = ("gospa", "distance", "missed", "false", "rmse", "cardinality", "converged")
MEASURED = {name: METRICS[name] for name in PARTS} | {"number_bias": STEP_METRICS["number_bias"]}
SHOWN = (*SWEPT[:2], *PAPER_FORM.values(), "valse", "svalse")  # in the tables of the page
COMPARED_OFF_GRID = ("ssbl", "svalse")


@lru_cache(maxsize=2)  # Fig. 10 uses the results of Figs 8 and 9
def sweep(name: str, runs: int, seed: int, out: Path | None, quick: bool) -> Study:
    """Run all methods on a scene at every SNR; the cases are the SNRs."""
    cases = {f"{snr:g}": create(name, snr_db=snr) for snr in SNR_DB}
    ours = _study(cases, methods(FAST), runs, seed, out)
    if quick:
        return ours
    low, high = ({f"{snr:g}": cases[f"{snr:g}"] for snr in SNR_DB if (snr < SLOW_DB) == is_low}
                 for is_low in (True, False))  # fmt: skip
    return joined(
        ours,
        _study(low, paper_forms(), runs, seed, out),
        _study(high, paper_forms(), min(runs, SLOW_RUNS), seed, out),
    )


def off_grid(name: str, runs: int, seed: int, out: Path | None) -> Study:
    """Run SSBL and SVALSE on sources halfway between the directions of SSBL, at high SNR."""
    cases = {
        f"{snr:g} off grid": create(name, snr_db=snr, offset_deg=OFF_GRID) for snr in OFF_GRID_DB
    }
    ours = _study(cases, methods(COMPARED_OFF_GRID), runs, seed, out)
    return joined(ours, _study(cases, paper_forms()[1:], min(runs, SLOW_RUNS), seed, out))


def _study(
    cases: Mapping[str, Scenario],
    compared: Sequence[Method],
    runs: int,
    seed: int,
    out: Path | None,
) -> Study:
    settings = StudySettings(MEASURED, out, batch=batch_of(runs))
    return compute_study(cases, compared, runs, seed, settings)


def joined(first: Study, *others: Study) -> Study:
    """Return the results of studies of the same seed, cases all in the first, as one in memory."""
    labelled = {
        method["label"]: method for one in (first, *others) for method in one.config["methods"]
    }
    results = Results({**first.config, "methods": list(labelled.values())}, None)
    results.add(row for one in (first, *others) for row in one.rows())
    return Study(results)


def fig8(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """GOSPA and its parts against the SNR, three static sources (scenario 1)."""
    return parts("svalse_scenario1", "Fig. 8", runs, seed, out, quick)


def fig9(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """GOSPA and its parts against the SNR, six static sources (scenario 2)."""
    return parts("svalse_scenario2", "Fig. 9", runs, seed, out, quick)


def parts(name: str, figure: str, runs: int, seed: int, out: Path | None, quick: bool) -> Report:
    """Return the table and the figure of one sweep."""
    study = sweep(name, runs, seed, out, quick)
    moved = [] if quick else [off_grid(name, runs, seed, out)]
    metrics = ("gospa", "distance", "missed", "false", "rmse", "number_bias")
    columns, rows = wide_table([study, *moved], metrics)
    scale = [bound.gospa for bound in _scale(name, runs, seed).values()]
    rebuilt = [tuple(pair[0] for pair in four) for four in SWEEP[name].values()]
    rows = [
        (*row, scale[n], *rebuilt[n]) if n < len(SNR_DB) else (*row, *[NAN] * 5)
        for n, row in enumerate(rows)
    ]
    columns += ["one snapshot", *(f"{method} rebuilt" for method in SWEPT)]
    title = f"{figure}: GOSPA against the SNR, {SCENES[name]}, {numbers(runs, quick)}, degrees"
    figures = {"parts": _draw_parts(study, name, _scale(name, runs, seed))}
    remarks = [fewer_runs(runs), SCALE, MOVED, FORMS_SEEN]
    if quick:
        remarks = [SCALE, FORMS_SEEN]
    return Report(title, columns, rows, remarks, figures,
                  _page(columns), results_of(study, *moved), {"parts": title})  # fmt: skip


def numbers(runs: int, quick: bool) -> str:
    """Return the number of runs, and that of the paper's forms at high SNR, for a title.

    Examples
    --------
    >>> numbers(2, quick=True)
    '2 runs'
    """
    fewer = min(runs, SLOW_RUNS)
    if quick or fewer == runs:
        return f"{runs} runs"
    return f"{runs} runs (paper's form from {SLOW_DB:g} dB on: {fewer})"


def fewer_runs(runs: int) -> str:
    """Return the remark on the number of runs of the paper's forms."""
    return (
        f"The paper has 100 runs, this table {runs}. From {SLOW_DB:g} dB on, the paper's forms of "
        f"VALSE and SVALSE have the first {min(runs, SLOW_RUNS)} of them; paired differences are "
        "over the runs that both methods have."
    )


def wide_table(
    studies: Sequence[Study], metrics: Sequence[str]
) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Return columns and rows: one row a case, one column a method and metric.

    The first metric has the methods' names as its columns.
    """
    methods = studies[0].methods
    keys = [(metric, method) for metric in metrics for method in methods]
    columns = ["SNR, dB", *(m if metric == metrics[0] else f"{m} {metric}" for metric, m in keys)]
    rows = [
        (case, *(_mean(study, metric, method, case) for metric, method in keys))
        for study in studies
        for case in study.cases
    ]
    return columns, rows


def _mean(study: Study, metric: str, method: str, case: str) -> float:
    return study.mean(metric, method, case) if method in study.methods else NAN


def _page(columns: Sequence[str]) -> tuple[str, ...]:
    """Return the columns of the page: the SNR, and the methods of the paper."""
    return (columns[0], *(name for name in (*SHOWN, "one snapshot") if name in columns))


SCALE = (
    "One snapshot: an efficient estimator from one snapshot with a known number of sources "
    "(deterministic Cramér-Rao bound, capped at the cut-off): a scale; methods with memory may be "
    "below it. Rebuilt: means of 3 runs of the published programs of SBL and SSBL, and of the "
    "paper's form of VALSE and SVALSE."
)
MOVED = (
    f"Off grid: all sources moved by {OFF_GRID:g} degrees, halfway between the directions of sbl "
    "and ssbl, which have one every half degree."
)


def _scale(name: str, runs: int, seed: int) -> dict[str, LineBound]:
    made = {f"{snr:g}": create(name, snr_db=snr) for snr in SNR_DB}
    return {case: line_bound(one, min(runs, 6), seed) for case, one in made.items()}  # type: ignore[arg-type]  # lines


def _draw_scale(ax: Axes, scale: Mapping[str, float]) -> None:
    ax.plot(SNR_DB, list(scale.values()), color="black", linewidth=1.0, linestyle=":",
            label="one snapshot (scale)")  # fmt: skip


def _draw_rebuilt(ax: Axes, name: str, part: int) -> None:
    """Draw the rebuilt GOSPA (part 0) or RMSE (1) as crosses, in the methods' colours."""
    for n, method in enumerate(SWEPT):
        values = [reference[n][part] for reference in SWEEP[name].values()]
        ax.plot(SNR_DB, values, "x", color=METHOD_COLOURS[method], markersize=5)
    ax.plot([], [], "x", color="0.3", markersize=5, label="rebuilt, in the same colours")


def _draw_parts(study: Study, name: str, scale: Mapping[str, LineBound]) -> Figure:
    """Draw panels (a) to (d), linear below 0.1 degrees since missed and false reach zero."""
    figure, axes = panels(2, 2, (11.0, 8.4))
    titles = {"gospa": "(a) GOSPA", "distance": "(b) distance", "missed": "(c) missed",
              "false": "(d) false"}  # fmt: skip
    for ax, (metric, title) in zip(axes, titles.items(), strict=True):
        if metric == "gospa":
            _draw_rebuilt(ax, name, 0)
            _draw_scale(ax, {case: one.gospa for case, one in scale.items()})
        plot_metric(study, metric, x="snr_db", ax=ax)
        ax.set(xlabel="SNR, dB", ylabel="degrees")
        ax.set_title(title, fontsize=10)
        ax.set_yscale("symlog", linthresh=0.1, linscale=0.4)
        ax.set_yticks([0, 0.1, 1, 10], ["0", "0.1", "1", "10"])
        ax.set_ylim(0, 60)
    _one_legend(figure, axes)
    return figure


def _one_legend(figure: Figure, axes: Sequence[Axes]) -> None:
    """Put the legend of the first panel above all of them, and name the intervals."""
    axes[0].errorbar([], [], yerr=[], color="0.3", linestyle="", capsize=2,
                     label="95 % interval of the mean (bootstrap)")  # fmt: skip
    handles, labels = axes[0].get_legend_handles_labels()
    for ax in axes:
        legend = ax.get_legend()
        if legend is not None:
            legend.remove()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, fontsize=8, frameon=False)


def fig10(runs: int, seed: int, out: Path | None = None, quick: bool = False) -> Report:
    """RMSE against the SNR, both scenarios."""
    rows: list[tuple[Any, ...]] = []
    results: dict[tuple[str, str, str], Any] = {}
    figure, axes = panels(1, 2, (11.0, 5.0))
    for ax, letter, name in zip(axes, "ab", SCENES, strict=False):
        study, scale = sweep(name, runs, seed, out, quick), _scale(name, runs, seed)
        _draw_rebuilt(ax, name, 1)
        _draw_scale(ax, {case: one.rmse for case, one in scale.items()})
        plot_metric(study, "rmse", x="snr_db", ax=ax)
        columns, mine = wide_table([study], ("rmse",))
        minimum = min(value for row in mine for value in row[1:])
        ax.set(xlabel="SNR, dB", ylabel="RMSE, degrees", yscale="log")
        ax.set_title(f"({letter}) {SCENES[name]}", fontsize=10)
        ax.set_ylim(bottom=max(minimum / 3, 1e-4))  # an interval may extend to zero
        number = name[-1]
        rebuilt = [tuple(pair[1] for pair in four) for four in SWEEP[name].values()]
        rows += [(f"{number}: {row[0]}", *row[1:], scale[row[0]].rmse, *known)
                 for row, known in zip(mine, rebuilt, strict=True)]  # fmt: skip
        results |= {(metric, method, f"{number}: {case}"): values
                    for (metric, method, case), values in results_of(study).items()}  # fmt: skip
    _one_legend(figure, axes)
    columns[0] = "scenario: SNR, dB"
    columns += ["one snapshot", *(f"{method} rebuilt" for method in SWEPT)]
    title = f"Fig. 10: RMSE against the SNR, {numbers(runs, quick)}, degrees"
    remarks = [*([] if quick else [fewer_runs(runs)]), SCALE, FORMS_SEEN]
    return Report(title, columns, rows, remarks, {"rmse": figure}, _page(columns), results,
                  {"rmse": title})  # fmt: skip
