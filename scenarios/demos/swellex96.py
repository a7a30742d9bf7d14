"""Demonstration on the shipped SWellEx-96 scene: tracks files, directions, and ranges."""

from __future__ import annotations

from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.plots.bearing_time import plot_bearing_time, save
from arrivals.plots.labels import legend_beside
from arrivals.plots.over_time import plot_range
from arrivals.recordings.readers import read
from arrivals.scenarios.demos.comparison import Bar, MethodComparison, silent
from arrivals.scenarios.simulations.swellex96 import TowPastLine
from arrivals.trackers import SVALSE, NewtonSolver, Run, create
from arrivals.typing import Complex, Float

FREQUENCY = 198.0  # Hz
AXES = {"ylim": (-50, 50), "yticks": np.arange(-45, 46, 15), "ylabel": "elevation, degrees"}
METHODS = {
    "svalse": "SVALSE: tracks, one colour a label",
    "valse": "VALSE: each snapshot independently",
    "cbf": "Conventional beamformer: peaks within 10 dB",
}


def swellex96() -> tuple[ArraySnapshot, Complex, Float]:
    """Return the shipped simulation of a tone towed past a vertical line array.

    Returns
    -------
    measurement : ArraySnapshot
        The array of the SWellEx-96 experiment at 198 Hz, 63 sensors; directions are elevations,
        positive from above.
    snapshots : ndarray, shape (350, 63)
    time : ndarray, shape (350,)
        Centres of the snapshots, s.

    Examples
    --------
    >>> measurement, snapshots, time = swellex96()
    >>> snapshots.shape, time[:3]
    ((350, 63), array([ 5.461, 16.384, 27.307]))
    """
    with as_file(files("arrivals.scenarios") / "data" / "swellex96.toml") as path:
        array = SensorArray.from_toml(path)
    with as_file(files("arrivals.scenarios") / "data" / "swellex96.npz") as path:
        snapshots = read(path, array=array).snapshots(FREQUENCY)
    measurement = ArraySnapshot(array, array.wavelength(FREQUENCY))
    return measurement, snapshots.values, snapshots.time


def demo(
    out: str | PathLike[str] = "arrivals-demo",
    bar: Bar = silent,
    n_steps: int | None = None,
) -> None:
    """Track a towed source with a vertical array of 63 elements, by three methods.

    The scene is a simulation of the SWellEx-96 experiment: sound reaches the array by several
    paths, from above and from below, each present for a part of the time. A fourth run has the
    range of each path, by the curvature of its wavefront, beside the ship's.

    Parameters
    ----------
    out : path
        Folder for the tracks files (CSV) and the figures; created if missing.
    bar : callable
        Progress bar: takes the steps and `desc`, returns the steps, as tqdm does.
    n_steps : int, optional
        Maximum number of steps, of 350.
    """
    measurement, snapshots, time = swellex96()
    methods = {
        name: (title, create(name, measurement=measurement)) for name, title in METHODS.items()
    }
    scene = MethodComparison("swellex96", measurement, snapshots, time, AXES)
    scene.run(out, methods, bar, n_steps)
    run = scene.track(out, "svalse-range", with_range(measurement), bar, n_steps)
    figure = Path(out) / "swellex96-range.png"
    draw_ranges(figure, run, snapshots[:n_steps], measurement)
    print(figure)


def with_range(measurement: ArraySnapshot) -> SVALSE:
    """Return SVALSE with a range a path; deviations from curved waves count as noise.

    Examples
    --------
    >>> with_range(swellex96()[0]).measurement.unknowns
    'range'
    """
    return SVALSE(measurement.replace(unknowns="range"), solver=NewtonSolver(max_snr_db=15.0))


def slant_range() -> Float:
    """Return the distances of the source from the middle of the array, m, (350,).

    Examples
    --------
    >>> round(slant_range().min())
    912
    """
    scenario = TowPastLine()
    height = scenario.source_depth + scenario.measurement.array.positions[:, 0].mean()
    return np.asarray(np.hypot(scenario.distances, height))


def draw_ranges(path: Path, run: Run, snapshots: Complex, measurement: ArraySnapshot) -> None:
    """Draw directions, and below them ranges and the slant range of the ship.

    Parameters
    ----------
    path : Path
        Picture.
    run : Run
        Run of a tracker of direction and range.
    snapshots : ndarray, shape (n_steps, 63)
    measurement : ArraySnapshot
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    above, below = figure.subplots(2, sharex=True)
    plot_bearing_time(run, snapshots=snapshots, measurement=measurement, time=run.time, ax=above)
    above.set_title("SVALSE with range: tracks, one colour a label", fontsize=11)
    above.set(**AXES)
    above.label_outer()
    plot_range(run, time=run.time, ax=below)
    below.plot(run.time, slant_range()[: len(run)], color="black", linewidth=1, label="ship")
    legend_beside(below)
    save(below, path)
