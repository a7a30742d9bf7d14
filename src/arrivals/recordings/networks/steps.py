"""Steps of a sensor network from single readings, at common times or in windows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.recordings.formats.file_contents import MAX_BYTES, check_size
from arrivals.recordings.networks.network import Network
from arrivals.typing import Float, Int

MAX_SCATTERED = 1.5  # mean number of readings at a time, below which times are scattered
ROUND = np.array([1.0, 2.0, 5.0, 10.0])


@dataclass(frozen=True, eq=False)
class SingleReadings:
    """Readings of named sensors, one an entry; arrays (n_readings,).

    Parameters
    ----------
    time : ndarray
        Times, s.
    sensor : ndarray of int
        Indices in `name`.
    level : ndarray
        Levels, dB; NaN where missing.
    name : tuple of str
        Names of the sensors.
    positions : ndarray, shape (n_sensors, 2) or (n_readings, 2)
        Of the sensors, or of each reading's sensor if they move, m.
    moving : bool
        Whether the positions are those of the readings.
    static_source : bool
        Whether all readings are of a source at rest: they are one step.
    plane, start : optional
        As in `Network`.
    """

    time: Float
    sensor: Int
    level: Float
    name: tuple[str, ...]
    positions: Float
    moving: bool = False
    static_source: bool = False
    plane: LocalPlane | None = None
    start: float | None = None

    def select(self, which: Any) -> SingleReadings:
        """Return some of the readings, sorted by time, sensor and level."""
        time, sensor, level = self.time[which], self.sensor[which], self.level[which]
        order = np.lexsort((level, sensor, time))
        positions = self.positions[which][order] if self.moving else self.positions
        return replace(
            self, time=time[order], sensor=sensor[order], level=level[order], positions=positions
        )


def scattered_window(readings: SingleReadings, speed: float) -> float | None:
    """Return the length of windows for readings at scattered times; None if times are common.

    It is the median time between two readings of a sensor, as 1, 2 or 5 times a power of ten, so
    that a window holds about one reading a sensor; at most the time in which a source moves by half
    the mean distance between sensors.

    Parameters
    ----------
    readings : SingleReadings
        Sorted by time.
    speed : float
        Speed of a source, m/s.

    Examples
    --------
    >>> time = np.array([0.03, 0.4, 0.7, 1.1, 1.4, 1.8])
    >>> sensors = np.array([[0.0, 0.0], [50.0, 0.0], [0.0, 50.0]])
    >>> readings = SingleReadings(time, np.array([0, 1, 2] * 2), -time, ("a", "b", "c"), sensors)
    >>> scattered_window(readings, 1.5)
    1.0
    """
    time, sensor = np.unique(np.stack([readings.time, readings.sensor]), axis=1)  # no duplicates
    if readings.static_source or len(time) > MAX_SCATTERED * len(np.unique(time)):
        return None
    order = np.lexsort((time, sensor))
    between = np.diff(time[order])[np.diff(sensor[order]) == 0]
    between = between[between > 0]
    n_sensors = len(np.unique(sensor))
    if not between.size or n_sensors < 2:
        return None
    extent = float(np.ptp(readings.positions, axis=0).max())
    longest = extent / (2 * np.sqrt(n_sensors) * max(speed, 1e-9))
    length = min(float(np.median(between)), longest)
    if not length > 0:
        return None
    power = 10.0 ** np.floor(np.log10(length))
    choices = power * ROUND[power * ROUND <= longest]
    if not choices.size:
        return None
    window = float(choices[np.abs(np.log(choices / length)).argmin()])
    steps = len(np.unique(step_numbers(time, window)))
    return window if len(time) > MAX_SCATTERED * steps else None


def step_numbers(time: Float, window: float) -> Int:
    """Return the number of the window of each time; a time on an edge is in the later one."""
    return np.floor(time / window + 1e-9).astype(np.int64)


def as_network(readings: SingleReadings, window: float | None = None) -> Network:
    """Return the steps of readings; readings of one sensor in one step are averaged, in dB.

    Parameters
    ----------
    readings : SingleReadings
        Of one device, sorted.
    window : float, optional
        Length of a step, s; readings at one time are a step if None.

    Returns
    -------
    Network
        A step is at the mean of its readings' times.
    """
    if readings.static_source:
        return _survey(readings)
    key = readings.time if window is None else step_numbers(readings.time, window)
    _, first, at, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    n_steps, n_sensors = len(first), len(readings.name)
    check_size(8 * n_steps * n_sensors * (4 if readings.moving else 2), MAX_BYTES)
    time = readings.time[first]
    if window is not None:
        time = np.bincount(at, readings.time) / count
    valid = np.isfinite(readings.level)
    cell = (at * n_sensors + readings.sensor)[valid]
    number = np.bincount(cell, minlength=n_steps * n_sensors)

    def mean(values: Float) -> Float:
        total = np.bincount(cell, values[valid], minlength=n_steps * n_sensors)
        result: Float = np.full(total.shape, np.nan)
        np.divide(total, number, out=result, where=number > 0)
        return result.reshape(n_steps, n_sensors)

    if readings.moving:
        sensors = np.stack([mean(axis) for axis in readings.positions.T], axis=-1)
    else:
        sensors = np.broadcast_to(readings.positions, (n_steps, n_sensors, 2))
    return Network(readings.name, time, mean(readings.level), sensors,
                   plane=readings.plane, start=readings.start)  # fmt: skip


def _survey(readings: SingleReadings) -> Network:
    """Return one step with a sensor at each position where a source at rest was received."""
    valid = np.isfinite(readings.level)
    last = readings.time[-1:]
    positions, at = np.unique(readings.positions[valid], axis=0, return_inverse=True)
    at = at.ravel()
    level = np.bincount(at, readings.level[valid]) / np.bincount(at) if valid.any() else np.zeros(0)
    name = tuple(str(k) for k in range(len(positions)))
    return Network(name, last, level[None], positions[None],
                   plane=readings.plane, start=readings.start)  # fmt: skip
