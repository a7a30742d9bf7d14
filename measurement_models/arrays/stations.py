"""Arrays of named stations, from tables and StationXML, matched with a recording."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from arrivals.files import file_error, open_input
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.measurement_models.arrays.positions import compass, turned
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.messages import nearest, shown
from arrivals.tables import named_rows
from arrivals.validation import number

KEYS = ("stations", "speed", "rotation", "clockwise")
NAMES = ("name", "station", "code")  # of the column with names
LATITUDES, LONGITUDES = ("lat", "latitude"), ("lon", "longitude")
MOST_LISTED = 8


@dataclass(frozen=True, eq=False)
class StationArray(SensorArray):
    """Sensors with names, of which a recording may have any.

    Parameters
    ----------
    positions : array_like, shape (n_sensors, 2)
        Metres; x is east and y north.
    speed : float, optional
        Apparent speed of the waves across the array, m/s.
    channels, n_channels : None
        As in `SensorArray`; known when a recording is matched.
    names : sequence of str
        Names of the stations: STA, or NET.STA.

    Examples
    --------
    >>> array = StationArray([[0, 0], [3e3, 0], [0, 3e3]], 6000.0, names=["A", "B", "C"])
    >>> array.matched(["XX.C..SHZ", "XX.A..SHZ", "XX.B..SHZ"]).channels
    (1, 2, 0)
    """

    names: Sequence[str] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "names", tuple(self.names))
        if len(self.names) != len(self.positions):
            wanted = len(self.positions)
            raise ValueError(f"names must have {wanted} entries; got {len(self.names)}")

    def matched(self, channels: Sequence[str] | None) -> SensorArray:
        """Return the stations that a recording has, with its channel of each.

        Stations without a channel, and channels without a station, are left out with a warning.

        Parameters
        ----------
        channels : sequence of str or None
            Names of the channels, such as NET.STA.LOC.CHA; None if there are none.

        Returns
        -------
        SensorArray

        Raises
        ------
        ValueError
            If less than two stations have a channel.
        """
        if channels is None:
            raise ValueError("stations require named channels: the recording has none")
        number = {name: i for i, channel in enumerate(channels) for name in _aliases(channel)}
        kept = [i for i, name in enumerate(self.names) if name in number]
        used = [number[self.names[i]] for i in kept]
        absent = [name for name in self.names if name not in number]
        unknown = [name for i, name in enumerate(channels) if i not in used]
        if len(kept) < 2:
            raise ValueError(
                f"at least two stations must have a channel; got {len(kept)}: the stations are "
                f"{_listed(self.names)}; the channels are {_listed(channels)}"
            )
        for names, reason in (
            (absent, "stations without a channel"),
            (unknown, "channels without a station"),
        ):
            if names:
                warnings.warn(f"{reason} are left out: {_listed(names)}", stacklevel=2)
        return SensorArray(self.positions[kept], self.speed, used, len(channels))


def stations_array(description: Mapping[str, Any], folder: Path) -> StationArray:
    """Make the array that an array file of the kind `stations` describes.

    Parameters
    ----------
    description : mapping of str to object
        `stations`, the name of a table or of a StationXML file, and the keys `speed`, `rotation`
        and `clockwise` of any array.
    folder : path
        Folder of the array file, to which the name is relative.

    Returns
    -------
    StationArray

    Raises
    ------
    ValueError
        If a key or the file is invalid.
    OSError
        If the file cannot be read.
    """
    keys = {name: value for name, value in description.items() if name != "kind"}
    for key in keys:
        if key not in KEYS:
            hint = nearest(key, KEYS)
            raise ValueError(f"an array of kind 'stations' has no key {key!r}: {hint}")
    if not isinstance(keys.get("stations"), str):
        raise ValueError("an array of kind 'stations' needs the key 'stations', a CSV or XML file")
    if not isinstance(keys.get("clockwise", False), bool):
        raise ValueError(f"clockwise must be true or false; got {shown(keys['clockwise'])}")
    places = read_stations(folder / keys["stations"])
    positions = np.array(list(places.values()))
    positions = compass(positions) if keys.get("clockwise") else positions
    positions = turned(positions, number("rotation", keys.get("rotation", 0.0)))
    return StationArray(positions, keys.get("speed"), names=tuple(places))


def read_stations(path: Path) -> dict[str, tuple[float, float]]:
    """Return the positions of stations, m east and north, by name.

    Parameters
    ----------
    path : path
        StationXML (suffix .xml), or a table with the columns name, x_m and y_m, or name, lat and
        lon (degrees), of which the mean is the origin.

    Returns
    -------
    dict of str to (float, float)

    Raises
    ------
    ValueError
        If the file is not one of these, or has no station.
    """
    with open_input(path) as file:
        data = file.read()
    try:
        rows = _from_xml(data) if path.suffix.lower() == ".xml" else _from_table(data)
        if not rows:
            raise ValueError("the file has no stations")
        return rows
    except (ValueError, ElementTree.ParseError) as error:
        raise file_error(path, error) from None


def _from_table(data: bytes) -> dict[str, tuple[float, float]]:
    rows = named_rows(data)
    if not rows:
        return {}
    columns = {name.strip().lower(): name for name in rows[0].columns}
    name = next((columns[each] for each in NAMES if each in columns), None)
    pairs = [("x_m", "y_m"), *zip(LATITUDES, LONGITUDES, strict=True)]
    pair = next((each for each in pairs if set(each) <= set(columns)), None)
    if name is None or pair is None:
        raise ValueError(
            "the table must have the columns name, x_m and y_m, or name, lat and lon; "
            f"got {', '.join(columns)}"
        )
    one, other = (columns[each] for each in pair)
    places: dict[str, tuple[float, float]] = {}
    for row in rows:
        place = row.real(one), row.real(other)
        if not np.isfinite(place).all() or row[name].strip() in places:
            raise ValueError(f"line {row.number} must have a new name and a position")
        places[row[name].strip()] = place
    return places if pair == pairs[0] else _on_plane(places)


def _from_xml(data: bytes) -> dict[str, tuple[float, float]]:
    """Return stations by NET.STA, the last epoch of each, without any other part of the file."""
    if b"\0" in data or b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ValueError("StationXML must be UTF-8 without a document type or entities")
    places: dict[str, tuple[float, float]] = {}
    for network in ElementTree.fromstring(data).iter():
        if _tag(network) != "Network":
            continue
        for station in network:
            if _tag(station) == "Station":
                values = {_tag(each): each.text for each in station}
                name = f"{network.get('code')}.{station.get('code')}"
                try:
                    place = float(values["Latitude"] or ""), float(values["Longitude"] or "")
                except (KeyError, ValueError):
                    raise ValueError(f"the station {name} has no position") from None
                places[name] = place
    return _on_plane(places) if places else {}


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _on_plane(places: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Return positions by latitude and longitude, degrees, as metres east and north."""
    lat, lon = np.array(list(places.values())).T
    x, y = LocalPlane.around(lat, lon).to_xy(lat, lon)
    return dict(zip(places, zip(x.tolist(), y.tolist(), strict=True), strict=True))


def _aliases(channel: str) -> tuple[str, ...]:
    """Return the names of the station of a channel: NET.STA and STA of NET.STA.LOC.CHA."""
    parts = channel.split(".")
    return (channel, ".".join(parts[:2]), parts[1]) if len(parts) == 4 else (channel,)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    return ", ".join(names[:MOST_LISTED]) + more
