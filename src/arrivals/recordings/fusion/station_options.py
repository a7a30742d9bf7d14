"""Options of stations, recordings and signal strength, from stations files and arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from arrivals.messages import similar
from arrivals.recordings.choice import TrackOptions
from arrivals.recordings.networks.tracking import PathLossSettings, SourceSettings
from arrivals.validation import count, instance, not_negative, number, one_of, positive, real

FREQUENCIES = ("frequency", "frequencies", "center", "band")  # one of them at a level
SENSES = ("anticlockwise", "compass")  # of ready-made bearings


def _boolean(name: str, value: Any) -> bool:
    return instance(name, value, bool)


def _text(name: str, value: Any) -> str:
    return instance(name, value, str)


def _as_given(_: str, value: Any) -> Any:
    return value


# options of `arrivals.track` and of the reading of a recording, with their checks
TRACKING: dict[str, Callable[[str, Any], Any]] = {
    "tracker": _text,
    "frequency": positive,
    "frequencies": _as_given,
    "center": positive,
    "band": _as_given,
    "window": partial(count, minimum=2),
    "hop": count,
    "snapshots": count,
    "reduce": _boolean,
    "follow": positive,
    "rate": positive,
    "format": _text,
    "channels": count,
    "variable": _text,
    "transpose": _boolean,
}
# of a station on the map; not arguments, but keys of the root, too
PLACING: dict[str, Callable[[str, Any], Any]] = {
    "heading_std_deg": not_negative,
    "position_std_m": not_negative,
    "wave_speed": positive,
    "bearings": lambda name, value: one_of(name, value, SENSES),
    "array": _as_given,
    "settings": lambda name, value: instance(name, value, dict),
}
OPTIONS = {**TRACKING, **PLACING}


def checked_options(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options among the keys of a table, checked.

    Parameters
    ----------
    table : mapping of str to object
        Keys and values; those that are no options are left out, and values that are None.

    Returns
    -------
    dict of str to object

    Raises
    ------
    ValueError, TypeError
        If a value is invalid, or there are two of frequency, frequencies, center and band.

    Examples
    --------
    >>> checked_options({"name": "mast", "snapshots": 10})
    {'snapshots': 10}
    """
    given = {name: value for name, value in table.items() if value is not None}
    several = [name for name in FREQUENCIES if name in given]
    if len(several) > 1:
        raise ValueError(f"only one of {', '.join(FREQUENCIES)} may be given; got {several}")
    return {name: check(name, given[name]) for name, check in OPTIONS.items() if name in given}


def merged(*levels: Mapping[str, Any]) -> dict[str, Any]:
    """Return options of which those of later levels count.

    Frequencies in any form replace those of earlier levels; settings are merged by name.

    Examples
    --------
    >>> merged({"frequency": 100.0, "hop": 8}, {"band": [80.0, 120.0]})
    {'hop': 8, 'band': [80.0, 120.0]}
    """
    options: dict[str, Any] = {}
    for level in levels:
        if any(name in level for name in FREQUENCIES):
            options = {name: one for name, one in options.items() if name not in FREQUENCIES}
        settings = {**options.get("settings", {}), **level.get("settings", {})}
        options = {**options, **level, **({"settings": settings} if settings else {})}
    return options


def track_options(options: Mapping[str, Any]) -> TrackOptions:
    """Return the options of `arrivals.track` among options of a station.

    Examples
    --------
    >>> track_options({"frequency": 440.0, "snapshots": 4, "position_std_m": 1.0}).frequencies
    (440.0,)
    """
    single = (options.get(name) for name in ("frequency", "frequencies", "center"))
    return TrackOptions(
        options.get("tracker"),
        next((each for each in single if each is not None), None),
        options.get("band"),
        options.get("window"),
        options.get("hop"),
        options.get("snapshots"),
        options.get("settings", {}),
        options.get("reduce", False),
        options.get("follow"),
    )


def reading_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of `arrivals.read` among options of a station.

    Examples
    --------
    >>> reading_options({"rate": 8000.0, "format": "cs16", "channels": 5, "hop": 64})
    {'rate': 8000.0, 'format': 'cs16:5'}
    """
    names = ("rate", "variable", "transpose", "format")
    arguments = {name: options[name] for name in names if name in options}
    if "channels" in options:
        arguments["format"] = f"{options.get('format', '')}:{options['channels']}"
    return arguments


def refuse_unknown(noun: str, table: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    """Raise a ValueError for a key that is not known, with a similar name.

    Examples
    --------
    >>> refuse_unknown("a station", {"heding_deg": 3.0}, {"heading_deg": None})
    Traceback (most recent call last):
    ValueError: a station has no key 'heding_deg': did you mean heading_deg?
    """
    for key in table:
        if key not in known:
            hint = similar(key, known) or f": known are {', '.join(known)}"
            raise ValueError(f"{noun} has no key {key!r}{hint}")


def _missing(name: str, value: Any) -> list[float]:
    return [float(level) for level in np.atleast_1d(real(name, value))]


STRENGTH: dict[str, Callable[[str, Any], Any]] = {
    "alpha": positive,
    "sigma": positive,
    "floor": number,
    "r_min": positive,
    "power": number,
    "power_std": positive,
    "missing": _missing,
}


def checked_strength(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of signal strength among the keys of a table, checked.

    Parameters
    ----------
    table : mapping of str to object
        `alpha`, loss exponent; `sigma`, shadowing, dB; `floor`, noise floor, dB; `r_min`, floor of
        the range, m; `power` and `power_std`, level of a source at 1 m and its standard deviation,
        dB; `missing`, levels that stand for a missing reading. Others are left out.

    Returns
    -------
    dict of str to object

    Examples
    --------
    >>> checked_strength({"alpha": 3, "floor": None, "area": [0, 0, 1, 1]})
    {'alpha': 3.0}
    """
    return {
        name: check(name, table[name])
        for name, check in STRENGTH.items()
        if table.get(name) is not None
    }


def path_loss(options: Mapping[str, Any]) -> PathLossSettings:
    """Return the model of readings of signal strength; as in `arrivals.locate` if not given.

    Examples
    --------
    >>> path_loss({"sigma": 4.0}).sigma_db
    4.0
    """
    names = {"alpha": "alpha", "sigma": "sigma_db", "floor": "floor_db", "r_min": "r_min"}
    return PathLossSettings(**{to: options[name] for name, to in names.items() if name in options})


def source_power(options: Mapping[str, Any]) -> SourceSettings:
    """Return the prior of the power of a source; as in `arrivals.locate` if not given.

    Examples
    --------
    >>> source_power({"power": -20.0}).power_db
    -20.0
    """
    return SourceSettings(options.get("power"), options.get("power_std"))
