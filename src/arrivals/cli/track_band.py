"""`arrivals track` with real samples of a band, from files and streams."""

from __future__ import annotations

import argparse

from arrivals.cli.models import n_stream_channels, printed_warnings
from arrivals.cli.outputs import Bar, draw, live_output, refuse, write_table
from arrivals.cli.reading import read_recording
from arrivals.live.input.lag import LagMeter
from arrivals.live.steps import LiveScene
from arrivals.live.views import LiveViews
from arrivals.measurement_models import SensorArray
from arrivals.recordings.check import warn_of_faults
from arrivals.recordings.choice.assembly import make_tracker
from arrivals.recordings.sample_stream import band_samples, live_samples, track_samples
from arrivals.recordings.stream import track_live
from arrivals.trackers import Tracker


def track_band(
    arguments: argparse.Namespace, array: SensorArray, bar: Bar, views: LiveViews
) -> None:
    """Track by a tracker of single real samples, from a recording or a stream."""
    refuse(
        arguments,
        ("frequency", "frequencies", "center", "reduce", "follow", "window", "unknowns", "nearest"),
        "requires snapshots, not a tracker of real samples",
    )
    if arguments.snapshots not in (None, 1):
        raise ValueError("--snapshots requires snapshots, not a tracker of real samples")
    if arguments.file == "-":
        _track_band_stream(arguments, array, bar, views)
        return
    recording = read_recording(arguments, array)
    if recording.is_narrowband:
        raise ValueError(f"{arguments.file}: --band requires real samples; got complex ones")
    tracker, rate = _band_tracker(arguments, array, recording.rate)
    with printed_warnings():
        warn_of_faults(recording)
    every = arguments.hop or 1
    views.open(_scene(arguments, arguments.file), tracker)
    samples = enumerate(bar(recording.samples, desc=arguments.tracker))
    watched = views.watch(tracker, ((k / rate, z) for k, z in samples), every)
    result = track_samples(tracker, (z for _, z in watched), rate, every=every)
    write_table(result, arguments.out, printed=not views.replaces_table)
    draw(arguments.plot, result, time=result.time)


def _scene(arguments: argparse.Namespace, source: str) -> LiveScene:
    """Return what the views know of a run before it starts."""
    return LiveScene(f"{source}: {arguments.tracker}", line=True)


def _track_band_stream(
    arguments: argparse.Namespace, array: SensorArray, bar: Bar, views: LiveViews
) -> None:
    refuse(arguments, ("plot", "variable", "transpose", "format"), "requires a file, not a stream")
    tracker, rate = _band_tracker(arguments, array, arguments.rate)
    n_channels = n_stream_channels(arguments.channels, array)
    frames = live_samples(arguments.source, n_channels, dtype=arguments.dtype or "int16")
    steps = ((k / rate, array.select(z)) for k, z in enumerate(frames))
    every, lag = arguments.hop or 1, LagMeter(arguments.received, arguments.late or "wait")
    views.open(_scene(arguments, arguments.device or "standard input"), tracker, lag=lag)
    with live_output(arguments.out, printed=not views.replaces_table) as write:
        bars = views.watch(tracker, lag.steps(bar(steps, desc=arguments.tracker)), every)
        if track_live(tracker, bars, write, every=every) == 0:
            raise ValueError("the stream ended before one sample of every channel")


def _band_tracker(
    arguments: argparse.Namespace, array: SensorArray, rate: float | None
) -> tuple[Tracker, float]:
    """Return the tracker of a source that fills the band, and the rate."""
    if rate is None:
        raise ValueError("--band requires the samples per second: pass --rate")
    measurement = band_samples(array, rate, arguments.band, arguments.snr)
    with printed_warnings():
        return make_tracker(arguments.tracker, measurement, dict(arguments.set)), rate
