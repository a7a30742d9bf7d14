"""Arrays from files: TOML, JSON, tables of positions, presets."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Callable, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.files import file_error, open_input
from arrivals.measurement_models.arrays.description import from_description
from arrivals.measurement_models.arrays.positions import UNITS
from arrivals.measurement_models.arrays.presets import preset_names
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurement_models.arrays.stations import stations_array
from arrivals.messages import nearest, shown
from arrivals.tables import TableLine, table_lines

TABLES = (".csv", ".tsv", ".txt", ".xyz")


def from_file(source: str | PathLike[str]) -> SensorArray:
    """Read an array file, or the preset of a name.

    Parameters
    ----------
    source : str or path
        Name of a preset in `arrivals list`; or a file: JSON (suffix .json), a table of positions in
        metres (.csv, .tsv, .txt, .xyz), which has no wave speed, else TOML.

    Returns
    -------
    SensorArray

    Raises
    ------
    ValueError
        If there is neither such a preset nor such a file, or the file is invalid; the message
        starts with the file's name.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> from_file("respeaker-usb-v2").channels
    (1, 2, 3, 4)
    >>> from_file("kraken5")
    Traceback (most recent call last):
    ValueError: array must be a file or a preset; got 'kraken5': did you mean kraken-5?
    """
    name, path = fspath(source), Path(source)
    if not path.suffix and path.name == name and not os.path.exists(name):
        if name not in preset_names():
            hint = nearest(name, preset_names())
            raise ValueError(f"array must be a file or a preset; got {name!r}: {hint}")
        try:
            return from_description({"kind": name})
        except ValueError as error:  # a preset may leave keys open
            raise ValueError(f"{error}: write an array file with kind = {name!r}") from None
    if path.suffix.lower() in TABLES:
        return from_csv(path)
    return _described(path, json.loads if path.suffix.lower() == ".json" else tomllib.loads)


def given_array(array: Any) -> SensorArray | None:
    """Return the array of an argument: a SensorArray, a file, a preset's name, or None.

    Raises
    ------
    TypeError
        If the argument is something else.

    Examples
    --------
    >>> given_array("respeaker-4mic").n_sensors
    4
    """
    if array is None or isinstance(array, SensorArray):
        return array
    if not isinstance(array, str | PathLike):
        raise TypeError(
            f"array must be an array file, a preset or a SensorArray; got {type(array).__name__}"
        )
    return from_file(array)


def from_toml(path: str | PathLike[str]) -> SensorArray:
    """Read an array file in TOML.

    Raises
    ------
    ValueError
        If the file is not TOML, lacks a key or has one that its kind does not have, or if its
        numbers make no array; the message starts with the file's name.
    """
    return _described(path, tomllib.loads)


def _described(path: str | PathLike[str], parse: Callable[[str], Any]) -> SensorArray:
    with open_input(path) as file:
        data = file.read()
    try:
        if b"\0" in data:
            raise ValueError("an array file must be text; got binary data: is it the recording?")
        text = data.decode("utf-8-sig").replace("\r\n", "\n")
        description = parse(text)
        if not isinstance(description, Mapping):
            raise ValueError(f"the file must have keys, such as 'kind'; got {shown(description)}")
        if isinstance(description.get("positions"), str):  # name of a table beside the file
            table = from_csv(Path(path).parent / description["positions"])
            description = {**description, "positions": table.positions.tolist()}
        if description.get("kind") == "stations":
            return stations_array(description, Path(path).parent)
        return from_description(description)
    except tomllib.TOMLDecodeError as error:
        raise file_error(path, ValueError(f"{error}{_line_of(error, text)}")) from None
    except (ValueError, TypeError) as error:
        raise file_error(path, error) from None
    except (RecursionError, MemoryError):
        raise ValueError(f"{fspath(path)}: the values are nested too deeply") from None


def _line_of(error: ValueError, text: str) -> str:
    """Return the line of a TOML file that an error is about, and the rules of such lines."""
    found, lines = re.search(r"at line (\d+)", str(error)), text.split("\n")
    line = lines[int(found[1]) - 1] if found else ""
    rules = "TOML has lines key = value, texts in quotes, and decimal points"
    return f", {shown(line)}: {rules}" if found else f": {rules}"


def from_csv(path: str | Path, *, speed: float | None = None) -> SensorArray:
    """Read positions in metres, one sensor a row, columns x, y, z as far as there are any.

    A first row that holds no number is a heading; columns other than x, y, z are left out then.

    Raises
    ------
    ValueError
        If a row has no number where one is wanted, rows differ in length, or a heading has no x or
        another unit.
    """
    with open_input(path) as file:
        data = file.read()
    try:
        lines = list(table_lines(data))
        rows = [_numbers(line) for line in lines]
        n = len(rows[0]) if rows else 0
        columns = list(range(n))
        if rows and not any(number is not None for number in rows[0]):
            columns, lines, rows = _axes(lines[0].cells), lines[1:], rows[1:]
        if not rows:
            raise ValueError("the file has no positions")
        places = [[row[k] for k in columns] if len(row) == n else [None] for row in rows]
        for line, place in zip(lines, places, strict=True):
            if None in place:
                raise ValueError(
                    f"line {line.number} must have {len(columns)} numbers; got {line.cells}"
                )
        return SensorArray(np.array(places, dtype=np.float64), speed)
    except ValueError as error:
        raise file_error(path, error) from None


def _axes(heading: list[str]) -> list[int]:
    """Return the columns of x, y and z."""
    names = ["".join(filter(str.isalnum, cell.lower())) for cell in heading]
    axes = sorted((name, k) for k, name in enumerate(names)
                  if name[:1] in ("x", "y", "z") and name[1:] in ("", *UNITS))  # fmt: skip
    if not axes:
        raise ValueError(
            f"the heading must have x, y, z; got {shown(heading)}: latitudes and longitudes are "
            "keys of a TOML file"
        )
    for name, k in axes:
        if name[1:] not in ("", "m"):
            raise ValueError(
                f"positions of a table must be in metres; got {heading[k]!r}: name the column "
                f"{name[0]}, and write a TOML file with positions = the table and unit"
            )
    return [k for _, k in axes]


def _numbers(line: TableLine) -> list[float | None]:
    """Return the numbers of a line, None for other cells."""
    row: list[float | None] = []
    for column in range(len(line.cells)):
        try:
            row.append(line.real(column))
        except ValueError:
            row.append(None)
    return row
