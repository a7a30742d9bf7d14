"""Demonstration on a recorded infrasound array: intermittent sources."""

from __future__ import annotations

from importlib.resources import as_file, files
from os import PathLike

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.recordings.framing import frame_recording
from arrivals.recordings.readers import read
from arrivals.scenarios.demos.comparison import Bar, MethodComparison, silent
from arrivals.trackers import CBF, SVALSE, VALSE, NewtonSolver, Tracker
from arrivals.typing import Complex, Float

FREQUENCIES = (0.6, 1.0, 1.4, 1.8, 2.2)  # Hz
SLOWNESS = np.linspace(2.0, 5.0, 10) / 1000  # s/m
METHODS = {
    "svalse": "SVALSE: tracks, one colour a label",
    "valse": "VALSE: each step independently",
    "cbf": "Conventional beamformer: its highest peak",
}


def brp2012() -> tuple[ArraySnapshot, Complex, Float]:
    """Return 20 minutes of a recorded infrasound array, in steps of 10 s every 4.96 s.

    Returns
    -------
    measurement : ArraySnapshot
        Four microphones in Utah; five frequencies from 0.6 to 2.2 Hz, three windows of 5 s a
        step, the slowness unknown between 2 and 5 s/km. Azimuths are clockwise from north.
    steps : ndarray, shape (240, 5, 3, 4)
        Snapshots (n_steps, n_bins, n_snapshots, n_sensors).
    time : ndarray, shape (240,)
        Centres of the steps, s after 18:00 UTC, 9 April 2012.

    Examples
    --------
    >>> measurement, steps, time = brp2012()
    >>> steps.shape, measurement.shape, time[:2]
    ((240, 5, 3, 4), (5, 3, 4), array([4.98, 9.94]))
    """
    with as_file(files("arrivals.scenarios") / "data" / "brp2012.toml") as path:
        array = SensorArray.from_toml(path)
    with as_file(files("arrivals.scenarios") / "data" / "brp2012.npz") as path:
        recording = read(path, array=array, variable="samples")
    steps = frame_recording(recording, FREQUENCIES, window=125, hop=62, n_snapshots=3, stride=2)
    measurement = ArraySnapshot(
        array,
        [array.wavelength(f) for f in FREQUENCIES],
        n_snapshots=3,
        slowness=(SLOWNESS * (array.speed or np.nan)).tolist(),
    )
    return measurement, steps.values, steps.time


def tracker(name: str, measurement: ArraySnapshot) -> Tracker:
    """Return a tracker with the settings for this recording.

    At most two sources, as four sensors resolve a few tens of degrees. Snapshots overlap and
    deviate from plane waves in the same way, so that four count as one. A power floor excludes
    gusts of wind.
    """
    if name == "cbf":
        return CBF(measurement, max_sources=1)
    solver = NewtonSolver(tempering=4.0, power_floor=3.0, max_components=2, merge=np.deg2rad(1.5))
    if name == "valse":
        return VALSE(measurement, solver=solver)
    return SVALSE(
        measurement, BernoulliVonMises(sigma_doa=np.deg2rad(3.0), still=0.1), solver=solver
    )


def infrasound(
    out: str | PathLike[str] = "arrivals-demo",
    bar: Bar = silent,
    n_steps: int | None = None,
) -> None:
    """Track intermittent infrasound recorded by an array of four microphones.

    Between intervals of wind alone there are three arrivals: a short one from the north-west, a
    long one from the west-south-west, and one from the north-west again.

    Parameters
    ----------
    out : path
        Folder for the tracks files (CSV) and the figure; created if missing.
    bar : callable
        Progress bar: takes the steps and `desc`, returns the steps, as tqdm does.
    n_steps : int, optional
        Maximum number of steps, of 240.
    """
    measurement, steps, time = brp2012()
    axes = {"ylabel": "azimuth from north, degrees"}
    scene = MethodComparison("brp2012", measurement, steps, time, axes, prefix="brp2012-")
    methods = {name: (title, tracker(name, measurement)) for name, title in METHODS.items()}
    scene.run(out, methods, bar, n_steps)
