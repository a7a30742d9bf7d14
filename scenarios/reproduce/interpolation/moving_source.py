"""A moving source: filters of the delay and their smoothers, beside scans of a window."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from arrivals.motion_models import DelayDrift, DelayWalk, MotionModel
from arrivals.scenarios.experiments.workers import parallel_map
from arrivals.scenarios.reproduce.interpolation.plots import COLOURS, NAMES, make_figure
from arrivals.scenarios.reproduce.interpolation.trials import (
    SOURCES,
    draws,
    filter_directions,
    moving_errors,
    rms,
    scan_records,
)
from arrivals.scenarios.reproduce.report import Report
from arrivals.scenarios.simulations.sampled_source import InterpolationScenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    rows: list[tuple[Any, ...]] = []
    for name in ("tone", "band"):
        filters = [c for c in MOVING if (name, c[0]) != ("band", "phasor")]
        rows += parallel_map(_moving_row, [(name, *case, runs, seed) for case in filters])
        scans = ("conventional", "mvdr")
        rows += parallel_map(_window_row, [(name, scan, min(runs, 20), seed) for scan in scans])
    remarks = (
        "The paper has no moving source. RMSE over snapshots 50 to 380, degrees; the estimate of "
        "a filter with latency is compared with the truth of its own snapshot. The scans use a "
        "window centred on the snapshot, which is not causal.",
        "The noise q is the best of several values on such runs.",
    )
    columns = ("source", "method", "motion", "q", "filter", "smoother")
    title = f"A moving source, 20 to 60 degrees in 400 snapshots, 5 dB, {runs} trials"
    return Report(title, columns, rows, remarks, {"ramp": _draw_ramp(runs, seed)})


def _ramp(name: str) -> InterpolationScenario:
    return SOURCES[name].replace(doa_deg=20.0, end_deg=60.0, n_steps=400)


def _moving_row(
    name: str, method: str, motion: MotionModel, params: dict[str, Any], runs: int, seed: int
) -> tuple[Any, ...]:
    scenario = _ramp(name)
    samples = draws(scenario, runs, seed)
    errors = moving_errors(scenario, samples, method, motion, slice(50, 380), **params)
    q = float(motion.get_params()["q"])
    return (name, method, type(motion).__name__, q, *errors)


def _window_row(name: str, method: Any, runs: int, seed: int) -> tuple[Any, ...]:
    """Return the RMSE, degrees, of scans of 26 snapshots around every tenth one."""
    scenario, steps = _ramp(name), np.arange(50, 380, 10)
    samples, truth = draws(scenario, runs, seed), np.rad2deg(scenario.truth()[:, 0])
    scans = [scan_records(scenario, samples[:, k - 13 : k + 13], method) for k in steps]
    error = rms(np.array(scans) - (truth[steps] + truth[steps - 1])[:, None] / 2)
    return (name, f"{method}, window of 26", "-", np.nan, error, np.nan)


def _draw_ramp(runs: int, seed: int) -> Figure:
    scenario = _ramp("tone")
    samples = draws(scenario, runs, seed)
    figure, (ax,) = make_figure(1, 1, (7.0, 4.2))
    drift = {"C": DelayDrift(1e-8), "B": DelayWalk(1e-3), "E": DelayDrift(1e-9)}
    for method, motion in sorted(drift.items()):
        path = filter_directions(scenario, samples[:1], method, 20.0, motion=motion)[0]
        ax.plot(path, color=COLOURS[method], linewidth=1,
                label=f"{NAMES[method]}, {type(motion).__name__}")  # fmt: skip
    truth = np.rad2deg(scenario.truth()[:, 0])
    ax.plot(truth, color="black", linewidth=0.8, linestyle="--", label="truth")
    ax.set(xlabel="snapshot", ylabel="direction, degrees", title="One trial at 5 dB")
    ax.legend(fontsize=8)
    return figure
