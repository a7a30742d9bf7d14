"""`arrivals track` with complex snapshots, from files and streams."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable, Iterable
from typing import BinaryIO

import numpy as np

from arrivals.cli.models import n_stream_channels, printed_warnings, require_speed
from arrivals.cli.outputs import Bar, draw, input_files, live_output, refuse, write_table
from arrivals.cli.reading import read_recording
from arrivals.live.input.lag import LagMeter
from arrivals.live.steps import LiveScene
from arrivals.live.views import LiveViews
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurements import is_missing
from arrivals.recordings.check import warn_of_faults
from arrivals.recordings.choice import Choice, MeanSpectrum, TrackOptions, choose
from arrivals.recordings.choice.assembly import assembled
from arrivals.recordings.choice.unknowns import unknowns_in_words
from arrivals.recordings.formats.iq import complex_frames
from arrivals.recordings.framing import frame_stream
from arrivals.recordings.step_snapshots import reduced_snapshots, strongest_candidates
from arrivals.recordings.stream import read_ahead, track_live
from arrivals.recordings.tracking import RecordedSteps, choice_for, followed
from arrivals.typing import Complex

AHEAD_S = 2.0  # of a stream, on which the choice is based


def track_snapshots(
    arguments: argparse.Namespace, array: SensorArray, bar: Bar, views: LiveViews
) -> None:
    """Track the snapshots of a recording or a stream."""
    require_speed(array, arguments)
    names = ("frequency", "frequencies", "center", "band")
    given = [getattr(arguments, name) for name in names]
    if sum(each is not None for each in given) > 1:
        raise ValueError("pass only one of --frequency, --frequencies, --center and --band")
    frequencies = next((each for each in given[:3] if each is not None), None)
    options = TrackOptions(
        arguments.tracker, frequencies, arguments.band, arguments.window, arguments.hop,
        arguments.snapshots, dict(arguments.set), arguments.reduce,
        arguments.follow, arguments.unknowns or "azimuth", arguments.nearest,
    )  # fmt: skip
    track = _track_stream if arguments.file == "-" else _track_file
    track(arguments, array, options, bar, views)


def _track_file(
    arguments: argparse.Namespace, array: SensorArray, options: TrackOptions, bar: Bar,
    views: LiveViews,
) -> None:  # fmt: skip
    if options.frequencies and arguments.center is None:
        # refuse invalid arguments before the file is read
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rate = 4 * np.max(options.frequencies)  # any that has the frequencies
            assembled(array, choose(array, rate, MeanSpectrum.empty(), options), None)
    recording = read_recording(arguments, array)
    with printed_warnings():
        choice = choice_for(recording, options)
        measurement, tracker = assembled(recording.array or array, choice, recording.rate)
        steps = RecordedSteps(recording, choice)
        warn_of_faults(recording, min(choice.frequencies), plane_waves=choice.unknowns != "range")
    time = steps.time if np.isfinite(steps.time).all() else None
    announced = map(_announcement(choice, options, measurement), steps)
    views.open(_scene(arguments, choice, array), tracker, measurement=measurement)
    bars = bar(announced, desc=choice.tracker, total=len(steps))
    at: Iterable[float] = range(len(steps)) if time is None else time.tolist()
    timed = ((t, z) for z, t in zip(bars, at, strict=True))  # the steps end first, and are checked
    watched = views.watch(tracker, timed)
    result = tracker.run(z for _, z in watched)
    result = result if time is None else result.at(time)
    write_table(result, arguments.out, printed=not views.replaces_table)
    draw(arguments.plot, result, snapshots=steps, measurement=measurement, time=time,
         normalize=arguments.normalize or "run")  # fmt: skip


def _scene(arguments: argparse.Namespace, choice: Choice, array: SensorArray) -> LiveScene:
    """Return what the views know of a run before it starts."""
    files = ["standard input"] if arguments.file == "-" else input_files(arguments)
    source = getattr(arguments, "source_name", arguments.device) or ", ".join(files)
    kind = "sky" if choice.unknowns == "sphere" else "polar"
    return LiveScene(f"{source}: {choice.tracker}", kind, array.dim == 1)


def _announcement(
    choice: Choice, options: TrackOptions, measurement: ArraySnapshot
) -> Callable[[Complex], Complex]:
    """Return an identity that prints what was chosen at the first valid snapshot.

    If no snapshot is valid, the error is then the only line on standard error.
    """
    complete = options.tracker and options.has_frequencies and options.snapshots
    lines = [str(choice)] if choice.reason and not complete else []
    lines += [unknowns_in_words(measurement)] if choice.unknowns != "azimuth" else []

    def announce(z: Complex) -> Complex:
        if lines and not is_missing(z):
            for line in lines:
                print(f"arrivals: {line}", file=sys.stderr)
            lines.clear()
        return z

    return announce


def _track_stream(
    arguments: argparse.Namespace, array: SensorArray, options: TrackOptions, bar: Bar,
    views: LiveViews,
) -> None:  # fmt: skip
    refuse(arguments, ("plot", "variable", "transpose", "format"), "requires a file, not a stream")
    n_channels = n_stream_channels(arguments.channels, array)
    source, dtype = complex_frames(arguments.source, arguments.dtype or "int16")
    if arguments.center is not None and not dtype.startswith("complex"):
        raise ValueError(f"--center requires complex samples: pass --dtype; got {dtype}")
    with printed_warnings():
        choice, source = _stream_choice(source, dtype, arguments.rate, array, options, n_channels)
        measurement, tracker = assembled(array, choice, arguments.rate)
    frequencies = followed(choice, arguments.rate, choice.window or 1)
    frames = frame_stream(
        source, n_channels, frequencies, n_snapshots=choice.n_snapshots, dtype=dtype,
        rate=arguments.rate, window=choice.window, hop=choice.hop,
    )  # fmt: skip
    announce = _announcement(choice, options, measurement)
    steps = ((time, announce(_completed(array.select(z), choice))) for time, z in frames)
    lag = LagMeter(arguments.received, arguments.late or "wait")
    views.open(_scene(arguments, choice, array), tracker, measurement=measurement, lag=lag)
    with live_output(arguments.out, printed=not views.replaces_table) as write:
        bars = lag.steps(bar(steps, desc=choice.tracker))
        track_live(tracker, views.watch(tracker, bars), write)


def _completed(z: Complex, choice: Choice) -> Complex:
    """Return the snapshots of a step, reduced or of the followed frequencies."""
    if choice.follow is not None:
        return np.asarray(strongest_candidates(z[None], len(choice.frequencies))[0])
    return reduced_snapshots(z) if choice.reduce else z


def _stream_choice(
    source: BinaryIO, dtype: str, rate: float | None, array: SensorArray,
    options: TrackOptions, n_channels: int,
) -> tuple[Choice, BinaryIO]:  # fmt: skip
    """Return the choice for a stream, from its first samples if necessary, and the stream."""
    if dtype.startswith("complex"):
        return choose(array, rate, None, options), source
    spectrum = MeanSpectrum.empty()
    choice = choose(array, rate, spectrum, options)  # refuses before the first read
    if options.has_frequencies or rate is None:
        return choice, source
    samples, source = read_ahead(source, n_channels, AHEAD_S, dtype=dtype, rate=rate)
    if len(samples):
        spectrum = MeanSpectrum.of(array.select(samples), rate)
    return choose(array, rate, spectrum, options), source
