"""Columns of tables of readings by the names and the units that people write."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from arrivals.measurement_models.arrays.positions import UNITS

SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "secs": 1.0, "seconds": 1.0, "utc": 1.0, "iso": 1.0,
           "iso8601": 1.0, "unix": 1.0, "epoch": 1.0, "ms": 1e-3, "msec": 1e-3, "millis": 1e-3,
           "milliseconds": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}  # fmt: skip
METRES = {"": 1.0, "meters": 1.0, "metres": 1.0, **UNITS}
DEGREES = {"": 1.0, "deg": 1.0, "degrees": 1.0, "wgs84": 1.0}
DECIBELS = {"": 1.0, "db": 1.0, "dbm": 1.0, "dbfs": 1.0}
NO_UNIT = {"": 1.0}

# names by role, without case, spaces and punctuation; the first one that a table has counts
NAMES: dict[str, tuple[str, dict[str, float]]] = {
    "time": ("time timestamp t ts firstseen seen seenat datetime epoch unixtime unixtimestamp utc "
             "utctime localtime lasttime lastseen", SECONDS),
    "date": ("date day", NO_UNIT),
    "sensor": ("sensor sensorname sensorid receiver receiverid rx anchor anchorid gateway "
               "gatewayid node nodeid beacon beaconid name id", NO_UNIT),
    "access point": ("bssid ap accesspoint apmac mac macaddress", NO_UNIT),
    "device": ("device devicename deviceid station client clientmac tag tagid phone source "
               "sourceid sourcemac transmitter tx target user mac", NO_UNIT),
    "level": ("rssi rss level signal signallevel signalstrength power strength dbm db rxlevel "
              "rxpower receivedpower maxsignal", DECIBELS),
    "lat": ("lat latitude currentlatitude gpslat gpslatitude", DEGREES),
    "lon": ("lon long lng longitude currentlongitude gpslon gpslongitude", DEGREES),
    "x": ("x xpos posx east easting", METRES),
    "y": ("y ypos posy north northing", METRES),
}  # fmt: skip


def aliases_of(
    names: Mapping[str, tuple[str, Mapping[str, float]]],
) -> dict[str, dict[str, float]]:
    """Return the plain names with units, and the factors of these, of each role.

    Examples
    --------
    >>> aliases_of({"bearing": ("doa aoa", {"": 1.0, "deg": 1.0})})
    {'bearing': {'doa': 1.0, 'doadeg': 1.0, 'aoa': 1.0, 'aoadeg': 1.0}}
    """
    return {
        role: {name + unit: scale for name in known.split() for unit, scale in units.items()}
        for role, (known, units) in names.items()
    }


ALIASES = aliases_of(NAMES)


@dataclass(frozen=True)
class Column:
    """Column of a table: its name there, and the unit in s, m, dB or degrees."""

    name: str
    scale: float = 1.0


def roles(
    columns: Iterable[str],
    wanted: Iterable[str] = tuple(NAMES),
    known: Mapping[str, Mapping[str, float]] = ALIASES,
) -> dict[str, Column]:
    """Return the columns of a table by role; each column has one role.

    Parameters
    ----------
    columns : iterable of str
        Names in the header.
    wanted : iterable of str
        Roles, in order of preference.
    known : mapping
        Plain names, and the factors of their units, by role, as `aliases_of` returns them.

    Returns
    -------
    dict
        From a role, such as "time", to its column; roles without one are left out.

    Examples
    --------
    >>> found = roles(["Time (ms)", "BSSID", "RSSI [dBm]"])
    >>> {role: (column.name, column.scale) for role, column in found.items()}
    {'time': ('Time (ms)', 0.001), 'access point': ('BSSID', 1.0), 'level': ('RSSI [dBm]', 1.0)}
    """
    free = {plain_name(name): name for name in reversed(list(columns))}
    found = {}
    for role in wanted:
        aliases = known[role]
        key = next((alias for alias in aliases if alias in free), None)
        if key is not None:
            found[role] = Column(free.pop(key), aliases[key])
    return found


def plain_name(name: str) -> str:
    """Return a name without case, spaces and punctuation.

    Examples
    --------
    >>> plain_name("First-Seen (ms)")
    'firstseenms'
    """
    return "".join(letter for letter in name.lower() if letter.isalnum())


def understood_names(*wanted: str) -> str:
    """Return the names of columns that are understood, for a message."""
    names = (f"{role} ({', '.join(NAMES[role][0].split()[:6])} ...)" for role in wanted)
    return "; ".join(names)
