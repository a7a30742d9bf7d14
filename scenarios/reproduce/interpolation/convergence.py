"""Figs 2 to 6 of the paper on the interpolation-delay filter: convergence."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.measurement_models import DelayInterpolator
from arrivals.plots.labels import legend_beside
from arrivals.scenarios.reproduce.interpolation.plots import (
    COLOURS,
    LEAVES,
    NAMES,
    draw_band,
    draw_rmse,
    make_figure,
)
from arrivals.scenarios.reproduce.interpolation.trials import (
    bound_deg,
    draws,
    filter_directions,
    rms,
    scan_records,
)
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.simulations.sampled_source import InterpolationTone
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SNRS_DB = (-10.0, -5.0, 0.0, 5.0)
PANELS = (
    ("literal", "frozen"),
    ("C", "D", "E"),
)  # rows of Figs 2 and 3: the paper's form, and ours
METHODS = (*PANELS[0], *PANELS[1])
LENGTHS = np.array([4, 6, 8, 10, 14, 20, 30, 40, 60, 80, 100])  # snapshots of the scans
FAR = 30.0  # degrees, a start two standard deviations away from 60
COEFFICIENTS = (("fig4", 1, "b"), ("fig5", 0, "a"))


def convergence(runs: int, seed: int) -> Report:
    """Convergence from the paper's starting values, 58 degrees for 70 and 25 for 30."""
    rows: list[tuple[Any, ...]] = []
    figures: dict[str, Figure] = {}
    results: dict[tuple[Any, ...], Float] = {}
    for number, (doa, start) in ((2, (30.0, 25.0)), (3, (70.0, 58.0))):
        paths = {}
        for snr_db in SNRS_DB:
            scenario = InterpolationTone(doa_deg=doa, snr_db=snr_db, n_steps=300)
            samples, bound = draws(scenario, runs, seed), bound_deg(scenario)
            row: list[Any] = [doa, snr_db]
            for method in METHODS:
                path = filter_directions(scenario, samples, method, start)
                paths[snr_db, method], error = path, path - doa
                results["end", doa, snr_db, method] = error[:, -1]
                row += [rms(error[:, k - 1]) for k in (300, 100, 30)]
                row.append(_settled(error))
            rows.append((*row, bound))
        figures[f"fig{number}"] = _draw(number, paths, doa, start)
    figures |= _coefficients(runs, seed, results)
    figures["fig6"] = _three_methods(runs, seed, results)
    remarks = (
        "A tone, for which two taps are exact, also where the paper has coupled tones: Table 1 has "
        "both. RMSE after 300 snapshots, degrees. CRB: the Cramér-Rao bound of unbiased "
        "estimates that know nothing of the direction; the filters know their start.",
        "The paper shows one trace a case, without numbers, and omits the errors of its estimates. "
        "The loop as printed (literal) ends where the sine is 1/κ too small; frozen is that "
        "loop with the index of (4), C the default of this library (Table 1 explains the forms).",
    )
    numbers = ("", " at 100", " at 30", ", snapshots to 1 degree")
    columns = ("doa_deg", "snr_db", *(f"{m}{n}" for m in METHODS for n in numbers), "CRB")
    title = f"Figs 2 to 6: convergence, {runs} trials"
    captions = {"fig6": f"{title}; {LEAVES}"}
    return Report(title, columns, rows, remarks, figures, ("doa_deg", "snr_db", *METHODS, "CRB"),
                  results, captions)  # fmt: skip


def _settled(error: Float) -> float:
    """Return the number of snapshots to a median error below one degree; NaN if not reached."""
    late = np.flatnonzero(np.median(np.abs(error), axis=0) >= 1)
    n = 1 if len(late) == 0 else int(late[-1]) + 2
    return np.nan if n > error.shape[1] else float(n)


def settling_lengths(error: Float) -> Float:
    """Return for each trial, (runs, n), the length from which its error stays below one degree.

    Twice the longest one where that is not reached.

    Examples
    --------
    >>> errors = np.zeros((2, len(LENGTHS)))
    >>> errors[1, 3] = 2.0
    >>> settling_lengths(errors)
    array([ 4., 14.])
    """
    late = np.abs(error) >= 1
    last = np.where(late.any(axis=1), late.shape[1] - np.argmax(late[:, ::-1], axis=1), 0)
    return np.append(LENGTHS, 2 * LENGTHS[-1])[last].astype(np.float64)


def _draw(number: int, paths: dict[tuple[float, str], Float], doa: float, start: float) -> Figure:
    """Draw Fig. 2 or 3: medians and 10 to 90 % of the estimates, the paper's form above ours."""
    n = len(SNRS_DB)
    figure, axes = make_figure(2, n, (12.0, 6.0), sharey="row", sharex=True)
    for index, ax in enumerate(axes):
        snr_db, methods = SNRS_DB[index % n], PANELS[index // n]
        for method in methods:
            path = paths[snr_db, method]
            draw_band(ax, np.arange(1, path.shape[1] + 1), path, method)
        ax.axhline(doa, color="black", linewidth=0.8, linestyle="--", zorder=4)
        if index < n:
            first = f"Fig. {number}: {doa:g}° from {start:g}°, medians; " if index == 0 else ""
            ax.set_title(f"{first}{snr_db:g} dB", fontsize=10)
        else:
            ax.set(xlabel="snapshot", ylim=(start - 8, doa + 12))
    axes[0].set_ylabel("the paper's form, degrees")
    axes[n].set_ylabel("ours, degrees")
    for method in METHODS:
        axes[0].plot([], [], color=COLOURS[method], label=NAMES[method])
    axes[0].plot([], [], color="black", linewidth=0.8, linestyle="--", label=f"truth, {doa:g}°")
    axes[0].fill_between([], [], [], color="0.8", label="80 % of the trials")
    handles, labels = axes[0].get_legend_handles_labels()
    wanted = dict(zip(labels, handles, strict=True))  # the last of each name
    figure.legend(wanted.values(), wanted, loc="outside upper center", ncols=7, fontsize=8,
                  frameon=False)  # fmt: skip
    return figure


def _coefficients(runs: int, seed: int, results: dict[tuple[Any, ...], Float]) -> dict[str, Figure]:
    """Draw Figs 4 and 5: the coefficients b and a while the filter converges to 60 degrees."""
    scenario = InterpolationTone(doa_deg=60.0, n_steps=100)
    taps, model = DelayInterpolator(scenario.correlation), scenario.measurement
    true = taps.coefficients(model.delay(np.pi / 3))
    figures = {name: make_figure(1, 1, (8.2, 3.8)) for name, _, _ in COEFFICIENTS}
    for method in PANELS[0]:
        doa = np.deg2rad(filter_directions(scenario, draws(scenario, runs, seed), method, 50.0))
        c = taps.coefficients(model.delay(doa))
        for figure, index, name in COEFFICIENTS:
            results[name, method] = c[:, -1, index] - true[index]
            draw_band(figures[figure][1][0], np.arange(1, 101), c[..., index], method)
    for figure, index, name in COEFFICIENTS:
        ax = figures[figure][1][0]
        ax.axhline(true[index], color="black", linewidth=0.8, linestyle="--", label="truth")
        ax.fill_between([], [], [], color="0.8", label="80 % of the trials")
        ax.set(
            xlabel="snapshot",
            ylabel=f"coefficient {name}",
            title=f"Fig. {figure[3:]}: coefficient {name} at 60 degrees, 5 dB, from 50; medians",
        )
        ax.title.set_fontsize(10)
        legend_beside(ax)
    return {name: figure for name, (figure, _) in figures.items()}


def _three_methods(runs: int, seed: int, results: dict[tuple[Any, ...], Float]) -> Figure:
    """Draw Fig. 6: the estimate of 60 degrees over snapshots, three methods and ours."""
    scenario = InterpolationTone(doa_deg=60.0, n_steps=100)
    samples = draws(scenario, runs, seed)
    figure, axes = make_figure(1, 2, (11.0, 4.2))
    for method in ("literal", "frozen", "C", "E"):
        path = filter_directions(scenario, samples, method, 50.0)
        results["settled", method] = settling_lengths(path[:, LENGTHS - 1] - 60)
        draw_band(axes[0], np.arange(1, 101), path, method)
        draw_rmse(axes[1], LENGTHS, path[:, LENGTHS - 1] - 60, method)
    for scan in ("conventional", "mvdr"):
        path = np.array([scan_records(scenario, samples[:, :n], scan) for n in LENGTHS]).T
        results["settled", scan] = settling_lengths(path - 60)
        draw_band(axes[0], LENGTHS, path, scan)
        draw_rmse(axes[1], LENGTHS, path - 60, scan)
    for method in ("literal", "frozen", "C"):
        path = filter_directions(scenario, samples, method, FAR)
        results["from afar", method] = path[:, -1] - 60
    axes[0].axhline(60, color="black", linewidth=0.8, linestyle="--", label="truth", zorder=4)
    axes[0].fill_between([], [], [], color="0.8", label="80 % of the trials")
    axes[0].set(ylabel="median estimate, degrees", ylim=(15, 75),
                title="Fig. 6: 60 degrees at 5 dB, filters from 50")  # fmt: skip
    axes[1].set(
        ylabel="RMSE, degrees",
        yscale="log",
        title="RMSE, with two standard errors",
    )
    for ax in axes:
        ax.set_xlabel("snapshot")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize=8)
    return figure
