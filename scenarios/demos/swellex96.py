"""The demonstration: three trackers on shipped data, a table of tracks of each and one picture."""

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
    paths, from above and from below, that come and go.

    Parameters
    ----------
    out : path
        Folder for the tracks files (CSV) and the picture; made if it is not there.
    bar : callable
        Takes the steps and `desc`, gives the steps back, such as tqdm.
    n_steps : int, optional
        Stop after so many of the 350 steps.
    """
    measurement, snapshots, time = swellex96()
    axes = {"ylim": (-50, 50), "yticks": np.arange(-45, 46, 15), "ylabel": "elevation, degrees"}
    methods = {
        name: (title, create(name, measurement=measurement)) for name, title in METHODS.items()
    }
    scene = MethodComparison("swellex96", measurement, snapshots, time, axes)
    scene.run(out, methods, bar, n_steps)
