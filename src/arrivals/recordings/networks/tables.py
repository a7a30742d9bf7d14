"""Tables of readings: one row a reading or one row a step, of one or of several devices."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.recordings.networks.cells import Cells, checked, some, times
from arrivals.recordings.networks.columns import plain_name, roles, understood_names
from arrivals.recordings.networks.exports import rows_of
from arrivals.recordings.networks.sensor_tables import (
    POSITIONS,
    SensorTable,
    check_angles,
    find,
    named,
    position_columns,
    sensor_table,
)
from arrivals.recordings.networks.steps import SingleReadings
from arrivals.typing import Bool

RECEIVERS = ("sensor", "receiver", "rx", "gateway", "anchor", "node")  # begin a column's name


@dataclass(frozen=True, eq=False)
class ReadTable:
    """Readings of a table by device.

    Parameters
    ----------
    readings : mapping of str to SingleReadings
        By device, in the order of the table; by "" if it has no column of devices.
    has_devices : bool
        Whether the table has one.
    is_wide : bool
        Whether a row is a step, with a column for each sensor.
    understood : tuple of str
        How the table was understood, in phrases.
    """

    readings: Mapping[str, SingleReadings]
    has_devices: bool
    is_wide: bool
    understood: tuple[str, ...]


def read_table(
    path: str | PathLike[str],
    sensors: Any = None,
    missing: Sequence[float] = (),
    group_by: str | None = None,
) -> ReadTable:
    """Read a table of readings.

    Parameters
    ----------
    path : path
        Table, or log of WiGLE or Kismet.
    sensors : path, mapping or array_like, optional
        As in `sensor_table`. If None, each reading has the position of its sensor.
    missing : sequence of float
        Levels, dB, that stand for a missing reading.
    group_by : str, optional
        Column of the devices.

    Returns
    -------
    ReadTable

    Raises
    ------
    ValueError
        If a column, a time or a sensor is not understood; the message begins with the file.
    """
    table = None if sensors is None else sensor_table(sensors)
    if table is not None and len(np.unique(table.positions, axis=0)) < len(table.positions):
        warnings.warn("two sensors have the same position", stacklevel=3)
    with named(path):
        rows = rows_of(path)
        group = None if group_by is None else _column(group_by, list(rows[0].columns))
        cells = Cells(rows, roles(c for c in rows[0].columns if c != group), group)
        if table is None:
            return _with_positions(cells, missing)
        if _is_wide(cells, table):
            return _wide(cells, table, missing)
        return _long(cells, table, missing)


def _column(name: str, columns: list[str]) -> str:
    """Return a column by its name; case and punctuation do not count."""
    same = [one for one in columns if name == one or plain_name(name) == plain_name(one)]
    if not same:
        raise ValueError(f"group_by must be a column; got {name!r}: found {', '.join(columns)}")
    return name if name in same else same[0]


def _is_wide(cells: Cells, table: SensorTable) -> bool:
    """Return True for a column a sensor, False for a row a reading."""
    index, found = table.index(), cells.found
    others = {found[role].name for role in ("time", "date", "device") if role in found}
    columns = [name for name in cells.columns if name not in others | {cells.group}]
    unknown = [name for name in columns if find(index, name) < 0]
    if not unknown:
        return True
    if "level" in found and {"sensor", "access point", "device"} & set(found):
        return False
    if len(unknown) < len(columns):
        time = "" if {"time", "date"} & set(found) else "; the column of times is 'time_s'"
        raise ValueError(
            f"the sensor {unknown[0]!r} is not in the table of sensors: remove the column, or "
            f"add the sensor there{time}"
        )
    raise ValueError(
        f"the columns {', '.join(cells.columns)} are neither sensors nor understood: a table has "
        f"a column for each sensor, or {understood_names('time', 'sensor', 'level')}"
    )


def _wide(cells: Cells, table: SensorTable, missing: Sequence[float]) -> ReadTable:
    index = table.index()
    device = cells.group or getattr(cells.found.get("device"), "name", None)
    device = None if device in index else device
    used = {each.name for role, each in cells.found.items() if role in ("time", "date")}
    columns = [name for name in cells.columns if name not in used | {device}]
    levels = np.array([[row.real(name) for name in columns] for row in cells.rows])
    if "time" in cells.found:
        time, start, phrase = times(cells)
    else:
        time, start, phrase = np.arange(float(len(levels))), None, "no times: steps of 1 s"
    sensor = np.array([find(index, name) for name in columns], dtype=np.int64)
    n = len(columns)
    readings = SingleReadings(
        np.repeat(time, n), np.tile(sensor, len(levels)), checked(levels.ravel(), missing),
        tuple(table.name), table.positions, plane=table.plane, start=start,
    )  # fmt: skip
    names = None if device is None else [one for one in cells.texts(device) for _ in columns]
    return _by_device(readings, names, device, True, (f"{n} columns of sensors", phrase))


def _long(cells: Cells, table: SensorTable, missing: Sequence[float]) -> ReadTable:
    index = table.index()
    candidates = [
        cells.found[role].name
        for role in ("sensor", "access point", "device")
        if role in cells.found
    ]
    known = {
        name: np.array([find(index, one) for one in cells.texts(name)], dtype=np.int64)
        for name in candidates
    }
    column = max(candidates, key=lambda name: np.count_nonzero(known[name] >= 0))
    sensor, valid = known[column], known[column] >= 0
    if not valid.any():
        raise ValueError(
            f"no sensor of the column {column!r} is in the table of sensors: the readings have "
            f"{some(cells.texts(column))}, the table {some(table.name)}"
        )
    if not valid.all():
        foreign = [one for one, is_known in zip(cells.texts(column), valid, strict=True)
                   if not is_known]  # fmt: skip
        warnings.warn(
            f"{len(foreign)} readings are left out, of sensors that are not in the table of "
            f"sensors ({len(set(foreign))}): {some(foreign)}", stacklevel=4
        )  # fmt: skip
    device = cells.device_column(column)
    time, start, phrase = times(cells)
    level = checked(np.array([row.real(cells.found["level"].name) for row in cells.rows]), missing)
    readings = SingleReadings(time, sensor, level, tuple(table.name), table.positions,
                              plane=table.plane, start=start)  # fmt: skip
    names = None if device is None else cells.texts(device)
    phrases = [phrase, f"sensor {column!r}", f"level {cells.found['level'].name!r}"]
    if any(set(pair) <= set(cells.found) for pair in POSITIONS):
        phrases.append("positions in the rows not used")
    return _by_device(readings, names, device, False, tuple(phrases), valid)


def _with_positions(cells: Cells, missing: Sequence[float]) -> ReadTable:
    """Return readings that have the positions of their sensors."""
    found = cells.found
    if not ({"x", "y"} & set(found) or {"lat", "lon"} & set(found)) or "level" not in found:
        raise ValueError(
            "the readings require a table of sensors (--sensors) with the columns name, x_m, y_m "
            "or name, lat, lon; or a level and a position in each row"
        )
    pair, first, second = position_columns(found, cells.columns)
    values = np.array([[row.real(first.name), row.real(second.name)] for row in cells.rows])
    plane = None
    if pair == POSITIONS[1]:
        values[~values.any(axis=1)] = np.nan  # 0, 0: no fix
        check_angles(values, cells.rows)
        plane = LocalPlane.around(*values.T)
        values = np.stack(plane.to_xy(*values.T), axis=-1)
    else:
        values *= [first.scale, second.scale]
    has_time = "time" in found or "date" in found
    no_time = np.zeros(len(values)), None, "no times"
    time, start, phrase = times(cells) if has_time else no_time
    level = checked(np.array([row.real(found["level"].name) for row in cells.rows]), missing)
    valid = np.isfinite(values).all(axis=1) & np.isfinite(level)
    receiver = found.get("sensor")
    if receiver is not None and not plain_name(receiver.name).startswith(RECEIVERS):
        receiver = None
    if receiver is not None and not has_time:
        times(cells)  # raises the error
    device = cells.device_column(receiver.name if receiver else None)
    if receiver is None and device is None and "sensor" in found:
        device = found["sensor"].name
    texts = cells.texts(receiver.name) if receiver else [""] * len(level)
    name, sensor = np.unique(np.array(texts, dtype=object).astype(str), return_inverse=True)
    readings = SingleReadings(
        time, sensor, level, tuple(name.tolist()), values, moving=True,
        static_source=receiver is None, plane=plane, start=start,
    )  # fmt: skip
    where = f"position of the sensor {first.name!r}, {second.name!r}"
    phrases = [phrase, where, f"level {found['level'].name!r}"]
    if receiver is None:
        phrases.append("sources at rest")
    if not valid.all():
        phrases.append(f"rows without level or position left out: {np.count_nonzero(~valid)}")
    names = None if device is None else cells.texts(device)
    return _by_device(readings, names, device, False, tuple(phrases), valid)


def _by_device(
    readings: SingleReadings, names: Sequence[str] | None, column: str | None, is_wide: bool,
    phrases: tuple[str, ...], valid: Bool | None = None,
) -> ReadTable:  # fmt: skip
    """Return the readings of each device, without those that are not valid."""
    valid = np.ones(len(readings.time), dtype=bool) if valid is None else valid
    if not np.isfinite(readings.level[valid]).any():
        raise ValueError("rss_db must have a valid reading; all are missing")
    if names is None:
        which = np.flatnonzero(valid)
        return ReadTable({"": readings.select(which)}, False, is_wide, phrases)
    rows: dict[str, list[int]] = {}
    for k in np.flatnonzero(valid).tolist():
        rows.setdefault(names[k], []).append(k)
    parts = {one: readings.select(np.array(which)) for one, which in rows.items()}
    parts = {one: part for one, part in parts.items() if np.isfinite(part.level).any()} or parts
    each = "" if len(parts) == 1 else ", each by itself"
    phrase = f"device {column!r} ({len(parts)}{each})"
    return ReadTable(parts, True, is_wide, (*phrases, phrase))
