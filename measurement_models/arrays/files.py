"""Arrays from files.

An array file is TOML. `kind` says which other keys it has:

===========  ==============================================================
kind         keys
===========  ==============================================================
ula          `n_sensors`, `spacing`
uca          `n_sensors`, `radius`
symmetric    `distances`: of the sensors on either side of the centre
positions    `positions`: a list of numbers, of [x, y] or of [x, y, z]
===========  ==============================================================

and all may have `speed` (m/s), `missing` (numbers of elements that do not work) and `channels`
(the recording's channel of each element). Lengths are metres. Elements and channels are counted
from 1 in the file, as they are labelled on the hardware; `channels` names one for every element
of the whole array, or one for each that is not missing.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.files import open_input
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurements import real_numbers
from arrivals.messages import in_line
from arrivals.tables import TableLine, table_lines
from arrivals.validation import count

MAX_SENSORS = 100_000
KEYS = {
    "ula": ("n_sensors", "spacing"),
    "uca": ("n_sensors", "radius"),
    "symmetric": ("distances",),
    "positions": ("positions",),
}


def from_toml(path: str | Path) -> SensorArray:
    """Read an array file.

    Raises
    ------
    ValueError
        If the file is not TOML, lacks a key or has one that its kind does not have, or if its
        numbers make no array; the message starts with the file's name.
    """
    with open_input(path) as file:
        data = file.read()
    try:
        return from_description(tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n")))
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {in_line(error)}") from None
    except (RecursionError, MemoryError):
        raise ValueError(f"{path}: the values are nested too deeply") from None


def from_description(description: dict[str, Any]) -> SensorArray:
    """Make the array that the keys of an array file describe.

    Examples
    --------
    >>> from_description({"kind": "ula", "n_sensors": 3, "spacing": 0.1, "missing": [2]}).channels
    (0, 2)
    >>> from_description({"kind": "uca", "n_sensors": 8})
    Traceback (most recent call last):
    ValueError: an array of kind 'uca' needs the key 'radius'
    """
    keys = dict(description)
    kind = keys.pop("kind", None)
    if kind is None:
        raise ValueError(f"the key 'kind' is missing; it is one of {', '.join(KEYS)}")
    if not isinstance(kind, str) or kind not in KEYS:
        raise ValueError(f"kind must be one of {', '.join(KEYS)}; got {kind!r}")
    common = {name: keys.pop(name, None) for name in ("speed", "missing", "channels")}
    for name in KEYS[kind]:
        if name not in keys:
            raise ValueError(f"an array of kind {kind!r} needs the key {name!r}")
    n = keys.get("n_sensors")
    if isinstance(n, int) and n > MAX_SENSORS:
        raise ValueError(f"n_sensors must be at most {MAX_SENSORS}; got {n}")
    unknown = sorted(set(keys) - set(KEYS[kind]))
    if unknown:
        raise ValueError(f"an array of kind {kind!r} has no key {unknown[0]!r}")
    array = (
        _positions(keys["positions"]) if kind == "positions" else getattr(SensorArray, kind)(**keys)
    )
    return _wired(
        SensorArray(array.positions, common["speed"]), common["missing"], common["channels"]
    )


def _positions(rows: Any) -> SensorArray:
    return SensorArray(real_numbers("positions", rows))


def _wired(array: SensorArray, missing: Any, channels: Any) -> SensorArray:
    """Return the array without its missing elements, its channels renumbered from 0."""
    for name, value in (("missing", missing), ("channels", channels)):
        if value is not None and not isinstance(value, list):
            raise ValueError(f"{name} must be a list of numbers; got {value!r}")
    gone = [count("missing", element) - 1 for element in missing or []]
    if max(gone, default=0) >= array.n_sensors:
        raise ValueError(f"missing names element {max(gone) + 1} of {array.n_sensors}")
    whole = array.without(gone)
    if channels is None:
        return whole
    wires = tuple(count("channels", channel) - 1 for channel in channels)
    if len(set(wires)) != len(wires):
        raise ValueError(f"channels must differ from each other; got {channels}")
    if len(wires) == array.n_sensors:
        return SensorArray(array.positions, array.speed, wires).without(gone)
    return SensorArray(whole.positions, whole.speed, wires)


def from_csv(path: str | Path, *, speed: float | None = None) -> SensorArray:
    """Read positions in metres, one sensor a row, columns x, y, z as far as there are any.

    A first row that holds no number is taken for a heading.

    Raises
    ------
    ValueError
        If a row has no number where one is wanted, or rows differ in length.
    """
    with open_input(path) as file:
        data = file.read()
    try:
        lines = list(table_lines(data))
        rows = [_numbers(line) for line in lines]
        if rows and not any(number is not None for number in rows[0]):
            lines, rows = lines[1:], rows[1:]
        if not rows:
            raise ValueError("the file has no positions")
        n = len(rows[0])
        for line, row in zip(lines, rows, strict=True):
            if len(row) != n or None in row:
                raise ValueError(f"line {line.number} must have {n} numbers; got {line.cells}")
        return SensorArray(np.array(rows, dtype=np.float64), speed)
    except ValueError as error:
        raise ValueError(f"{path}: {in_line(error)}") from None


def _numbers(line: TableLine) -> list[float | None]:
    """Return the numbers of a line, None for other cells."""
    row: list[float | None] = []
    for column in range(len(line.cells)):
        try:
            row.append(line.real(column))
        except ValueError:
            row.append(None)
    return row
