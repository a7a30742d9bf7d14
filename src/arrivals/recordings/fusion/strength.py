"""Readings of signal strength in the steps of fused positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.measurement_models import LogNormalRSS
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.recordings.fusion.common_steps import nearest_steps
from arrivals.recordings.fusion.station_options import path_loss, source_power
from arrivals.recordings.networks.network import Network
from arrivals.recordings.networks.network_files import read_npz
from arrivals.recordings.networks.sensor_tables import named
from arrivals.recordings.networks.steps import SingleReadings, as_network
from arrivals.recordings.networks.tables import read_table
from arrivals.recordings.networks.times import FIRST_DATE
from arrivals.trackers import AmplitudePrior
from arrivals.typing import Float, Int


@dataclass(frozen=True, eq=False)
class StrengthTable:
    """Single readings of sensors on the map.

    Parameters
    ----------
    readings : SingleReadings
        Readings; positions are those of the map.
    understood : tuple of str
        How the table was understood, in phrases.
    """

    readings: SingleReadings
    understood: tuple[str, ...] = ()

    @property
    def start(self) -> float | None:
        """Time 0 in seconds since 1970-01-01 UTC, where the readings have dates."""
        return self.readings.start


@dataclass(frozen=True, eq=False)
class StrengthSteps:
    """Readings by step, with their model and the prior of the log amplitudes.

    Parameters
    ----------
    model : LogNormalRSS
        Model of the readings, with the sensors' positions.
    amplitude : AmplitudePrior
        Prior of the sources' log amplitudes.
    readings : ndarray, shape (n_rows, n_sensors)
        Log amplitudes, Np; NaN where missing.
    row : ndarray of int, shape (n_steps,)
        Row of each step, -1 without a reading.
    """

    model: LogNormalRSS
    amplitude: AmplitudePrior
    readings: Float
    row: Int

    def at(self, step: int) -> Float | None:
        """Return the readings of a step, (n_sensors,), Np; None without one."""
        row = int(self.row[step])
        return None if row < 0 else self.readings[row]


def read_strength(
    rss: str | PathLike[str] | Network,
    sensors: Any = None,
    missing: Sequence[float] = (),
    plane: LocalPlane | None = None,
) -> StrengthTable:
    """Read the readings of fixed sensors, at positions of the map.

    Parameters
    ----------
    rss : path or Network
        Table or npz file of readings, or a network.
    sensors : path, mapping or array_like, optional
        As in `arrivals.locate`; required for a table.
    missing : sequence of float
        Levels, dB, that stand for a missing reading.
    plane : LocalPlane, optional
        Plane of the map, if stations have latitudes and longitudes.

    Returns
    -------
    StrengthTable

    Raises
    ------
    ValueError
        If a file is invalid, there are several devices, sensors move, or their positions are not
        in the coordinates of the stations.

    Examples
    --------
    >>> network = Network.fixed(["a", "b"], np.eye(2), [[-60.0, -72.0]])
    >>> read_strength(network).readings.level
    array([-60., -72.])
    """
    if isinstance(rss, str | PathLike) and Path(rss).suffix.lower() != ".npz":
        if sensors is None:
            raise ValueError("readings of signal strength require a table of sensors (--sensors)")
        table = read_table(rss, sensors, missing)
        with named(rss):
            if len(table.readings) != 1:
                raise ValueError(
                    f"readings must be of one device; got {len(table.readings)}: remove the others"
                )
            return StrengthTable(_on_map(next(iter(table.readings.values())), plane),
                                 table.understood)  # fmt: skip
    if sensors is not None:
        raise ValueError("sensors must be left out where the readings have them")
    network = rss if isinstance(rss, Network) else read_npz(rss, missing)
    return StrengthTable(_on_map(_single(network), plane))


def _single(network: Network) -> SingleReadings:
    """Return the readings of a network whose sensors do not move."""
    first = network.sensors[0]
    if not np.array_equal(network.sensors, np.broadcast_to(first, network.sensors.shape)):
        raise ValueError("sensors must not move")
    n_steps, n_sensors = network.rss_db.shape
    time, start = network.time, network.start
    if start is None and time[0] >= FIRST_DATE:
        start = float(np.floor(time[0]))
        time = time - start
    readings = SingleReadings(
        np.repeat(time, n_sensors), np.tile(np.arange(n_sensors), n_steps),
        network.rss_db.ravel(), network.name, first, plane=network.plane, start=start,
    )  # fmt: skip
    return readings.select(np.isfinite(readings.level))


def _on_map(readings: SingleReadings, plane: LocalPlane | None) -> SingleReadings:
    """Return readings whose sensors have positions of the map."""
    if readings.moving or readings.static_source:
        raise ValueError("sensors must not move: pass a table of sensors (--sensors)")
    if (readings.plane is None) != (plane is None):
        names = ("lat, lon", "x_m, y_m") if plane is None else ("x_m, y_m", "lat, lon")
        raise ValueError(
            f"sensors must have the coordinates of the stations; got {names[0]} for sensors and "
            f"{names[1]} for stations"
        )
    if readings.plane is None or plane is None:
        return readings
    degrees = readings.plane.to_lat_lon(*readings.positions.T)
    return replace(readings, positions=np.stack(plane.to_xy(*degrees), axis=-1), plane=plane)


def with_readings(steps: Float, duration: float, time: Float) -> Float:
    """Return steps to which those of readings outside of all of them are added.

    Parameters
    ----------
    steps : ndarray, shape (n_steps,)
        Middles of the steps, s.
    duration : float
        Of a step, s.
    time : ndarray, shape (n_readings,)
        Times of the readings, s.

    Returns
    -------
    ndarray, shape (n,)
        Increasing.

    Examples
    --------
    >>> with_readings(np.array([0.0, 4.0]), 1.0, np.array([0.2, 1.9, 2.1]))
    array([0., 2., 4.])
    """
    outside = time[nearest_steps(time, steps, duration / 2) < 0]
    number = np.floor((outside - steps[0]) / duration + 0.5)
    _, at, n = np.unique(number, return_inverse=True, return_counts=True)
    added = np.bincount(at.ravel(), outside, minlength=len(n)) / n
    return np.sort(np.concatenate([steps, added]))


def strength_steps(
    table: StrengthTable, steps: Float, duration: float, options: Mapping[str, Any]
) -> tuple[StrengthSteps, int]:
    """Return the readings of each step, and the number of those left out.

    Parameters
    ----------
    table : StrengthTable
        Single readings.
    steps : ndarray, shape (n_steps,)
        Middles of the steps, s. A reading is in the nearest one; those of one sensor in one step
        are averaged, in dB.
    duration : float
        Of a step, s.
    options : mapping of str to object
        Settings of `station_options`.

    Returns
    -------
    StrengthSteps
    int
        Number of readings in no step.

    Raises
    ------
    ValueError
        If no reading is in a step.

    Examples
    --------
    >>> network = Network.fixed(["a", "b"], np.eye(2), [[-60.0, -72.0]], np.array([1.1]))
    >>> found, _ = strength_steps(read_strength(network), np.arange(3.0), 1.0, {"alpha": 3.0})
    >>> found.row, found.at(0), found.at(1).round(2)
    (array([-1,  0, -1]), None, array([-6.91, -8.29]))
    """
    readings = table.readings
    at = nearest_steps(readings.time, steps, duration / 2)
    valid = at >= 0
    if not valid.any():
        first, last = readings.time.min(), readings.time.max()
        raise ValueError(
            f"readings of signal strength must have times from {steps[0]:g} to {steps[-1]:g} s; "
            f"got {first:g} to {last:g} s"
        )
    network = as_network(replace(readings, time=at.astype(np.float64)).select(valid))
    settings = path_loss(options)
    model, _ = network.readings_at(0, settings.model(network))
    amplitude = source_power(options).amplitude(network, settings.alpha)
    row = np.full(len(steps), -1)
    row[network.time.astype(np.int64)] = np.arange(len(network))
    found = StrengthSteps(model, amplitude, network.readings, row)
    return found, int(np.count_nonzero(~valid))
