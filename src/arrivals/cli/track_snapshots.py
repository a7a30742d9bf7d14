"""`arrivals track` with complex snapshots, from files and streams."""

from __future__ import annotations

import argparse
import sys

import numpy as np

from arrivals.cli.models import make_tracker, model_at, n_stream_channels, selected_frequencies
from arrivals.cli.outputs import Bar, draw, live_output, refuse, write_table
from arrivals.measurement_models import SensorArray
from arrivals.recordings.framing import FramedSnapshots, frame_recording, frame_stream
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording
from arrivals.recordings.stream import track_live
from arrivals.typing import Float
from arrivals.validation import count


def track_snapshots(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    """Track the snapshots of a recording or a stream."""
    count("snapshots", arguments.snapshots)
    track = _track_stream if arguments.file == "-" else _track_file
    track(arguments, array, bar)


def _track_file(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    if arguments.band is None:  # refuse invalid arguments before the file is read
        measurement = model_at(array, arguments, selected_frequencies(arguments, None))
        tracker = make_tracker(arguments.tracker, measurement, dict(arguments.set))
    refuse(arguments, ("dtype", "channels"), "requires samples from standard input")
    recording = read(arguments.file, rate=arguments.rate, variable=arguments.variable,
                     transpose=arguments.transpose, array=array, rate_required=True)  # fmt: skip
    frequencies = selected_frequencies(arguments, recording.rate)
    if arguments.band:
        measurement = model_at(array, arguments, frequencies)
        tracker = make_tracker(arguments.tracker, measurement, dict(arguments.set))
    frames = _frames(arguments, recording, frequencies)
    time = _finite_times(frames)
    result = tracker.run(bar(frames.values, desc=arguments.tracker))
    result = result if time is None else result.at(time)
    write_table(result, arguments.out)
    draw(arguments.plot, result, snapshots=frames.values, measurement=measurement, time=time)


def _frames(
    arguments: argparse.Namespace, recording: Recording, frequencies: list[float]
) -> FramedSnapshots:
    frames = frame_recording(recording, frequencies, window=arguments.window, hop=arguments.hop,
                             n_snapshots=arguments.snapshots)  # fmt: skip
    if not np.isfinite(frames.values).any():
        raise ValueError(f"{arguments.file}: no sample of the array's channels is finite")
    return frames


def _finite_times(frames: FramedSnapshots) -> Float | None:
    return frames.time if np.isfinite(frames.time).all() else None


def _track_stream(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    frequencies = selected_frequencies(arguments, arguments.rate)
    measurement = model_at(array, arguments, frequencies)
    tracker = make_tracker(arguments.tracker, measurement, dict(arguments.set))
    refuse(arguments, ("plot", "variable", "transpose"), "requires a file, not a stream")
    snapshots = frame_stream(
        sys.stdin.buffer, n_stream_channels(arguments.channels, array), frequencies,
        n_snapshots=arguments.snapshots, dtype=arguments.dtype or "int16", rate=arguments.rate,
        window=arguments.window, hop=arguments.hop,
    )  # fmt: skip
    steps = ((time, array.select(z)) for time, z in snapshots)
    with live_output(arguments.out) as write:
        track_live(tracker, bar(steps, desc=arguments.tracker), write)
