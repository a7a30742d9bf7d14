"""Stations files: stations of a map with places, headings, arrays, recordings and options."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.files import file_error, open_input
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.messages import shown
from arrivals.recordings.fusion.oriented_arrays import array_files, station_array
from arrivals.recordings.fusion.placement import (
    DEGREES,
    HEADINGS,
    METRES,
    station_heading,
    station_positions,
)
from arrivals.recordings.fusion.station_options import (
    OPTIONS,
    STRENGTH,
    checked_options,
    checked_strength,
    merged,
    refuse_unknown,
)
from arrivals.recordings.fusion.station_plan import StationPlan, of_station
from arrivals.typing import Float
from arrivals.validation import instance, items, not_negative, number, positive, shaped

OF_STATION = ("name", *METRES, *DEGREES, *HEADINGS, "recording", "start_s")
OF_ROOT = ("area", "speed", "q", "step", "station", "rss")
OF_RSS = ("sensors", "readings")


@dataclass(frozen=True, eq=False)
class StationsFile:
    """Contents of a stations file.

    Parameters
    ----------
    plans : tuple of StationPlan
        Stations, in the order of the file.
    area : tuple of float, optional
        x0, y0, x1, y1 of the area of the sources, m.
    motion : mapping of str to float
        `speed`, `q` and `step`, as far as they are given.
    strength : mapping of str to object
        `sensors`, `readings` and the settings of `station_options`, as far as they are given.
    plane : LocalPlane, optional
        Plane of positions by latitude and longitude.
    files : tuple of str
        Names of the files that are read.
    """

    plans: tuple[StationPlan, ...]
    area: tuple[float, ...] | None = None
    motion: Mapping[str, float] = field(default_factory=dict)
    strength: Mapping[str, Any] = field(default_factory=dict)
    plane: LocalPlane | None = None
    files: tuple[str, ...] = ()


def read_stations(source: str | PathLike[str] | Mapping[str, Any]) -> StationsFile:
    """Read a stations file.

    Parameters
    ----------
    source : str, path or mapping
        TOML file, or its keys; other files are relative to the file, or to the present folder.

    Returns
    -------
    StationsFile

    Raises
    ------
    ValueError
        If a key is unknown or missing, or a value invalid; the message begins with the file.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> mast = {"name": "mast", "x_m": 0, "y_m": 0, "bearings": "compass"}
    >>> roof = {"name": "roof", "x_m": 300, "y_m": 0, "heading_deg": 30}
    >>> [plan.is_compass for plan in read_stations({"station": [mast, roof]}).plans]
    [True, False]
    """
    if isinstance(source, Mapping):
        return _contents(source, Path(), ())
    if not isinstance(source, str | PathLike):
        raise TypeError(f"stations must be a stations file or its keys; got {shown(source)}")
    with open_input(source) as file:
        data = file.read()
    try:
        keys = tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n"))
        return _contents(keys, Path(source).parent, (fspath(source),))
    except UnicodeDecodeError:
        raise ValueError(f"{fspath(source)}: a stations file must be text in UTF-8") from None
    except (ValueError, TypeError) as error:
        raise file_error(source, error) from None


def _contents(keys: Mapping[str, Any], folder: Path, files: tuple[str, ...]) -> StationsFile:
    refuse_unknown("a stations file", keys, dict.fromkeys((*OF_ROOT, *OPTIONS, *STRENGTH)))
    tables = keys.get("station")
    if not isinstance(tables, list) or not tables:
        raise ValueError("a stations file must have tables [[station]]; got none")
    tables = [_named(table, k) for k, table in enumerate(tables)]
    repeated = [name for name, n in Counter(t["name"] for t in tables).items() if n > 1]
    if repeated:
        raise ValueError(f"names of stations must differ; got {repeated[0]!r} twice")
    positions, plane = station_positions(tables)
    root = checked_options(keys)
    plans = []
    for table, position in zip(tables, positions, strict=True):
        with of_station(table["name"]):
            plans.append(_plan(table, position, root, folder))
        files += tuple(array_files({**root, **table}.get("array"), folder))
    strength = _strength(keys, folder)
    files += tuple(strength[name] for name in OF_RSS if name in strength)
    named = [plan.recording for plan in plans if plan.recording is not None]
    files += tuple(name for each in named for name in ([each] if isinstance(each, str) else each))
    return StationsFile(
        tuple(plans), checked_area(keys.get("area")), checked_motion(keys), strength, plane, files
    )


def _named(table: Any, number_of: int) -> dict[str, Any]:
    """Return the keys of a station, which has a name; "1", "2", ... by default."""
    if not isinstance(table, Mapping):
        raise TypeError(f"station must be a table [[station]]; got {shown(table)}")
    name = instance("name", table.get("name", str(number_of + 1)), str)
    with of_station(name):
        refuse_unknown("a station", table, dict.fromkeys((*OF_STATION, *OPTIONS)))
        if not name or "+" in name or "," in name:
            raise ValueError(f"name must be a text without + and commas; got {name!r}")
    return {**table, "name": name}


def _plan(
    table: Mapping[str, Any], position: Float, root: Mapping[str, Any], folder: Path
) -> StationPlan:
    options = merged(root, checked_options(table))
    array = options.pop("array", None)
    recording = table.get("recording")
    if recording is not None:
        names = [recording] if isinstance(recording, str) else items("recording", recording)
        paths = tuple(str(folder / instance("recording", name, str)) for name in names)
        recording = paths[0] if len(paths) == 1 else paths
    start = number("start_s", table.get("start_s", 0.0))
    if not np.isfinite(start):
        raise ValueError(f"start_s must be finite; got {start}")
    return StationPlan(
        table["name"],
        position,
        station_heading(table),
        None if array is None else station_array(array, folder),
        recording,
        start,
        options,
    )


def _strength(keys: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the settings of signal strength of the root and of [rss], which count."""
    table = keys.get("rss", {})
    if not isinstance(table, Mapping):
        raise TypeError(f"rss must be a table [rss]; got {shown(table)}")
    refuse_unknown("[rss]", table, dict.fromkeys((*OF_RSS, *STRENGTH)))
    names = {
        name: str(folder / instance(name, table[name], str)) for name in OF_RSS if name in table
    }
    return {**checked_strength(keys), **checked_strength(table), **names}


def checked_area(area: Sequence[float] | None) -> tuple[float, ...] | None:
    """Return the corners x0, y0, x1, y1 of an area, m, or None.

    Examples
    --------
    >>> checked_area([0, 0, 1000, 1000])
    (0.0, 0.0, 1000.0, 1000.0)
    """
    if area is None:
        return None
    x0, y0, x1, y1 = corners = tuple(shaped("area", area, 4).tolist())
    if not (np.isfinite(corners).all() and x0 < x1 and y0 < y1):
        raise ValueError(f"area must be x0, y0, x1, y1 with x0 < x1 and y0 < y1; got {shown(area)}")
    return corners


def checked_motion(keys: Mapping[str, Any]) -> dict[str, float]:
    """Return speed, m/s, acceleration noise q, m²/s³, and step, s, as far as they are given.

    Examples
    --------
    >>> checked_motion({"speed": 8, "q": 0.05, "step": None})
    {'speed': 8.0, 'q': 0.05}
    """
    checks = {"speed": positive, "q": not_negative, "step": positive}
    return {
        name: check(name, keys[name])
        for name, check in checks.items()
        if keys.get(name) is not None
    }
