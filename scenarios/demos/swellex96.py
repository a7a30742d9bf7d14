"""Demonstration on the shipped SWellEx-96 scene: three trackers, tracks files and one figure."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import as_file, files
from os import PathLike
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.recordings.readers import read
from arrivals.scenarios.demos.comparison import MethodComparison
from arrivals.trackers import create
from arrivals.typing import Complex, Float

FREQUENCY = 198.0  # Hz
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
    bar: Callable[..., Any] = lambda steps, **_: steps,
    n_steps: int | None = None,
) -> None:
    """Track a towed source with a vertical array of 63 elements, by three methods.

    The scene is a simulation of the SWellEx-96 experiment: sound reaches the array by several
    paths, from above and from below, each present for a part of the time.

    Parameters
    ----------
    out : path
        Folder for the tracks files (CSV) and the figure; created if missing.
    bar : callable
        Progress bar: takes the steps and `desc`, returns the steps, as tqdm does.
    n_steps : int, optional
        Maximum number of steps, of 350.
    """
    measurement, snapshots, time = swellex96()
    axes = {"ylim": (-50, 50), "yticks": np.arange(-45, 46, 15), "ylabel": "elevation, degrees"}
    methods = {
        name: (title, create(name, measurement=measurement)) for name, title in METHODS.items()
    }
    scene = MethodComparison("swellex96", measurement, snapshots, time, axes)
    scene.run(out, methods, bar, n_steps)
