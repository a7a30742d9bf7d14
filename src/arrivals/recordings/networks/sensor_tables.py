"""Tables of sensors: names, and positions in metres or by latitude and longitude."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from arrivals.files import file_error, open_input
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.measurements import real_numbers
from arrivals.recordings.networks.columns import Column, roles, understood_names
from arrivals.tables import TableRow, named_rows
from arrivals.typing import Float

POSITIONS = ("x", "y"), ("lat", "lon")


@dataclass(frozen=True, eq=False)
class SensorTable:
    """Names of sensors and their positions.

    Parameters
    ----------
    name : sequence of str
    positions : ndarray, shape (n_sensors, 2)
        Metres.
    plane : LocalPlane, optional
        Plane of the positions where they are given by latitude and longitude.
    """

    name: Sequence[str]
    positions: Float
    plane: LocalPlane | None = None

    def index(self) -> dict[str, int]:
        """Return the indices by name; MAC addresses also by other cases and separators."""
        plain = [same_name(one) for one in self.name]
        number = Counter(plain)
        others = {one: k for k, one in enumerate(plain) if number[one] == 1}
        return others | {one: k for k, one in enumerate(self.name)}


def same_name(name: str) -> str:
    """Return a name in lower case, with the colons of a MAC address.

    Examples
    --------
    >>> same_name("AA-BB-CC-00-00-01")
    'aa:bb:cc:00:00:01'
    """
    return name.lower().replace("-", ":")


def find(index: Mapping[str, int], name: str) -> int:
    """Return the index of a sensor by its name, -1 if it is not among those of `index`."""
    return index.get(name, index.get(same_name(name), -1))


def read_sensors(path: str | PathLike[str]) -> tuple[list[str], Float]:
    """Return names and positions (n_sensors, 2), m, of a table of sensors.

    Parameters
    ----------
    path : path
        Table with a column of names and ``x_m, y_m`` or ``lat, lon``; see `sensor_table`.
    """
    table = sensor_table(path)
    return list(table.name), table.positions


def sensor_table(sensors: Any) -> SensorTable:
    """Return sensors from a file, a mapping or an array.

    Parameters
    ----------
    sensors : path, mapping or array_like
        Table with the columns ``name, x_m, y_m`` or ``name, lat, lon`` (or others by which they
        are known); positions, m, by name; or positions (n_sensors, 2), m, of sensors "0", "1", ...

    Returns
    -------
    SensorTable

    Raises
    ------
    ValueError
        If a column or a position is missing, or a sensor is listed twice.
    """
    if isinstance(sensors, str | PathLike):
        with named(sensors):
            return _read(sensors)
    keys = list(sensors) if isinstance(sensors, Mapping) else None
    positions = real_numbers("sensors", list(sensors.values()) if keys is not None else sensors)
    if positions.ndim != 2 or positions.shape[1] != 2:
        raise ValueError(f"sensors must have shape (n_sensors, 2); got {positions.shape}")
    name = range(len(positions)) if keys is None else keys
    return SensorTable([str(one) for one in name], positions)


def _read(path: str | PathLike[str]) -> SensorTable:
    with open_input(path) as file:
        rows = named_rows(file.read())
    columns = list(rows[0].columns)
    found = roles(columns, ("sensor", "access point", "device", *POSITIONS[0], *POSITIONS[1]))
    label = found.get("sensor") or found.get("access point") or found.get("device")
    if label is None:
        raise ValueError(f"the column 'name' is missing: found {', '.join(columns)}")
    name = [row[label.name].strip() for row in rows]
    repeated = sorted(one for one, n in Counter(name).items() if n > 1)
    if repeated:
        raise ValueError(f"the sensor {repeated[0]!r} is listed twice")
    pair, first, second = position_columns(found, columns)
    values = np.array([[row.real(first.name), row.real(second.name)] for row in rows])
    if not np.isfinite(values).all():
        missing = rows[int(np.argmin(np.isfinite(values).all(axis=1)))]
        raise ValueError(f"line {missing.number}: a position is missing")
    if pair == POSITIONS[0]:
        return SensorTable(name, values * [first.scale, second.scale])
    check_angles(values, rows)
    plane = LocalPlane.around(*values.T)
    return SensorTable(name, np.stack(plane.to_xy(*values.T), axis=-1), plane)


def position_columns(
    found: Mapping[str, Column], columns: Sequence[str]
) -> tuple[tuple[str, str], Column, Column]:
    """Return the pair of roles, x, y or latitude, longitude, and the two columns of positions.

    Raises
    ------
    ValueError
        If there are none, one of two, or both pairs.
    """
    complete = [pair for pair in POSITIONS if set(pair) <= set(found)]
    if len(complete) == 2:
        names = [", ".join(found[role].name for role in pair) for pair in complete]
        raise ValueError(f"positions must be {names[0]} or {names[1]}; got both: remove one pair")
    if not complete:
        half = [role for pair in POSITIONS for role in pair if role in found]
        other = {"x": "y_m", "y": "x_m", "lat": "lon", "lon": "lat"}[half[0]] if half else "x_m"
        raise ValueError(
            f"the column {other!r} is missing: found {', '.join(columns)}; positions are "
            f"{understood_names('x', 'y')}; or {understood_names('lat', 'lon')}"
        )
    return complete[0], found[complete[0][0]], found[complete[0][1]]


def check_angles(values: Float, rows: Sequence[TableRow]) -> None:
    """Raise an error with the line of a latitude or a longitude that is out of range."""
    for column, (name, largest) in enumerate((("latitude", 90), ("longitude", 180))):
        bad = np.flatnonzero(np.abs(values[:, column]) > largest)
        if bad.size:
            cure = "the columns may be swapped" if column == 0 else "write it as -180 to 180"
            raise ValueError(
                f"line {rows[int(bad[0])].number}: a {name} must lie within ±{largest} degrees; "
                f"got {values[bad[0], column]:g}: {cure}"
            )


@contextmanager
def named(path: str | PathLike[str]) -> Iterator[None]:
    """Begin the messages of errors with the name of a file."""
    try:
        yield
    except (ValueError, TypeError) as error:
        raise file_error(path, error) from error
