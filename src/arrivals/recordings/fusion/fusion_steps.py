"""Steps of all stations on a common clock, from recordings and ready-made bearings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

from arrivals.measurement_models import Station
from arrivals.recordings.fusion.bearing_tables import BearingTable
from arrivals.recordings.fusion.common_steps import grid, members, nearest_steps, table_steps
from arrivals.recordings.fusion.station_plan import StationPlan
from arrivals.recordings.fusion.station_recordings import StationSteps, station_steps
from arrivals.recordings.fusion.strength import (
    StrengthSteps,
    StrengthTable,
    strength_steps,
    with_readings,
)
from arrivals.recordings.networks.times import FIRST_DATE
from arrivals.trackers import Tracker
from arrivals.typing import Complex, Float, Int

Pair: TypeAlias = tuple[Float, Float]  # azimuths, rad, and variances, rad², of a step


@dataclass(frozen=True, eq=False)
class FusionSteps:
    """Measurements of all stations by step, iterated over once.

    Parameters
    ----------
    time : ndarray, shape (n_steps,)
        Middles of the steps, s.
    duration : float
        Of a step, s.
    stations : tuple of Station
        Stations, with measurement models where they have recordings.
    trackers : tuple of (Tracker or None)
        Trackers of directions of the stations with recordings.
    recorded : mapping of int to StationSteps
        Steps of the recordings, by station.
    taken : ndarray of int, shape (n_steps, n_stations)
        Step of a station's recording, or 0 of its ready-made bearings; -1 where it has none.
    bearings : mapping of (int, int) to pair of ndarray
        Azimuths and variances by step and station.
    strength : StrengthSteps, optional
        Readings of signal strength.
    start : float, optional
        Time 0 in seconds since 1970-01-01 UTC, where times have dates.
    understood : tuple of str
        How steps were made, in phrases.
    """

    time: Float
    duration: float
    stations: tuple[Station, ...]
    trackers: tuple[Tracker | None, ...]
    recorded: Mapping[int, StationSteps]
    taken: Int
    bearings: Mapping[tuple[int, int], Pair]
    strength: StrengthSteps | None = None
    start: float | None = None
    understood: tuple[str, ...] = field(default=())

    def __len__(self) -> int:
        return len(self.time)

    def __iter__(self) -> Iterator[list[Complex | Pair | Float | None]]:
        sources = {k: one.at(self.taken[:, k].tolist()) for k, one in self.recorded.items()}
        for step in range(len(self)):
            z: list[Complex | Pair | Float | None] = [
                next(sources[k]) if k in sources else self.bearings.get((step, k))
                for k in range(len(self.stations))
            ]
            yield z if self.strength is None else [*z, self.strength.at(step)]


def fusion_steps(
    plans: Sequence[StationPlan],
    recordings: Mapping[int, Any],
    table: BearingTable | None,
    strength: StrengthTable | None = None,
    *,
    step: float | None = None,
    options: Mapping[str, Any] | None = None,
) -> FusionSteps:
    """Return the measurements of all stations by steps of common time.

    Parameters
    ----------
    plans : sequence of StationPlan
        Stations.
    recordings : mapping of int to object
        Recording of each station that has one, by its index.
    table : BearingTable, optional
        Ready-made bearings of the others.
    strength : StrengthTable, optional
        Readings of signal strength.
    step : float, optional
        Duration of a step of bearings, s; it follows from the times if None. With recordings it is
        that of their steps.
    options : mapping of str to object, optional
        Settings of signal strength.

    Returns
    -------
    FusionSteps

    Raises
    ------
    ValueError
        If times are dates in one input and not in another, or inputs do not overlap in time.
    """
    chosen = [plans[k] for k in recordings]
    starts = [plan.start if plan.start >= FIRST_DATE else None for plan in chosen]
    starts += [one.start for one in (table, strength) if one is not None]
    start = common_start(starts)
    moved = [replace(plan, start=plan.start - (start or 0.0)) for plan in chosen]
    recorded = dict(zip(recordings, station_steps(moved, list(recordings.values())), strict=True))
    if table is not None:
        table = replace(table, time=table.time + ((table.start or 0.0) - (start or 0.0)))
    if strength is not None:
        readings = strength.readings
        later = readings.time + ((readings.start or 0.0) - (start or 0.0))
        strength = replace(strength, readings=replace(readings, time=later))
    found = _of_recordings(plans, recorded, table) if recorded else _of_table(plans, table, step)
    found = replace(found, start=start)
    if strength is not None:
        return _with_strength(found, strength, options or {})
    _check_overlap(found)
    return found


def common_start(starts: Sequence[float | None]) -> float | None:
    """Return the whole second from which times with dates count; None if no input has dates.

    Examples
    --------
    >>> common_start([1777636800.5, 1777636803.0]), common_start([None, None])
    (1777636800.0, None)
    """
    dated = [one for one in starts if one is not None]
    if dated and len(dated) < len(starts):
        raise ValueError(
            "times must be dates in all inputs or in none: start_s of recordings is then in "
            "seconds since 1970"
        )
    return float(np.floor(min(dated))) if dated else None


def _of_recordings(
    plans: Sequence[StationPlan], recorded: Mapping[int, StationSteps], table: BearingTable | None
) -> FusionSteps:
    """Return steps of the duration of the recordings' longest steps."""
    times = [one.time for one in recorded.values()]
    duration = max(one.duration for one in recorded.values())
    steps = grid(times, duration)
    taken = np.full((len(steps), len(plans)), -1)
    taken[:, list(recorded)] = members(times, steps, duration)
    bearings: dict[tuple[int, int], Pair] = {}
    phrases: tuple[str, ...] = ()
    if table is not None:
        at = nearest_steps(table.time, steps, duration / 2)
        bearings = _pairs(table, at)
        n_left_out = np.count_nonzero(at < 0)
        if n_left_out:
            phrases = (f"bearings outside of the recordings left out: {n_left_out}",)
    return _assembled(plans, steps, duration, recorded, taken, bearings, phrases)


def _of_table(
    plans: Sequence[StationPlan], table: BearingTable | None, step: float | None
) -> FusionSteps:
    """Return steps of ready-made bearings alone."""
    if table is None:
        raise ValueError("recordings or bearings must be given; got neither")
    steps, at, duration = table_steps(table.time, table.station, step)
    taken = np.full((len(steps), len(plans)), -1)
    return _assembled(plans, steps, duration, {}, taken, _pairs(table, at), ())


def _assembled(
    plans: Sequence[StationPlan],
    steps: Float,
    duration: float,
    recorded: Mapping[int, StationSteps],
    taken: Int,
    bearings: Mapping[tuple[int, int], Pair],
    phrases: tuple[str, ...],
) -> FusionSteps:
    for step, k in bearings:
        taken[step, k] = 0
    stations = tuple(
        recorded[k].station if k in recorded else plan.station() for k, plan in enumerate(plans)
    )
    trackers = tuple(recorded[k].tracker if k in recorded else None for k in range(len(plans)))
    return FusionSteps(
        steps, duration, stations, trackers, recorded, taken, bearings, understood=phrases
    )


def _pairs(table: BearingTable, at: Int) -> dict[tuple[int, int], Pair]:
    """Return the azimuths and variances of each step and station."""
    valid = np.flatnonzero(at >= 0)
    order = valid[np.lexsort((table.station[valid], at[valid]))]
    key = np.stack([at[order], table.station[order]], axis=1)
    edges = np.flatnonzero((np.diff(key, axis=0) != 0).any(axis=1)) + 1
    pairs: dict[tuple[int, int], Pair] = {}
    for rows in np.split(order, edges) if len(order) else []:
        received = rows[np.isfinite(table.azimuth[rows])]
        place = int(at[rows[0]]), int(table.station[rows[0]])
        pairs[place] = table.azimuth[received], table.variance[received]
    return pairs


def _with_strength(
    found: FusionSteps, table: StrengthTable, options: Mapping[str, Any]
) -> FusionSteps:
    """Return steps with readings; those between bearings get steps of their own."""
    steps = found.time
    if not found.recorded:
        steps = with_readings(found.time, found.duration, table.readings.time)
    place = np.searchsorted(steps, found.time)
    taken = np.full((len(steps), len(found.stations)), -1)
    taken[place] = found.taken
    bearings = {(int(place[step]), k): pair for (step, k), pair in found.bearings.items()}
    strength, n_left_out = strength_steps(table, steps, found.duration, options)
    words = ", ".join([*table.understood, f"--alpha {strength.model.alpha:g}"])
    phrases = (*found.understood, f"signal strength: {words}")
    if n_left_out:
        phrases += (f"readings outside of the recordings left out: {n_left_out}",)
    return replace(
        found, time=steps, taken=taken, bearings=bearings, strength=strength, understood=phrases
    )


def _check_overlap(found: FusionSteps) -> None:
    """Raise a ValueError for a recording, or for all bearings, without a step in common."""
    present = found.taken >= 0
    together = present & (present.sum(axis=1, keepdims=True) > 1)
    alone = [k for k in range(len(found.stations)) if present[:, k].any() > together[:, k].any()]
    if not alone or (together.any() and not found.recorded):
        return
    spans = ", ".join(
        f"{station.name!r} {round(time[0] - half, 2):g} to {round(time[-1] + half, 2):g} s"
        for station, time, half in (
            (found.stations[k], found.time[present[:, k]], found.duration / 2)
            for k in range(len(found.stations))
            if present[:, k].any()
        )
    )
    name = found.stations[alone[0]].name
    cause = "start_s" if found.recorded else "the times, or pass a longer step (--step)"
    raise ValueError(
        f"station {name!r} must have a step in common with another one; got {spans}: check {cause}"
    )
