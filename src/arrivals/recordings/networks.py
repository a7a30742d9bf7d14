"""Measured sensor networks: positions and readings over time, from CSV or npz."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.files import file_error, open_input
from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.measurement_models.signal_strength.fill_values import without
from arrivals.measurements import real_numbers
from arrivals.recordings.formats.file_contents import MAX_BYTES, check_size
from arrivals.recordings.formats.numpy_files import numpy_arrays
from arrivals.tables import TableRow, named_rows
from arrivals.typing import Float

TIMES = ("time_s", "time", "t")
ARRAYS = ("rss_db", "sensor_xy", "sensor_name", "time", "tx_xy")  # of an npz file
MAX_LEVEL_DB = 340.0  # 39 Np: levels beyond are no measurements
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
        for key in ("time", "rss_db", "sensors", "truth"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, real_numbers(key, getattr(self, key)))
        repeated = sorted({name for name in self.name if self.name.count(name) > 1})
        if repeated:
            raise ValueError(f"name must have no duplicates; got {repeated[0]!r} twice")
        shape = (self.time.size, len(self.name))
        if self.time.ndim != 1:
            raise ValueError(f"time must have shape (n_steps,); got {self.time.shape}")
        for name, expected in (("rss_db", shape), ("sensors", (*shape, 2))):
            got = getattr(self, name).shape
            if got != expected:
                raise ValueError(
                    f"{name} must have shape {expected}; got {getattr(self, name).shape}"
                )
        if not np.isfinite(self.time).all():
            raise ValueError(f"time must be finite; got NaN in step {np.isnan(self.time).argmax()}")
        got = (len(self), 0, 2) if self.truth is None else self.truth.shape
        if len(got) != 3 or got[::2] != (len(self), 2):
            raise ValueError(f"truth must have shape ({len(self)}, n_sources, 2); got {got}")
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
        rss_db = real_numbers("rss_db", rss_db)
        positions = real_numbers("positions", positions)
        sensors = np.broadcast_to(positions, (len(rss_db), *np.shape(positions)))
        distinct = {tuple(position) for position in positions.tolist()}
        if len(distinct) < len(positions):
            warnings.warn("two sensors have the same position", stacklevel=2)
        time = np.arange(len(rss_db), dtype=np.float64) if time is None else time
        return cls(tuple(name), time, rss_db, sensors)

    @property
    def readings(self) -> Float:
        """Levels as log amplitudes, Np, (n_steps, n_sensors)."""
        return db_to_neper(self.rss_db)

    @property
    def extent(self) -> float:
        """Extent of the sensors, the larger of x and y, m; 1 m if they share a position."""
        positions = self.sensors[np.isfinite(self.sensors).all(axis=-1)]
        return float(np.ptp(positions, axis=0).max()) or 1.0

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
    readings: str | PathLike[str],
    sensors: str | PathLike[str] | None = None,
    missing: Sequence[float] = (),
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
    missing : sequence of float
        Levels, dB, that stand for a missing reading, such as 100 or -200.

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
    if Path(readings).suffix.lower() == ".npz":
        network = _from_npz(readings, missing)
        with _named(readings):
            return _in_range(network)
    if sensors is None:
        raise ValueError(f"{readings} requires a table of sensors, with the columns name, x_m, y_m")
    name, positions = read_sensors(sensors)
    with _named(readings):
        time, rss_db = _levels(_table(readings), name)
        return _in_range(Network.fixed(name, positions, without(rss_db, missing), time))


def _in_range(network: Network) -> Network:
    """Return a network whose levels can be those of a receiver."""
    worst = network.rss_db.flat[np.nanargmax(np.abs(network.rss_db))]
    if abs(worst) > MAX_LEVEL_DB:
        cure = f"pass missing=[{worst:g}] (--missing {worst:g}) if it stands for a missing reading"
        raise ValueError(f"rss_db must lie within ±{MAX_LEVEL_DB:g} dB; got {worst:g}: {cure}")
    return network


def read_sensors(path: str | PathLike[str]) -> tuple[list[str], Float]:
    """Return names and positions (n_sensors, 2), m, of a table with columns name, x_m, y_m."""
    with _named(path):
        rows = _table(path)
        for column in ("name", "x_m", "y_m"):
            if column not in rows[0].columns:
                raise ValueError(f"the column {column!r} is missing")
        name = [row["name"].strip() for row in rows]
        repeated = sorted({one for one in name if name.count(one) > 1})
        if repeated:
            raise ValueError(f"the sensor {repeated[0]!r} is listed twice")
        positions = np.array([[row.real(c) for c in ("x_m", "y_m")] for row in rows])
        if not np.isfinite(positions).all():
            missing = rows[int(np.argmin(np.isfinite(positions).all(axis=1)))]
            raise ValueError(f"line {missing.number}: a position is missing")
        return name, positions


def _from_npz(path: str | PathLike[str], missing: Sequence[float]) -> Network:
    with open_input(path) as file, _named(path):
        stored = numpy_arrays(file)
        for key in ("rss_db", "sensor_xy"):
            if key not in stored:
                raise ValueError(f"the array {key!r} is missing")
        check_size(sum(each.n_bytes for each in stored.values()), MAX_BYTES)
        held = {key: each.load() for key, each in stored.items() if key in ARRAYS}
        rss_db = real_numbers("rss_db", held["rss_db"])
        sensors = real_numbers("sensor_xy", held["sensor_xy"])
        if rss_db.ndim != 2:
            raise ValueError(f"rss_db must have shape (n_steps, n_sensors); got {rss_db.shape}")
        if sensors.shape not in ((*rss_db.shape, 2), (rss_db.shape[1], 2)):
            either = f"{(*rss_db.shape, 2)} or {(rss_db.shape[1], 2)}"
            raise ValueError(f"sensor_xy must have shape {either}; got {sensors.shape}")
        sensors = np.broadcast_to(sensors, (*rss_db.shape, 2))
        name = held.get("sensor_name", np.arange(rss_db.shape[1])).astype(str).ravel().tolist()
        time = held.get("time", np.arange(float(len(rss_db))))
        rss_db = without(rss_db, missing)
        return Network(tuple(name), time, rss_db, sensors, held.get("tx_xy"))


def _levels(rows: list[TableRow], name: list[str]) -> tuple[Float, Float]:
    """Return times (n_steps,) and levels (n_steps, n_sensors) of a table of readings."""
    time = next((key for key in TIMES if key in rows[0].columns), None)
    level = next((key for key in LEVELS if key in rows[0].columns), None)
    if "sensor" in rows[0].columns and level is not None:
        return _long(rows, name, time, level)
    columns = [key for key in rows[0].columns if key != time]
    for column in columns:
        _check_sensor_name(column, name)
    rss_db = np.full((len(rows), len(name)), np.nan)
    for column in columns:
        rss_db[:, name.index(column)] = [row.real(column) for row in rows]
    if time is None:
        return np.arange(len(rows), dtype=np.float64), rss_db
    return np.array([row.real(time) for row in rows]), rss_db


def _long(
    rows: list[TableRow], name: list[str], time: str | None, level: str
) -> tuple[Float, Float]:
    if time is None:
        raise ValueError("the column 'time_s' is missing")
    times = np.array([row.real(time) for row in rows])
    steps, at = np.unique(times, return_inverse=True)
    rss_db = np.full((len(steps), len(name)), np.nan)
    for step, row in zip(at.ravel(), rows, strict=True):
        one = row["sensor"].strip()
        _check_sensor_name(one, name, f"line {row.number}: ")
        sensor = name.index(one)
        if np.isfinite(rss_db[step, sensor]):
            raise ValueError(
                f"line {row.number}: {one!r} has two readings at {row[time].strip()} s"
            )
        rss_db[step, sensor] = row.real(level)
    return steps, rss_db


def _check_sensor_name(name: str, table: list[str], place: str = "") -> None:
    if name not in table:
        raise ValueError(f"{place}the sensor {name!r} is not in the table of sensors")


def _table(path: str | PathLike[str]) -> list[TableRow]:
    with open_input(path) as file:
        return named_rows(file.read())


@contextmanager
def _named(path: str | PathLike[str]) -> Iterator[None]:
    """Begin the messages of errors with the name of a file."""
    try:
        yield
    except (ValueError, TypeError) as error:
        raise file_error(path, error) from error
