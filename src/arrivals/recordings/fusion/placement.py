"""Places and headings of stations, from their keys in a stations file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.typing import Float
from arrivals.validation import LARGEST, number

METRES, DEGREES = ("x_m", "y_m"), ("lat_deg", "lon_deg")
HEADINGS = ("heading_deg", "heading_compass_deg")
SAME_PLACE = 1e-6  # m


def station_positions(tables: Sequence[Mapping[str, Any]]) -> tuple[Float, LocalPlane | None]:
    """Return the positions of stations on the map.

    Parameters
    ----------
    tables : sequence of mapping
        Keys of each station: ``name``, and ``x_m, y_m`` or ``lat_deg, lon_deg``, all alike.

    Returns
    -------
    positions : ndarray, shape (n_stations, 2)
        Metres; east and north of the mean of latitudes and longitudes.
    plane : LocalPlane or None
        Plane of positions by latitude and longitude.

    Raises
    ------
    ValueError, TypeError
        If a position is missing or out of range, stations differ in their keys, or two stations
        are at one place.

    Examples
    --------
    >>> station_positions([{"name": "a", "x_m": 0.0, "y_m": 5.0}])[0]
    array([[0., 5.]])
    """
    pairs = {table["name"]: _pair(table) for table in tables}
    if len(set(pairs.values())) > 1:
        by_metres, by_degrees = (
            next(name for name, pair in pairs.items() if pair == wanted)
            for wanted in (METRES, DEGREES)
        )
        raise ValueError(
            "positions must all be x_m, y_m or all be lat_deg, lon_deg; got "
            f"{by_metres!r} by the first and {by_degrees!r} by the second"
        )
    values = np.array([[_finite(table, key) for key in pairs[table["name"]]] for table in tables])
    plane = None
    if set(pairs.values()) == {DEGREES}:
        plane = LocalPlane.around(*values.T)
        values = np.stack(plane.to_xy(*values.T), axis=-1)
    _check_distinct([table["name"] for table in tables], values)
    return values, plane


def _pair(table: Mapping[str, Any]) -> tuple[str, str]:
    """Return the keys of a station's position."""
    found = [pair for pair in (METRES, DEGREES) if not table.keys().isdisjoint(pair)]
    if len(found) != 1:
        raise ValueError(
            f"station {table['name']!r} must have x_m, y_m or lat_deg, lon_deg; got "
            f"{'both' if found else 'neither'}"
        )
    missing = [key for key in found[0] if key not in table]
    if missing:
        raise ValueError(f"station {table['name']!r} requires the key {missing[0]!r}")
    return found[0]


def _finite(table: Mapping[str, Any], key: str) -> float:
    value = number(key, table[key])
    if not abs(value) < LARGEST:
        raise ValueError(f"station {table['name']!r}: {key} must be finite; got {value}")
    return value


def _check_distinct(names: Sequence[str], positions: Float) -> None:
    apart = np.linalg.norm(positions[:, None] - positions, axis=-1)
    np.fill_diagonal(apart, np.inf)
    if apart.size and apart.min() < SAME_PLACE:
        one, other = np.unravel_index(apart.argmin(), apart.shape)
        x, y = positions[one]
        raise ValueError(
            f"stations must be at different places; got {names[one]!r} and {names[other]!r} at "
            f"({x:g}, {y:g}) m"
        )


def station_heading(table: Mapping[str, Any]) -> float | None:
    """Return the azimuth of a station's x axis on the map, rad; None if it is not given.

    Parameters
    ----------
    table : mapping
        Keys of a station: ``heading_deg``, anticlockwise from the x axis of the map, or
        ``heading_compass_deg``, clockwise from north, its y axis.

    Examples
    --------
    >>> float(np.rad2deg(station_heading({"heading_compass_deg": 60.0})).round(6))
    30.0
    """
    given = [key for key in HEADINGS if key in table]
    if len(given) == 2:
        raise ValueError(f"only one of {' and '.join(HEADINGS)} may be given; got both")
    if not given:
        return None
    degrees = number(given[0], table[given[0]])
    if not abs(degrees) <= 360:
        raise ValueError(f"{given[0]} must lie within ±360 degrees; got {degrees}")
    return float(np.deg2rad(degrees if given[0] == HEADINGS[0] else 90.0 - degrees))
