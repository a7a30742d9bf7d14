"""Measured sensor networks: positions and readings over time, from CSV or npz."""

from __future__ import annotations

import csv
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.typing import Float

TIMES = ("time_s", "time", "t")
LEVELS = ("rss_db", "rss_dbm", "level_db", "rss")


@dataclass(frozen=True, eq=False)
class Network:
    """Readings of named sensors over time.

    Parameters
    ----------
    name : tuple of str
        Names of the sensors.
    time : ndarray, shape (n_steps,)
        Times of the steps, s.
    rss_db : ndarray, shape (n_steps, n_sensors)
        Levels, dB or dBm; NaN where missing.
    sensors : ndarray, shape (n_steps, n_sensors, 2)
        Positions, m; NaN where there is no reading.
    truth : ndarray, shape (n_steps, n_sources, 2), optional
        True positions of the sources, m, where they are known.

    Examples
    --------
    >>> sensors = np.array([[0.0, 0.0], [50.0, 0.0]])
    >>> network = Network.fixed(["a", "b"], sensors, [[-60.0, -72.0], [-61.0, np.nan]])
    >>> network.readings.round(2)
    array([[-6.91, -8.29],
           [-7.02,   nan]])
    """

    name: tuple[str, ...]
    time: Float
    rss_db: Float
    sensors: Float
    truth: Float | None = None

    def __post_init__(self) -> None:
        repeated = sorted({name for name in self.name if self.name.count(name) > 1})
        if repeated:
            raise ValueError(f"name must have no duplicates; got {repeated[0]!r} twice")
        shape = (len(self.time), len(self.name))
        for name, expected in (("rss_db", shape), ("sensors", (*shape, 2))):
            got = getattr(self, name).shape
            if got != expected:
                raise ValueError(
                    f"{name} must have shape {expected}; got {getattr(self, name).shape}"
                )
        valid = np.isfinite(self.rss_db)
        if not valid.any():
            raise ValueError("rss_db must have a valid reading; all are missing")
        unplaced = valid & ~np.isfinite(self.sensors).all(axis=-1)
        if unplaced.any():
            step, sensor = np.argwhere(unplaced)[0]
            raise ValueError(
                f"{self.name[sensor]!r} has a reading, but no position, in step {step}"
            )

    @classmethod
    def fixed(
        cls, name: Sequence[str], positions: Float, rss_db: Any, time: Float | None = None
    ) -> Network:
        """Return a network of sensors that do not move, positions (n_sensors, 2), m."""
        rss_db = np.asarray(rss_db, dtype=np.float64)
        sensors = np.broadcast_to(positions, (len(rss_db), *np.shape(positions)))
        distinct = {tuple(position) for position in np.asarray(positions).tolist()}
        if len(distinct) < len(positions):
            warnings.warn("two sensors have the same position", stacklevel=2)
        time = np.arange(len(rss_db), dtype=np.float64) if time is None else time
        return cls(tuple(name), time, rss_db, sensors)

    @property
    def readings(self) -> Float:
        """Levels as log amplitudes, Np, (n_steps, n_sensors)."""
        return db_to_neper(self.rss_db)

    def __len__(self) -> int:
        return len(self.time)

    def select(self, steps: Any) -> Network:
        """Return the network at some of the steps."""
        truth = None if self.truth is None else self.truth[steps]
        return Network(
            self.name, self.time[steps], self.rss_db[steps], self.sensors[steps], truth
        )  # fmt: skip

    def readings_at(self, step: int, model: LogNormalRSS) -> tuple[LogNormalRSS, Float]:
        """Return the model with the sensor positions of one step, and its readings, Np.

        Parameters
        ----------
        step : int
        model : LogNormalRSS
            With one entry for each sensor of the network.

        Returns
        -------
        model : LogNormalRSS
        z : ndarray, shape (n_sensors,)
        """
        positions = self.sensors[step]
        is_finite = np.isfinite(positions).all(axis=-1, keepdims=True)
        return model.replace(sensors=np.where(is_finite, positions, 0.0)), self.readings[step]


def read_network(
    readings: str | PathLike[str], sensors: str | PathLike[str] | None = None
) -> Network:
    """Read a measured network from files.

    Parameters
    ----------
    readings : path
        ``.npz``: arrays ``rss_db`` (n_steps, n_sensors), ``sensor_xy`` (n_steps, n_sensors, 2) or
        (n_sensors, 2), and optionally ``sensor_name``, ``time``, ``tx_xy``. ``.csv``: a heading
        and one row a step, ``time_s`` and a column for each sensor; or one row a reading,
        ``time_s, sensor, rss_db``. Levels in dB or dBm; empty where missing.
    sensors : path, optional
        Table of the sensors for a CSV file, with the columns ``name, x_m, y_m``.

    Returns
    -------
    Network

    Raises
    ------
    ValueError
        If a sensor is listed twice or unknown, all readings are missing, or a cell is not a number.

    Examples
    --------
    >>> read_network("readings.csv")
    Traceback (most recent call last):
    ValueError: readings.csv requires a table of sensors, with the columns name, x_m, y_m
    """
    if Path(readings).suffix == ".npz":
        return _from_npz(readings)
    if sensors is None:
        raise ValueError(f"{readings} requires a table of sensors, with the columns name, x_m, y_m")
    name, positions = read_sensors(sensors)
    time, rss_db = _levels(readings, name)
    return Network.fixed(name, positions, rss_db, time)


def read_sensors(path: str | PathLike[str]) -> tuple[list[str], Float]:
    """Return names and positions (n_sensors, 2), m, of a table with columns name, x_m, y_m."""
    rows = _table(path)
    for column in ("name", "x_m", "y_m"):
        if column not in rows[0]:
            raise ValueError(f"{path}: the column {column!r} is missing")
    name = [row["name"].strip() for row in rows]
    repeated = sorted({one for one in name if name.count(one) > 1})
    if repeated:
        raise ValueError(f"{path}: the sensor {repeated[0]!r} is listed twice")
    positions = np.array([[_number(path, row[c]) for c in ("x_m", "y_m")] for row in rows])
    if not np.isfinite(positions).all():
        raise ValueError(f"{path}: a position is missing")
    return name, positions


def _from_npz(path: str | PathLike[str]) -> Network:
    with np.load(path) as file:
        held = {key: file[key] for key in file.files}
    for key in ("rss_db", "sensor_xy"):
        if key not in held:
            raise ValueError(f"{path}: the array {key!r} is missing")
    rss_db = held["rss_db"].astype(np.float64)
    n_steps, n_sensors = rss_db.shape
    sensors = np.broadcast_to(held["sensor_xy"], (n_steps, n_sensors, 2)).astype(np.float64)
    name = held.get("sensor_name", np.arange(n_sensors)).astype(str).tolist()
    time = held.get("time", np.arange(n_steps)).astype(np.float64)
    truth = held["tx_xy"].astype(np.float64) if "tx_xy" in held else None
    return Network(tuple(name), time, rss_db, sensors, truth)


def _levels(path: str | PathLike[str], name: list[str]) -> tuple[Float, Float]:
    """Return times (n_steps,) and levels (n_steps, n_sensors) of a table of readings."""
    rows = _table(path)
    time = next((key for key in TIMES if key in rows[0]), None)
    level = next((key for key in LEVELS if key in rows[0]), None)
    if "sensor" in rows[0] and level is not None:
        return _long(path, rows, name, time, level)
    columns = [key for key in rows[0] if key != time]
    _check_sensor_names(path, columns, name)
    rss_db = np.full((len(rows), len(name)), np.nan)
    for column in columns:
        rss_db[:, name.index(column)] = [_number(path, row[column]) for row in rows]
    if time is None:
        return np.arange(len(rows), dtype=np.float64), rss_db
    return np.array([_number(path, row[time]) for row in rows]), rss_db


def _long(
    path: str | PathLike[str],
    rows: list[dict[str, str]],
    name: list[str],
    time: str | None,
    level: str,
) -> tuple[Float, Float]:
    if time is None:
        raise ValueError(f"{path}: the column 'time_s' is missing")
    _check_sensor_names(path, [row["sensor"].strip() for row in rows], name)
    times = np.array([_number(path, row[time]) for row in rows])
    steps, at = np.unique(times, return_inverse=True)
    rss_db = np.full((len(steps), len(name)), np.nan)
    for step, row in zip(at.ravel(), rows, strict=True):
        sensor = name.index(row["sensor"].strip())
        if np.isfinite(rss_db[step, sensor]):
            raise ValueError(f"{path}: {row['sensor']!r} has two readings at {row[time]} s")
        rss_db[step, sensor] = _number(path, row[level])
    return steps, rss_db


def _check_sensor_names(path: str | PathLike[str], names: list[str], table: list[str]) -> None:
    for name in names:
        if name not in table:
            raise ValueError(f"{path}: the sensor {name!r} is not in the table of sensors")


def _table(path: str | PathLike[str]) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file, skipinitialspace=True, restval="")
        header = reader.fieldnames or []
        repeated = sorted({name for name in header if header.count(name) > 1})
        if repeated:
            raise ValueError(f"{path}: the column {repeated[0]!r} is listed twice")
        rows = list(reader)
    if not rows:
        raise ValueError(f"{path}: there is no row below the header")
    if any(None in row for row in rows):
        raise ValueError(f"{path}: a row has more cells than the header")
    return rows


def _number(path: str | PathLike[str], cell: str) -> float:
    try:
        return float(cell) if cell.strip() else np.nan
    except ValueError:
        raise ValueError(f"{path}: {cell!r} is not a number") from None
