"""Growth of CPU time with sensors, sources, bins, snapshots and runs: curves and fitted slopes.

    python benchmarks/scaling.py [--out docs/scaling] [--only svalse rss batch]

Prints the slopes of log CPU over log size, of a line through the medians of several rounds in which
the sizes take turns, and draws each group of curves to a picture with matplotlib.
"""

from __future__ import annotations

import argparse
import copy
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.plots.colours import PALETTE
from arrivals.plots.labels import legend_beside
from arrivals.scenarios import create
from arrivals.scenarios.simulations.signal_strength import Table1K3
from arrivals.trackers import SVALSE, Tracker, VariationalSolver
from arrivals.typing import Float

ROUNDS = 3
Work = Callable[[], object]


@dataclass(frozen=True)
class Curve:
    """CPU of one method over sizes.

    Parameters
    ----------
    group : str
        Picture that it belongs to.
    label : str
        What grows, and what is kept.
    axis : str
        What grows.
    sizes : tuple of int
        Sizes.
    make : callable
        `make(size)` returns the work, and by how many its CPU is divided.
    limit : float
        Largest slope wanted; NaN for none.
    """

    group: str
    label: str
    axis: str
    sizes: tuple[int, ...]
    make: Callable[[int], tuple[Work, int]]
    limit: float = np.nan


def svalse_steps(
    n_sensors: int, n_sources: int, n_bins: int = 1, n_snapshots: int = 1, n_steps: int = 15
) -> tuple[Work, int]:
    """Return a run of SVALSE on static sources, and its number of steps."""
    rng = np.random.default_rng(0)
    wavelength = (1 + 0.02 * np.arange(n_bins)).tolist()
    model = ArraySnapshot(
        SensorArray.ula(n_sensors, 0.5), wavelength[0] if n_bins == 1 else wavelength,
        noise=0.1, n_snapshots=n_snapshots,
    )  # fmt: skip
    doa = np.arcsin(np.linspace(-0.8, 0.8, n_sources + 2)[1:-1])
    shape = (n_steps, *model.shape[:-1], n_sources)
    w = np.exp(2j * np.pi * rng.random(shape))
    z = model.simulate(np.tile(doa, (n_steps, 1)), w, rng)
    return lambda: SVALSE(model).run(z), n_steps


def rss_steps(n_sensors: int, n_sources: int, n_steps: int = 3) -> tuple[Work, int]:
    """Return a run of `rss_vb` with five iterations a step, and its number of iterations."""
    n_iterations = 5
    scenario = Table1K3(n_sources=n_sources, n_sensors=n_sensors)
    trial = scenario.sample(np.random.default_rng(0))
    solver = VariationalSolver(max_iterations=n_iterations, tol_u=0.0, tol_theta=1e-9)
    tracker = trial.tracker("rss_vb", solver=solver)
    # one set of readings again and again: all iterations from one start
    return lambda: _updates(tracker, trial.measurements[0], n_steps), n_steps * n_iterations


def _updates(tracker: Tracker, z: Float, n_steps: int) -> None:
    for _ in range(n_steps):
        copy.deepcopy(tracker).update(z)


def batch(n_runs: int) -> tuple[Work, int]:
    """Return a batch of SVALSE on Fig. 4, and its number of steps of all runs."""
    scenario, n_steps = create("svalse_fig4"), 10
    trials = [scenario.sample(np.random.default_rng(seed)) for seed in range(n_runs)]
    tracker, z = trials[0].tracker("svalse"), [trial.measurements[:n_steps] for trial in trials]
    return lambda: tracker.run_batch(z), n_runs * n_steps


def curves() -> Iterator[Curve]:
    """Yield the curves."""
    sensors = (32, 64, 128, 256)
    yield Curve("svalse", "sensors, 1 source", "sensors", sensors,
                lambda n: svalse_steps(n, 1), 0.6)  # fmt: skip
    yield Curve("svalse", "sensors, 6 sources", "sensors", sensors,
                lambda n: svalse_steps(n, 6), 0.6)  # fmt: skip
    yield Curve("svalse", "sources, 64 sensors", "sources", (1, 2, 4, 8),
                lambda n: svalse_steps(64, n))  # fmt: skip
    yield Curve("svalse", "bins, 16 sensors, 2 sources", "bins", (2, 4, 8, 16, 32),
                lambda n: svalse_steps(16, 2, n_bins=n), 0.6)  # fmt: skip
    yield Curve("svalse", "snapshots, 16 sensors, 2 sources", "snapshots", (2, 8, 32, 128),
                lambda n: svalse_steps(16, 2, n_snapshots=n), 0.6)  # fmt: skip
    yield Curve("rss", "sensors, 3 sources, an iteration", "sensors",
                (100, 1000, 10_000, 100_000), lambda n: rss_steps(n, 3), 1.05)  # fmt: skip
    yield Curve("rss", "sources, 1000 sensors, an iteration", "sources", (1, 2, 4, 8, 16),
                lambda n: rss_steps(1000, n), 1.05)  # fmt: skip
    yield Curve("batch", "runs of svalse in a batch, Fig. 4, for each run", "runs",
                (1, 4, 16, 64), batch)  # fmt: skip


def cpu(curve: Curve, rounds: int = ROUNDS) -> Float:
    """Return CPU of each size, s: the median of rounds in which the sizes take turns."""
    works = [curve.make(size) for size in curve.sizes]
    for work, _ in works:
        work()  # what is made once
    times = np.empty((rounds, len(works)))
    for row in times:
        for k, (work, n) in enumerate(works):
            started = time.process_time()
            work()
            row[k] = (time.process_time() - started) / n
    return np.asarray(np.median(times, axis=0))


def slope(sizes: tuple[int, ...], seconds: Float) -> float:
    """Return the slope of a line through log CPU over log size."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def draw(group: str, measured: list[tuple[Curve, Float]], out: Path) -> None:
    """Draw the curves of a group, log-log, with their slopes."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator

    figure = Figure(figsize=(8, 3.8), layout="constrained")
    ax = figure.subplots()
    for (curve, seconds), colour in zip(measured, PALETTE, strict=False):
        label = f"{curve.label}: slope {slope(curve.sizes, seconds):.2f}"
        ax.loglog(curve.sizes, 1e3 * seconds, "o-", color=colour, label=label)
    ax.set_xlabel(" or ".join(dict.fromkeys(curve.axis for curve, _ in measured)))
    ax.set_ylabel("CPU of an iteration, ms" if group == "rss" else "CPU of a step, ms")
    ax.grid(visible=True, which="both", alpha=0.3)
    for axis, subs in ((ax.xaxis, (1,)), (ax.yaxis, (1, 2, 5))):
        axis.set_major_locator(LogLocator(subs=subs))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("")
    legend_beside(ax)
    figure.savefig(out / f"{group}.png", dpi=110)


def row(curve: Curve, seconds: Float) -> str:
    """Return the line of the table of a curve."""
    grows, wanted, met = slope(curve.sizes, seconds), "", ""
    if np.isfinite(curve.limit):
        wanted, met = f"{curve.limit:g}", "yes" if grows <= curve.limit else "**no**"
    ms = ", ".join(f"{1e3 * each:.3g}" for each in seconds)
    sizes = ", ".join(map(str, curve.sizes))
    return f"| {curve.group}: {curve.label} | {sizes} | {ms} | {grows:.2f} | {wanted} | {met} |"


def main() -> None:
    """Print the slopes and draw the pictures."""
    groups = tuple(dict.fromkeys(curve.group for curve in curves()))
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder of the pictures; none if not given")
    parser.add_argument("--only", nargs="+", choices=groups, default=groups)
    options = parser.parse_args()
    print(
        "| CPU of a step against | sizes | ms | slope | wanted | met |\n|---|---|---|---|---|---|"
    )
    for group in options.only:
        measured = []
        for curve in curves():
            if curve.group == group:
                measured.append((curve, cpu(curve)))
                print(row(*measured[-1]), flush=True)
        if options.out:
            options.out.mkdir(parents=True, exist_ok=True)
            draw(group, measured, options.out)


if __name__ == "__main__":
    main()
