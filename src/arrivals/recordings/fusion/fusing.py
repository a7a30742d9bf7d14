"""Positions of sources from recordings, bearings and signal strength at several stations."""

from __future__ import annotations

import inspect
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from arrivals.measurements import is_missing
from arrivals.messages import similar
from arrivals.motion_models import ConstantVelocity
from arrivals.recordings.choice.options import NARROWBAND, WIDEBAND
from arrivals.recordings.fusion.bearing_tables import BearingTable, read_bearings
from arrivals.recordings.fusion.fused_run import FusedRun
from arrivals.recordings.fusion.fusion_steps import FusionSteps, fusion_steps
from arrivals.recordings.fusion.station_options import (
    STRENGTH,
    TRACKING,
    checked_options,
    checked_strength,
    merged,
)
from arrivals.recordings.fusion.station_plan import StationPlan
from arrivals.recordings.fusion.stations_file import (
    StationsFile,
    checked_area,
    checked_motion,
    read_stations,
)
from arrivals.recordings.fusion.strength import StrengthTable, read_strength
from arrivals.trackers import AmplitudePrior, Fused, find
from arrivals.trackers.fusion.arguments import area_of, default_speed_std
from arrivals.trackers.fusion.stations.single_step_bearings import bearings as single_step_bearings
from arrivals.trackers.run import Run, RunRecorder
from arrivals.typing import Float

OF_FUSED = ("amplitude", "detection", "hypotheses", "feedback")  # parameters, set by name
MOTION = ("speed", "q", "step")
ARGUMENTS = (*TRACKING, "wave_speed", "heading_std_deg", "position_std_m")
TIME_OF_SPEED = 100.0  # s, in which the velocity of a source changes by its standard deviation


def fuse(
    stations: str | PathLike[str] | Mapping[str, Any] | StationsFile,
    recordings: Sequence[Any] | None = None,
    *,
    bearings: str | PathLike[str] | Sequence[str | PathLike[str]] | BearingTable | None = None,
    rss: Any = None,
    sensors: Any = None,
    tracker: str | None = None,
    frequencies: float | Sequence[float] | None = None,
    **more: Any,
) -> FusedRun:
    """Locate and track sources by several arrays, and sensors of signal strength.

    Parameters
    ----------
    stations : str, path, mapping or StationsFile
        Stations file, or its keys: places, headings and arrays. What is given here replaces what
        the file has.
    recordings : sequence of path, Recording or array_like, optional
        One a station with an array, in the order of the file, in place of its recordings.
    bearings : path, sequence of paths or BearingTable, optional
        Tables of ready-made bearings, as in `read_bearings`; they replace recordings of their
        stations.
    rss : path or Network, optional
        Readings of signal strength, as in `arrivals.locate`.
    sensors : path, mapping or array_like, optional
        Sensors of a table of readings, as in `arrivals.locate`, in the coordinates of the stations.
    tracker : str, optional
        Registered name of the tracker of directions at the stations.
    frequencies : float or sequence of float, optional
        Frequencies, Hz.
    **more : object
        `band`, `window`, `hop`, `snapshots`, `reduce`, `follow`, `rate`, `center`, `format`,
        `channels`, `variable`, `transpose` as in `arrivals.track`, chosen if they are not given,
        the same for all stations; `area` (x0, y0, x1, y1), m; `speed`, standard deviation of a
        source's speed, m/s, and `q`, acceleration noise of `ConstantVelocity`, m²/s³; `step`,
        duration of a step of bearings, s; `alpha`, `sigma`, `floor`, `r_min`, `power`, `power_std`
        and `missing` of signal strength; `progress`, which wraps the steps, as tqdm does, and
        `watch`, which is called with the tracker and its `FusionSteps`, and returns a function of
        each step's number and measurements that is called after the step. Names of
        parameters of `Fused`, such as `detection__clutter`, set these, other names parameters of
        the stations' trackers.

    Returns
    -------
    FusedRun
        Estimates over time; times in s on the common clock.

    Raises
    ------
    ValueError, TypeError, OSError
        If an argument or a file is invalid.

    Examples
    --------
    >>> places = {"a": [0.0, 0.0], "b": [900.0, 0.0], "c": [400.0, 800.0]}
    >>> keys = [{"name": name, "x_m": x, "y_m": y, "bearings": "compass"}
    ...         for name, (x, y) in places.items()]
    >>> east, north = np.subtract([500.0, 300.0], list(places.values())).T
    >>> azimuth, time = np.tile(np.arctan2(north, east), 5), np.repeat(np.arange(5.0), 3)
    >>> bearings = BearingTable(time, np.tile([0, 1, 2], 5), azimuth, np.full(15, 3e-4))
    >>> run = fuse({"station": keys}, bearings=bearings)
    >>> run.position[-1].round()
    array([[500., 300.]])
    """
    from threadpoolctl import threadpool_limits

    contents = stations if isinstance(stations, StationsFile) else read_stations(stations)
    progress = more.pop("progress", lambda steps, **_: steps)
    watch = more.pop("watch", lambda fused, steps: lambda step, z: None)
    arguments = {"tracker": tracker, "frequencies": frequencies, **more}
    of_fused, of_trackers = _settings(arguments, contents.plans)
    own = checked_options({name: arguments.get(name) for name in ARGUMENTS})
    own = merged(own, {"settings": of_trackers} if of_trackers else {})
    plans = [replace(one, options=merged(one.options, own)) for one in contents.plans]
    area = checked_area(arguments.get("area")) or contents.area
    motion = {**contents.motion, **checked_motion(arguments)}
    given = {"readings": rss, "sensors": sensors}
    strength = {**contents.strength, **checked_strength(arguments)}
    strength |= {name: value for name, value in given.items() if value is not None}
    readings = _readings(strength, contents)
    if len(plans) < 2 and readings is None:
        raise ValueError(
            f"stations must be at least two without signal strength (--rss); got {len(plans)}"
        )
    table = (
        bearings
        if bearings is None or isinstance(bearings, BearingTable)
        else (read_bearings(bearings, plans))
    )
    steps = fusion_steps(
        plans, _recorded(plans, recordings, table), table, readings,
        step=motion.get("step"), options=strength,
    )  # fmt: skip
    fused = _fused(steps, area, motion, of_fused)
    with threadpool_limits(1, "blas"):  # matrices are small: more threads only wait
        run, last = _run(fused, steps, progress, watch(fused, steps))
    return FusedRun.of(
        run, stations=steps.stations, bearings=tuple(last), plane=contents.plane,
        sensors=None if steps.strength is None else steps.strength.model.sensors,
        start=steps.start, understood=_in_words(steps, fused, table),
    )  # fmt: skip


def _settings(
    arguments: Mapping[str, Any], plans: Sequence[StationPlan]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the parameters of `Fused`, and those of the stations' trackers.

    Raises
    ------
    TypeError
        If an argument is neither an option nor such a parameter.
    """
    known = {*ARGUMENTS, *MOTION, *STRENGTH, "area"}
    names = [name for name in arguments if name not in known]
    of_fused = {name: arguments[name] for name in names if name.partition("__")[0] in OF_FUSED}
    others = {name: arguments[name] for name in names if name not in of_fused}
    chosen = [arguments["tracker"], *(plan.options.get("tracker") for plan in plans)]
    kinds = {each for each in chosen if each is not None} or {NARROWBAND, WIDEBAND}
    parameters = {name for kind in kinds for name in inspect.signature(find(kind)).parameters}
    for name in others:
        if name.partition("__")[0] not in parameters:
            hint = similar(name, [*known, *parameters, *inspect.signature(fuse).parameters])
            raise TypeError(f"fuse has no argument {name!r}{hint}")
    return of_fused, others


def _readings(strength: Mapping[str, Any], contents: StationsFile) -> StrengthTable | None:
    """Return the readings of signal strength, if there are any."""
    if "readings" not in strength:
        if "sensors" in strength:
            raise ValueError("sensors require readings of signal strength (--rss)")
        return None
    if "floor" not in strength:
        raise ValueError(
            "floor must be given with readings of signal strength: the noise floor, dB (--floor)"
        )
    given = strength["readings"], strength.get("sensors"), strength.get("missing", ())
    return read_strength(*given, contents.plane)


def _recorded(
    plans: Sequence[StationPlan], recordings: Sequence[Any] | None, table: BearingTable | None
) -> dict[int, Any]:
    """Return the recordings by station; those with ready-made bearings have none."""
    ready = set() if table is None else set(table.station.tolist())
    others = [k for k in range(len(plans)) if k not in ready]
    if recordings is not None:
        placed = [k for k in others if plans[k].array is not None]
        given = [recordings] if isinstance(recordings, str | PathLike) else list(recordings)
        if len(given) != len(placed):
            raise ValueError(
                f"recordings must be one a station with an array and without bearings, "
                f"{len(placed)}; got {len(given)}"
            )
        return dict(zip(placed, given, strict=True))
    for k in others:
        if plans[k].recording is None:
            name = plans[k].name
            if table is None:
                raise ValueError(
                    f"station {name!r} must have a recording, or bearings (--bearings); got neither"
                )
            warnings.warn(f"station {name!r} has no bearings", stacklevel=3)
    return {k: plans[k].recording for k in others if plans[k].recording is not None}


def _fused(
    steps: FusionSteps,
    area: tuple[float, ...] | None,
    motion: Mapping[str, float],
    settings: Mapping[str, Any],
) -> Fused:
    """Return the tracker; speed and acceleration noise follow from the area if not given."""
    rss, amplitude = None, AmplitudePrior()
    if steps.strength is not None:
        rss, amplitude = steps.strength.model, steps.strength.amplitude
    speed = motion.get("speed", default_speed_std(area_of(area, steps.stations, rss)))
    q = motion.get("q", speed**2 / TIME_OF_SPEED)
    fused = Fused(
        ConstantVelocity(q), steps.stations, steps.trackers, rss=rss, amplitude=amplitude,
        area=area, speed_std=speed,
    )  # fmt: skip
    return fused.set_params(**settings) if settings else fused


def _in_words(steps: FusionSteps, fused: Fused, table: BearingTable | None) -> str:
    """Return what was chosen, in a line."""
    choices = dict.fromkeys(str(each.choice).removeprefix(": ") for each in steps.recorded.values())
    names = [station.name for station in steps.stations]
    q = fused.motion.get_params()["q"]
    phrases = [
        f"{len(names)} station{'s' if len(names) != 1 else ''} ({', '.join(names)})",
        *choices,
        *(() if table is None else [f"bearings: {', '.join(table.understood)}"]),
        f"{len(steps)} steps of {steps.duration:g} s",
        *steps.understood,
        f"--speed {fused.speed_std:.3g} --q {q:.3g}",
    ]
    return "; ".join(phrases)


def _run(
    fused: Fused,
    steps: FusionSteps,
    progress: Callable[..., Any],
    shown: Callable[[int, list[Any]], object],
) -> tuple[Run, list[Any]]:
    """Return the run, and the azimuths of each station in the last step with any."""
    recorder = RunRecorder(type(fused.estimate))
    last = int(np.flatnonzero((steps.taken >= 0).any(axis=1))[-1])
    started, dt, found = time.perf_counter(), np.diff(steps.time, prepend=np.nan), []
    dt[0] = steps.duration
    for step, z in enumerate(progress(steps, desc="fuse", total=len(steps))):
        fused.predict(dt=float(dt[step]))
        fused.update(z)
        recorder.add(fused.estimate, fused.x)
        shown(step, z)
        if step == last:
            found = step_azimuths(fused, z)
    elapsed = time.perf_counter() - started
    return recorder.run(dt=steps.duration, elapsed=elapsed).at(steps.time).made_by(fused), found


def step_azimuths(fused: Fused, z: Sequence[Any]) -> list[Float | None]:
    """Return the azimuths on the map, rad, of the bearings of each station in the present step.

    Parameters
    ----------
    fused : Fused
        After the step.
    z : sequence
        Its measurements.

    Returns
    -------
    list of (ndarray or None)
        None where a station had no data.
    """
    return [_azimuths(fused, k, z[k]) for k in range(len(fused.stations))]


def _azimuths(fused: Fused, k: int, entry: Any) -> Float | None:
    """Return the azimuths on the map of the bearings of a station in this step."""
    own, station = fused.active_trackers[k], fused.stations[k]
    if entry is None or own is None or station.measurement is None:
        return None if entry is None else np.asarray(entry[0])
    if is_missing(entry):
        return None
    doa: Float = own.estimate.doa  # type: ignore[attr-defined]  # of directions
    return station.to_map(single_step_bearings(station.measurement, entry, doa)[0]).ravel()
