"""A moving source: filters of the delay and their smoothers, beside scans of a window."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.motion_models import DelayDrift, DelayWalk, MotionModel
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.reproduce.interpolation.plots import NAMES, draw_band, make_figure
from arrivals.scenarios.reproduce.interpolation.trials import (
    SOURCES,
    draws,
    filter_directions,
    moving_runs,
    rms,
    scan_records,
)
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.simulations.sampled_source import InterpolationScenario
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCANS = ("conventional", "mvdr")
MOVING: tuple[tuple[str, MotionModel, dict[str, Any]], ...] = (
    ("B", DelayWalk(1e-3), {}),
    ("B", DelayWalk(1e-4), {}),
    ("C", DelayWalk(1e-3), {}),
    ("C", DelayWalk(1e-4), {}),
    ("C", DelayWalk(1e-5), {}),
    ("D", DelayWalk(1e-4), {"variant__aligned": True}),
    ("D", DelayWalk(1e-5), {"variant__aligned": True}),
    ("E", DelayWalk(1e-4), {}),
    ("C", DelayDrift(1e-8), {"variant__bidirectional": False}),
    ("phasor", DelayDrift(1e-9), {}),
    ("E", DelayDrift(1e-9), {}),
)


def moving(runs: int, seed: int) -> Report:
    """Track a source from 20 to 60 degrees in 400 snapshots, by filters and their smoothers."""
    cases: list[tuple[Any, ...]] = []
    for name in ("tone", "band"):
        cases += [(name, *case) for case in MOVING if (name, case[0]) != ("band", "phasor")]
    errors = parallel_map(_filter_errors, [(*case, runs, seed) for case in cases])
    rows: list[tuple[Any, ...]] = []
    results: dict[tuple[Any, ...], Float] = {}
    for (name, method, motion, _), each in zip(cases, errors, strict=True):
        q, kind = float(motion.get_params()["q"]), type(motion).__name__
        rows.append((name, method, kind, q, rms(each[0]), rms(each[1])))
        for way, values in zip(("filter", "smoother"), each, strict=True):
            results[name, way, f"{method} {kind} {q:g}"] = values
    windows = [(name, scan, runs, seed) for name in ("tone", "band") for scan in SCANS]
    for (name, scan, *_), values in zip(
        windows, parallel_map(_window_errors, windows), strict=True
    ):
        rows.append((name, f"{scan}, window of 26", "-", np.nan, rms(values), np.nan))
        results[name, "filter", scan] = values
    remarks = (
        "The paper has no moving source. RMSE over snapshots 50 to 380, degrees; the estimate of "
        "a filter with latency is compared with the truth of its own snapshot. The scans use a "
        "window centred on the snapshot, which is not causal, at every tenth snapshot.",
        "The noise q is the best of several values on such runs.",
    )
    columns = ("source", "method", "motion", "q", "filter", "smoother")
    title = f"A moving source, 20 to 60 degrees in 400 snapshots, 5 dB, {runs} trials"
    figures = {"ramp": _draw_ramp(runs, seed)}
    return Report(title, columns, rows, remarks, figures, results=results)


def _ramp(name: str) -> InterpolationScenario:
    return SOURCES[name].replace(doa_deg=20.0, end_deg=60.0, n_steps=400)


def _filter_errors(
    name: str, method: str, motion: MotionModel, params: dict[str, Any], runs: int, seed: int
) -> tuple[Float, Float]:
    scenario = _ramp(name)
    samples = draws(scenario, runs, seed)
    return moving_runs(scenario, samples, method, motion, slice(50, 380), **params)


def _window_errors(name: str, method: Any, runs: int, seed: int) -> Float:
    """Return the RMSE of each trial, degrees, of scans of 26 snapshots around every tenth one."""
    scenario, steps = _ramp(name), np.arange(50, 380, 10)
    samples, truth = draws(scenario, runs, seed), np.rad2deg(scenario.truth()[:, 0])
    scans = [scan_records(scenario, samples[:, k - 13 : k + 13], method) for k in steps]
    error = np.array(scans) - (truth[steps] + truth[steps - 1])[:, None] / 2
    return np.asarray(np.sqrt(np.mean(error**2, axis=0)))


def _draw_ramp(runs: int, seed: int) -> Figure:
    """Draw the errors of three filters of a tone: medians and 10 to 90 % of the trials."""
    scenario = _ramp("tone")
    samples, truth = draws(scenario, runs, seed), np.rad2deg(scenario.truth()[:, 0])
    figure, axes = make_figure(1, 2, (11.0, 4.2))
    for method, motion in (
        ("B", DelayWalk(1e-3)),
        ("C", DelayDrift(1e-8)),
        ("E", DelayDrift(1e-9)),
    ):
        path = filter_directions(scenario, samples, method, 20.0, motion=motion)
        steps = np.arange(1, path.shape[1] + 1)
        name = f"{NAMES[method]}, {type(motion).__name__}"
        draw_band(axes[0], steps, path, method, label=name)
        draw_band(axes[1], steps, path - truth, method)
    axes[0].plot(steps, truth, color="black", linewidth=0.8, linestyle="--", label="truth")
    axes[1].axhline(0, color="black", linewidth=0.8, linestyle="--")
    axes[0].fill_between([], [], [], color="0.8", label="80 % of the trials")
    axes[0].set(ylabel="direction, degrees", title="A tone at 5 dB: medians")
    axes[1].set(ylabel="estimate - present truth, degrees", ylim=(-5, 5), title="Errors")
    for ax in axes:
        ax.set_xlabel("snapshot")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, fontsize=8, frameon=False)
    return figure
