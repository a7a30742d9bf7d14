"""Arrays of stations, whose directions grow anticlockwise as azimuths of the map do."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.files import open_input
from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.description import from_description
from arrivals.measurement_models.arrays.files import TABLES, from_csv, from_file, given_array
from arrivals.measurement_models.arrays.presets import preset_names, preset_text
from arrivals.measurement_models.arrays.stations import StationArray, stations_array


def station_array(value: Any, folder: Path) -> SensorArray:
    """Return the array of a station.

    Parameters
    ----------
    value : str, path, mapping or SensorArray
        Array file or preset, keys of an array file, or an array. An array file or a table in it is
        relative to `folder`.
    folder : path
        Folder of the stations file.

    Returns
    -------
    SensorArray
        Directions of files with `clockwise = true` are clockwise; the sensors are mirrored at their
        first axis then, so that directions are anticlockwise from it.

    Raises
    ------
    ValueError, TypeError, OSError
        If the array is invalid.

    Examples
    --------
    >>> circle = {"kind": "uca", "n_sensors": 4, "radius": 0.5, "clockwise": True}
    >>> station_array(circle, Path()).positions[1].round(3)
    array([ 0. , -0.5])
    """
    if isinstance(value, Mapping):
        return _in_sense(_described(value, folder), _is_clockwise(value))
    if not isinstance(value, str | PathLike):
        array = given_array(value)
        if array is None:
            raise TypeError("array must be an array file, a preset or a SensorArray; got None")
        return array
    beside = folder / value
    path = beside if beside.is_file() or Path(value).suffix else Path(value)
    return _in_sense(from_file(path), _file_is_clockwise(path))


def array_files(value: Any, folder: Path) -> list[str]:
    """Return the names of the files that an array is read from."""
    name = value.get("positions") if isinstance(value, Mapping) else value
    if not isinstance(name, str | PathLike):
        return []
    path = folder / name
    return [str(path)] if path.is_file() else []


def _described(keys: Mapping[str, Any], folder: Path) -> SensorArray:
    if isinstance(keys.get("positions"), str):  # name of a table beside the file
        table = from_csv(folder / keys["positions"])
        keys = {**keys, "positions": table.positions.tolist()}
    if keys.get("kind") == "stations":
        return stations_array(keys, folder)
    return from_description(keys)


def _file_is_clockwise(path: Path) -> bool:
    """Return True if an array file, which is valid, has directions that grow clockwise."""
    if path.suffix.lower() in TABLES:
        return False
    if not path.is_file():
        return _is_clockwise({"kind": str(path)})
    with open_input(path) as file:
        text = file.read().decode("utf-8-sig").replace("\r\n", "\n")
    is_json = path.suffix.lower() == ".json"
    return _is_clockwise(json.loads(text) if is_json else tomllib.loads(text))


def _is_clockwise(keys: Mapping[str, Any]) -> bool:
    kind = keys.get("kind")
    preset = tomllib.loads(preset_text(kind)) if kind in preset_names() else {}
    return bool(keys.get("clockwise", preset.get("clockwise", False)))


def _in_sense(array: SensorArray, clockwise: bool) -> SensorArray:
    if not clockwise or array.dim == 1:
        return array
    mirrored = array.positions * np.where(np.arange(array.dim) == 1, -1.0, 1.0)
    if isinstance(array, StationArray):
        return StationArray(mirrored, array.speed, names=array.names)
    return SensorArray(mirrored, array.speed, array.channels, array.n_channels)
