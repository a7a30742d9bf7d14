"""Arguments of the tracker of several stations, and its measurements, checked."""

from __future__ import annotations

import copy
import inspect
import warnings
from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import LogNormalRSS, Station
from arrivals.measurements import is_missing, real_numbers
from arrivals.messages import shown
from arrivals.trackers.base import Tracker
from arrivals.trackers.direction_tracker import DirectionTracker
from arrivals.trackers.fusion.births.area import Area
from arrivals.trackers.fusion.signal_strength import ValidReadings
from arrivals.trackers.fusion.stations.station_update import StationBearings
from arrivals.trackers.registry import find
from arrivals.validation import instance, items

SPEED_OVER_SIZE = 0.01  # default standard deviation of a speed, per unit of time
MAX_VARIANCE = 1.0  # rad², of a bearing


def checked_stations(stations: Sequence[Station], has_readings: bool) -> tuple[Station, ...]:
    """Return stations as a tuple.

    Raises
    ------
    TypeError, ValueError
        If one is not a `Station`, there are too few, or two are at one place.

    Examples
    --------
    >>> checked_stations([Station(None, [0.0, 0.0])], has_readings=False)
    Traceback (most recent call last):
    ValueError: stations must be at least two without rss; got 1
    """
    checked = items("stations", stations)
    for station in checked:
        instance("stations", station, Station)
        if getattr(station.measurement, "unknowns", "azimuth") != "azimuth":
            unknowns = station.measurement.unknowns
            raise ValueError(f"stations must have unknowns='azimuth'; got {unknowns!r}")
    least = 1 if has_readings else 2
    if len(checked) < least:
        wanted = "at least one" if has_readings else "at least two without rss"
        raise ValueError(f"stations must be {wanted}; got {len(checked)}")
    for (i, one), (j, other) in combinations(enumerate(checked), 2):
        if (one.position == other.position).all():
            names = (one.name or f"station {i}", other.name or f"station {j}")
            place = ", ".join(f"{each:g}" for each in one.position)
            raise ValueError(
                f"stations must have different positions; got {names[0]} and {names[1]} "
                f"at ({place})"
            )
    return checked


def checked_readings(rss: LogNormalRSS | None) -> LogNormalRSS | None:
    """Return the model of signal strength, which must have a noise floor."""
    if rss is None:
        return None
    if instance("rss", rss, LogNormalRSS).log_noise is None:
        raise ValueError(
            "rss must have log_noise, the level of readings without a source; got None"
        )
    return rss


def area_of(area: ArrayLike | None, stations: Sequence[Station], rss: LogNormalRSS | None) -> Area:
    """Return the area given, or that around stations and sensors."""
    if area is not None:
        return Area.checked(area)
    places = [station.position for station in stations]
    return Area.around(places if rss is None else [*places, *rss.sensors])


def station_trackers(
    trackers: str | Sequence[Tracker | None], stations: Sequence[Station]
) -> tuple[Tracker | None, ...]:
    """Return a tracker of directions for each station, None for those with ready-made bearings.

    Parameters
    ----------
    trackers : str or sequence of (Tracker or None)
        Registered name, or a tracker for each station, which is copied.
    stations : sequence of Station

    Raises
    ------
    TypeError, ValueError
        If there is not one for each station with a measurement, or it is not of directions.
    """
    if isinstance(trackers, str):
        return tuple(_made(trackers, station) for station in stations)
    given = items("trackers", trackers)
    if len(given) != len(stations):
        raise ValueError(f"trackers must be one a station, {len(stations)}; got {len(given)}")
    for tracker, station in zip(given, stations, strict=True):
        if tracker is None and station.measurement is not None:
            raise ValueError(f"trackers must have one for {shown(station.name)}; got None")
        if tracker is not None:
            instance("trackers", tracker, DirectionTracker)  # type: ignore[type-abstract]  # any
    pairs = zip(given, stations, strict=True)
    return tuple(None if s.measurement is None else copy.deepcopy(t) for t, s in pairs)


def _made(name: str, station: Station) -> Tracker | None:
    """Return a tracker by name; the ambiguity of lines is expected with several stations."""
    kind = find(name)
    if not issubclass(kind, DirectionTracker):
        raise TypeError(f"trackers must be of directions; got {name!r}")
    if station.measurement is None:
        return None
    required = [n for n, p in inspect.signature(kind).parameters.items() if p.default is p.empty]
    if required != ["measurement"]:
        raise ValueError(
            f"trackers must require only the argument measurement; got {name!r}, which requires "
            f"{', '.join(required)}: pass one tracker a station"
        )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "directions .* are ambiguous", UserWarning)
        return kind(measurement=station.measurement)  # type: ignore[call-arg]  # checked above


def ready_made(entry: Any) -> StationBearings | None:
    """Return bearings given as azimuths and variances, None if they are missing.

    Examples
    --------
    >>> ready_made(([0.1, np.nan], [1e-3, 1e-3])).azimuth
    array([[0.1]])
    >>> ready_made(([0.1], [0.0]))
    Traceback (most recent call last):
    ValueError: variances must lie in (0, 1] rad²; got 0.0
    """
    if entry is None:
        return None
    if isinstance(entry, float) and np.isnan(entry):
        return None
    pair = items("bearings", entry)
    if len(pair) != 2:
        raise ValueError(f"bearings must be azimuths and variances; got {shown(entry)}")
    if pair[0] is None:
        return None
    azimuth, variance = np.broadcast_arrays(
        real_numbers("azimuths", pair[0]), real_numbers("variances", pair[1])
    )
    azimuth, variance = np.atleast_1d(azimuth), np.atleast_1d(variance)
    if azimuth.ndim != 1:
        raise ValueError(f"azimuths must have shape (n_bearings,); got {azimuth.shape}")
    valid = np.isfinite(azimuth)
    if azimuth.size and not valid.any():
        return None
    azimuth, variance = azimuth[valid], variance[valid]
    wrong = ~((variance > 0) & (variance <= MAX_VARIANCE))
    if wrong.any():
        raise ValueError(f"variances must lie in (0, 1] rad²; got {variance[wrong][0]}")
    return StationBearings(azimuth[:, None], variance)


def valid_readings(rss: LogNormalRSS, z: ArrayLike | None) -> ValidReadings | None:
    """Return the readings of the sensors with data, None if there are none."""
    if is_missing(z):
        return None
    xi = rss.readings(z)  # type: ignore[arg-type]  # not None
    if xi.ndim != 1:
        raise ValueError(f"readings must have shape ({rss.dim_z},); got {xi.shape}")
    valid = np.flatnonzero(np.isfinite(xi))
    return ValidReadings(xi[valid], rss.variance[valid], rss.propagation.at_sensors(valid))


def default_speed_std(area: Area) -> float:
    """Return the standard deviation of a velocity's coordinates: a hundredth of the area, m/s."""
    return SPEED_OVER_SIZE * area.size
