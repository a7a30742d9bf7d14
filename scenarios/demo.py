"""The demonstration: three trackers on shipped data, a table of tracks of each and one picture."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios.readers import read
from arrivals.trackers import create
from arrivals.trackers.recorder import Run
from arrivals.typing import Complex, Float

FREQUENCY = 198.0  # Hz
METHODS = {
    "svalse": "SVALSE: tracks, one colour a label",
    "valse": "VALSE: each snapshot on its own",
    "cbf": "Conventional beamformer: peaks within 10 dB",
}


def swellex96() -> tuple[ArraySnapshot, Complex, Float]:
    """Return the shipped scene: a tone towed past a vertical line array, simulated.

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
        heard = read(path, array=array).snapshots(FREQUENCY)
    measurement = ArraySnapshot(array, array.wavelength(FREQUENCY))
    return measurement, heard.values, heard.time


def demo(
    out: str | PathLike[str] = "arrivals-demo",
    bar: Callable[..., Any] = lambda steps, **_: steps,
    n_steps: int | None = None,
) -> None:
    """Track the sound of a towed source past a 63-element vertical array, by three methods.

    The scene is a simulation of the SWellEx-96 experiment: sound reaches the array by several
    paths, from above and from below, that come and go. It takes about a minute.

    Parameters
    ----------
    out : path
        Folder for the tracks files (CSV) and the picture; made if it is not there.
    bar : callable
        Takes the steps and `desc`, gives the steps back, such as tqdm.
    n_steps : int, optional
        Stop after so many of the 350 steps.
    """
    from threadpoolctl import threadpool_limits

    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    measurement, snapshots, time = swellex96()
    snapshots, time = snapshots[:n_steps], time[:n_steps]
    runs = {}
    for name in METHODS:
        tracker = create(name, measurement=measurement)
        with threadpool_limits(1, "blas"):
            runs[name] = tracker.run(bar(snapshots, desc=f"{name:<6}")).at(time)
        runs[name].to_csv(folder / f"{name}.csv")
        print(f"{folder / name}.csv: {_told(runs[name])}", flush=True)
    picture = folder / "swellex96.png"
    _draw(picture, runs, snapshots, measurement)
    print(picture)


def _told(run: Run) -> str:
    """Return in words how much was found."""
    n_labels = len(np.unique(run.label[run.label >= 0]))
    labels = f" under {n_labels} labels" if n_labels else ""
    return f"{run.n_found.sum()} directions{labels} in {len(run)} steps, {run.elapsed:.1f} s"


def _draw(path: Path, runs: dict[str, Run], snapshots: Complex, measurement: ArraySnapshot) -> None:
    """Draw the tracks of each method over the beam power, one below the other."""
    from matplotlib.figure import Figure

    from arrivals.scenarios.plots import plot_bearing_time, save

    figure = Figure(figsize=(9.0, 10.5), layout="constrained")
    panels = figure.subplots(len(runs), sharex=True)
    for ax, (name, run) in zip(panels, runs.items(), strict=True):
        plot_bearing_time(run, snapshots=snapshots, measurement=measurement, time=run.time, ax=ax)
        ax.set_title(METHODS[name], loc="left", fontsize=11)
        ax.set(ylim=(-50, 50), yticks=np.arange(-45, 46, 15), ylabel="elevation, degrees")
        ax.label_outer()
    save(panels[0], path)
