"""Recordings of the stations of a map, and their steps on a common clock."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any

import numpy as np

from arrivals.measurement_models import Station
from arrivals.recordings.check import warn_of_faults
from arrivals.recordings.choice import Choice
from arrivals.recordings.choice.assembly import assembled, takes_samples
from arrivals.recordings.fusion.common_choice import common_choices
from arrivals.recordings.fusion.station_options import reading_options, track_options
from arrivals.recordings.fusion.station_plan import StationPlan, of_station
from arrivals.recordings.narrowband import default_window
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.recordings.tracking import RecordedSteps
from arrivals.trackers import Tracker, find
from arrivals.typing import Complex, Float

SECONDS = {"step_duration": 1.0}  # trackers of stations are predicted in seconds


@dataclass(frozen=True, eq=False)
class StationSteps:
    """Steps of the recording of a station.

    Parameters
    ----------
    station : Station
        With the measurement model of the steps.
    tracker : Tracker
        Tracker of directions.
    steps : RecordedSteps
        Snapshots, iterated over once.
    time : ndarray, shape (n_steps,)
        Middles of the steps on the common clock, s.
    duration : float
        Of a step, s.
    choice : Choice
        Frequencies, windows and tracker.
    """

    station: Station
    tracker: Tracker
    steps: RecordedSteps
    time: Float
    duration: float
    choice: Choice

    def at(self, numbers: Sequence[int]) -> Iterator[Complex | None]:
        """Yield the snapshots of some of the steps, which increase; None for -1."""
        own = enumerate(self.steps)
        for number in numbers:
            yield None if number < 0 else next(z for k, z in own if k == number)


def station_steps(plans: Sequence[StationPlan], recordings: Sequence[Any]) -> list[StationSteps]:
    """Return the steps of recordings, with settings chosen in common unless they are given.

    Recordings with a rate begin late by less than a step, so that steps of one duration are at the
    same times.

    Parameters
    ----------
    plans : sequence of StationPlan
        Stations with an array.
    recordings : sequence of path, sequence of paths, Recording or array_like
        Recording of each.

    Returns
    -------
    list of StationSteps

    Raises
    ------
    ValueError, TypeError, OSError
        If a recording or an option is invalid; the message begins with the station.
    """
    opened = [_opened(*pair) for pair in zip(plans, recordings, strict=True)]
    options = [track_options(plan.options) for plan in plans]
    for plan, one in zip(plans, options, strict=True):
        if takes_samples(one.tracker):
            raise ValueError(
                f"station {plan.name!r}: tracker must take snapshots; got {one.tracker!r}, of real "
                "samples"
            )
    choices = common_choices(opened, options)
    durations = [step_duration(*pair) for pair in zip(opened, choices, strict=True)]
    clock = max((plan.start for plan in plans), default=0.0)
    return [
        _steps(plan, recording, choice, duration, clock)
        for plan, recording, choice, duration in zip(plans, opened, choices, durations, strict=True)
    ]


def _opened(plan: StationPlan, recording: Any) -> Recording:
    """Return the recording of a station, with its array."""
    with of_station(plan.name), named_warnings(plan.name):
        array = plan.array
        if array is None:
            raise ValueError("a recording requires the key 'array'")
        if array.speed is None:
            raise ValueError("the array requires the key 'speed', the wave speed, m/s")
        if isinstance(recording, Recording):
            return recording if recording.array == array else recording.select(array)
        if isinstance(recording, tuple):
            recording = list(recording)
        given = reading_options(plan.options)
        return read(recording, array=array, rate_required=True, **given)


def step_duration(recording: Recording, choice: Choice) -> float | None:
    """Return the duration of a step, s; None if it follows from the times of the snapshots.

    Examples
    --------
    >>> choice = Choice("a tone", "svalse", (100.0,), window=200, hop=100, n_snapshots=4)
    >>> step_duration(Recording(np.ones((1000, 3)), 1000.0), choice)
    0.4
    """
    if recording.rate is None or recording.time is not None:
        return None
    hop = 1
    if not recording.is_narrowband:
        window = choice.window or default_window(recording.rate, min(choice.frequencies))
        hop = choice.hop or window
    return hop * choice.n_snapshots / recording.rate


def _steps(
    plan: StationPlan, recording: Recording, choice: Choice, duration: float | None, clock: float
) -> StationSteps:
    """Return the steps of a station; those of a rate begin a whole number of steps from `clock`."""
    array, late = recording.array, 0
    with of_station(plan.name), named_warnings(plan.name):
        if array is None:
            raise ValueError("a recording requires the key 'array'")
        if duration is not None and recording.rate is not None:
            late = round(((clock - plan.start) % duration) * recording.rate)
            late %= round(duration * recording.rate) or 1
        chosen = choice
        if "step_duration" in signature(find(choice.tracker)).parameters:
            chosen = replace(choice, settings={**choice.settings, **SECONDS})
        with warnings.catch_warnings():
            # other stations resolve the ambiguity of a line
            warnings.filterwarnings("ignore", "directions .* are ambiguous", UserWarning)
            model, tracker = assembled(array, chosen, recording.rate)
        steps = RecordedSteps(recording, choice)
        if late:
            later = RecordedSteps(without_start(recording, late), choice)
            late, steps = (late, later) if len(later) else (0, steps)
        time = plan.start + np.asarray(steps.time)
        time = time + late / recording.rate if recording.rate is not None else time
        if not (np.isfinite(time).all() and (np.diff(time) > 0).all()):
            raise ValueError("steps must have increasing times: pass rate (--rate), Hz")
        warn_of_faults(recording, min(choice.frequencies))
        if duration is None:
            duration = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
        return StationSteps(plan.station(model), tracker, steps, time, duration, choice)


def without_start(recording: Recording, n: int) -> Recording:
    """Return a recording without its first n samples, which stay in their file.

    Examples
    --------
    >>> without_start(Recording(np.arange(5.0), 10.0), 3).samples.ravel()
    array([3., 4.])
    """
    samples = recording.samples
    if not isinstance(samples, StoredSamples):
        return replace(recording, samples=samples[n:])
    load = samples.load
    shape = len(samples) - n, samples.shape[1]
    later = replace(samples, shape=shape, load=lambda start, stop: load(start + n, stop + n))
    return replace(recording, samples=later)


@contextmanager
def named_warnings(name: str) -> Iterator[None]:
    """Begin the messages of warnings with the name of a station."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for text, kind in dict.fromkeys((str(each.message), each.category) for each in caught):
        warnings.warn(f"station {name!r}: {text}", kind, stacklevel=3)
