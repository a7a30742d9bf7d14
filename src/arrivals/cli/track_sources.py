"""`arrivals track` with separated sources: directions and signals of a recording."""

from __future__ import annotations

import argparse

import numpy as np

from arrivals.cli.models import model_at, printed_warnings
from arrivals.cli.outputs import Bar, draw, refuse, write_table
from arrivals.cli.reading import read_recording
from arrivals.cli.separated_signals import (
    analytic,
    check_writable,
    decimate,
    separator,
    write_signals,
)
from arrivals.measurement_models import SensorArray
from arrivals.recordings.check import warn_of_faults
from arrivals.recordings.formats.file_contents import MAX_BYTES
from arrivals.recordings.recording import Recording
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.trackers import ARKalmanQRDRLS, find
from arrivals.typing import Complex, Float


def separates(arguments: argparse.Namespace) -> bool:
    """Return True if the tracker estimates source signals and the input is a file.

    Raises
    ------
    ValueError
        If signals are requested of another tracker, or of a stream.
    """
    name = arguments.tracker
    estimates_signals = name is not None and issubclass(find(name), ARKalmanQRDRLS)
    if arguments.signals and arguments.file == "-":
        raise ValueError("--signals requires a file, not a stream")
    if arguments.signals and not estimates_signals:
        raise ValueError(f"--signals requires a tracker that estimates signals; got {name}")
    return estimates_signals and arguments.file != "-"


def track_sources(arguments: argparse.Namespace, array: SensorArray, bar: Bar) -> None:
    """Track and separate sources, sample by sample for real samples without a window.

    The array's response at the frequency, or at the middle of the band, is used for the whole band.

    Parameters
    ----------
    arguments : argparse.Namespace
        Arguments of `arrivals track`.
    array : SensorArray
        The array.
    bar : callable
        As in `track`.
    """
    if arguments.frequency is None and arguments.band:
        arguments.frequency = sum(arguments.band) / 2
    if arguments.frequency is None:
        raise ValueError("pass --frequency, or --band, of the separated sources")
    refuse(
        arguments,
        ("frequencies", "center", "reduce", "follow", "unknowns", "nearest"),
        "requires another tracker: this one takes --frequency",
    )
    model = model_at(array, arguments, [arguments.frequency])
    recording = read_recording(arguments, array)
    every_sample = not (recording.is_narrowband or arguments.window)
    z, time = _samples(recording, arguments) if every_sample else _snapshots(recording, arguments)
    tracker = separator(dict(arguments.set), z, model, every_sample)
    real_valued = tracker.motion.real_valued
    rate = None if arguments.window else recording.rate
    if arguments.signals:
        check_writable(arguments.signals, real_valued, rate)
    with printed_warnings():
        warn_of_faults(recording, arguments.frequency)
    result = tracker.run(bar(z, desc=arguments.tracker))
    result = result if time is None else result.at(time)
    if arguments.signals:
        signals = result.signals.real if real_valued else result.signals
        write_signals(arguments.signals, signals, rate)
    every = arguments.hop if every_sample and arguments.hop else tracker.interval
    result = decimate(result, every)
    write_table(result, arguments.out)
    draw(arguments.plot, result, time=None if time is None else result.time)


def _samples(recording: Recording, arguments: argparse.Namespace) -> tuple[Complex, Float | None]:
    if recording.rate is None:
        raise ValueError(f"{arguments.file}: the rate is unknown: pass --rate")
    if isinstance(recording.samples, StoredSamples) and recording.samples.n_bytes > MAX_BYTES:
        limit, got = MAX_BYTES / 1e9, recording.samples.n_bytes / 1e9
        raise ValueError(
            f"{arguments.file}: separated sources require all samples in memory, at most {limit:g} "
            f"GB; got {got:.3g} GB: cut the file, or pass --window"
        )
    z = analytic(recording.samples, recording.rate, arguments.band)
    return z, np.arange(len(z)) / recording.rate


def _snapshots(recording: Recording, arguments: argparse.Namespace) -> tuple[Complex, Float | None]:
    refuse(arguments, ("band",), "requires real samples, without --window")
    snapshots = recording.snapshots(arguments.frequency, window=arguments.window, hop=arguments.hop)
    time = snapshots.time if np.isfinite(snapshots.time).all() else None
    return snapshots.values, time
