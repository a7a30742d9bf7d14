"""The command line's way to separated sources: directions and signals from one recording."""

from __future__ import annotations

import argparse

import numpy as np

from arrivals.cli.separated_signals import (
    analytic,
    check_writable,
    separator,
    thinned,
    write_signals,
)
from arrivals.cli.track import Bar, model_at, print_rows, refuse
from arrivals.measurement_models import SensorArray
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording
from arrivals.trackers import ARKalmanQRDRLS, find
from arrivals.typing import Complex, Float


def separates(arguments: argparse.Namespace) -> bool:
    """Tell whether the tracker tells signals, and what is heard is a file.

    Raises
    ------
    ValueError
        If signals are wanted of another tracker, or of a stream.
    """
    told = issubclass(find(arguments.tracker), ARKalmanQRDRLS)
    if arguments.signals and arguments.file == "-":
        raise ValueError("--signals goes with a file, not with a stream")
    if arguments.signals and not told:
        raise ValueError(f"--signals: the tracker {arguments.tracker!r} tells no signals")
    return told and arguments.file != "-"


def track_sources(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    """Track and separate sources, sample by sample where samples are real and no window is given.

    The array's response is that at the frequency, or in the middle of the band, for all of it.

    Parameters
    ----------
    arguments : argparse.Namespace
        Those of `arrivals track`.
    array : SensorArray
    bar : callable
        As in `track`.
    """
    refuse(arguments, ("dtype", "channels"), "goes with samples from standard input")
    if arguments.frequency is None and arguments.band:
        arguments.frequency = sum(arguments.band) / 2
    if arguments.frequency is None:
        raise ValueError("give --frequency, or --band, of the separated sources")
    refuse(arguments, ("frequencies",), "goes with other trackers: this one takes --frequency")
    model = model_at(array, arguments, [arguments.frequency])
    recording = read(arguments.file, rate=arguments.rate, variable=arguments.variable,
                     transpose=arguments.transpose, array=array)  # fmt: skip
    every_sample = not (recording.is_narrowband or arguments.window)
    z, time = _samples(recording, arguments) if every_sample else _snapshots(recording, arguments)
    tracker = separator(dict(arguments.set), z, model, every_sample)
    real_valued = tracker.motion.real_valued
    rate = None if arguments.window else recording.rate
    if arguments.signals:
        check_writable(arguments.signals, real_valued, rate)
    result = tracker.run(bar(z, desc=arguments.tracker))
    result = result if time is None else result.at(time)
    if arguments.signals:
        signals = result.signals.real if real_valued else result.signals
        write_signals(arguments.signals, signals, rate)
    every = arguments.hop if every_sample and arguments.hop else tracker.interval
    result = thinned(result, every)
    if arguments.out:
        result.to_csv(arguments.out)
    else:
        print_rows(result)
    if arguments.plot:
        from arrivals.plots.bearing_time import plot_bearing_time, save

        save(plot_bearing_time(result, time=None if time is None else result.time), arguments.plot)


def _samples(recording: Recording, arguments: argparse.Namespace) -> tuple[Complex, Float | None]:
    if recording.rate is None:
        raise ValueError(f"{arguments.file}: the rate is not known: pass --rate")
    z = analytic(recording.samples, recording.rate, arguments.band)
    return z, np.arange(len(z)) / recording.rate


def _snapshots(recording: Recording, arguments: argparse.Namespace) -> tuple[Complex, Float | None]:
    refuse(arguments, ("band",), "goes with real samples, and not with --window")
    found = recording.snapshots(arguments.frequency, window=arguments.window, hop=arguments.hop)
    return found.values, found.time if np.isfinite(found.time).all() else None
