"""Measurement models and trackers from the arguments of the command line."""

from __future__ import annotations

import argparse
import inspect
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, get_type_hints

import numpy as np

from arrivals.measurement_models import ArraySamples, ArraySnapshot, SensorArray
from arrivals.recordings.framing import frequencies_in
from arrivals.trackers import Tracker, find
from arrivals.validation import count


def selected_frequencies(arguments: argparse.Namespace, rate: float | None) -> list[float]:
    """Return the frequencies, Hz: one, several, or those that fill a band."""
    options = [arguments.frequency, arguments.frequencies, arguments.band]
    if sum(each is not None for each in options) > 1:
        raise ValueError("pass only one of --frequency, --frequencies and --band")
    if arguments.band:
        if rate is None:
            raise ValueError("--band requires the samples per second: pass --rate")
        return frequencies_in(arguments.band, rate, arguments.window)
    if arguments.frequencies:
        return [float(each) for each in arguments.frequencies]
    if arguments.frequency is None:
        raise ValueError("pass --frequency, or --band for a tracker of real samples")
    return [arguments.frequency]


def model_at(
    array: SensorArray, arguments: argparse.Namespace, frequencies: list[float]
) -> ArraySnapshot:
    """Return the measurement model at frequencies; a line at one frequency must be unambiguous."""
    if array.speed is None:
        raise ValueError(
            f"{arguments.array}: the key 'speed' is missing: "
            "a frequency requires the wave speed, m/s"
        )
    wavelengths = [array.wavelength(each) for each in frequencies]
    limit = array.alias_limit
    if limit is not None and len(wavelengths) == 1 and wavelengths[0] < limit * (1 - 1e-6):
        raise ValueError(
            f"frequency must not exceed the array's alias limit, {array.speed / limit:g} Hz, at "
            f"which its grid spacing is half the wavelength; got {frequencies[0]:g} Hz. "
            "Several --frequencies may go beyond it"
        )
    return ArraySnapshot(array, wavelengths, n_snapshots=arguments.snapshots)


def takes_samples(name: str) -> bool:
    """Return True if a tracker's measurements are real samples, not complex snapshots."""
    try:
        hints = get_type_hints(find(name).__init__)
    except (NameError, TypeError):  # of another package, with types that cannot be resolved
        return False
    return hints.get("measurement") is ArraySamples


def make_tracker(
    name: str, measurement: ArraySnapshot | ArraySamples, settings: dict[str, Any]
) -> Tracker:
    """Return a direction tracker with settings by (nested) names."""
    kind = find(name)
    parameters = inspect.signature(kind).parameters
    if "measurement" not in parameters:
        raise ValueError(
            f"the tracker {name!r} has no parameter 'measurement': it cannot track snapshots"
        )
    for setting in settings:
        if setting.partition("__")[0] == "measurement":
            raise ValueError(f"--set {setting}: the measurement comes from --array and --frequency")
    required = [key for key, value in parameters.items() if value.default is value.empty]
    if required != ["measurement"]:
        raise ValueError(
            f"the tracker {name!r} requires {', '.join(required)}, not an array file alone"
        )
    plain = {key: value for key, value in settings.items() if key in parameters}
    with printed_warnings():
        tracker = kind(**{"measurement": measurement} | plain)
        return kind(**tracker.set_params(**settings).get_params(deep=False))


@contextmanager
def printed_warnings() -> Iterator[None]:
    """Print each warning once, in one line, on standard error."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for message in dict.fromkeys(str(each.message) for each in caught):
        print(f"arrivals: warning: {message}", file=sys.stderr)


def n_stream_channels(channels: int | None, array: SensorArray) -> int:
    """Return the number of channels of a stream: --channels, or that of the array file."""
    wired = array.n_sensors if array.channels is None else max(array.channels) + 1
    if channels is None and array.n_channels is None and wired > array.n_sensors:
        raise ValueError("the array file selects channels of a larger stream: pass --channels")
    n_channels = channels if channels is not None else array.n_channels or array.n_sensors
    array.select(np.empty(count("channels", n_channels)))
    return n_channels
