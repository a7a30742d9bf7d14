"""Measurement models and trackers from the arguments of the command line."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.files import TABLES
from arrivals.recordings.choice.assembly import measurement_at
from arrivals.validation import count


def model_at(
    array: SensorArray, arguments: argparse.Namespace, frequencies: list[float]
) -> ArraySnapshot:
    """Return the measurement model at frequencies; a line at one frequency must be unambiguous."""
    require_speed(array, arguments)
    return measurement_at(array, frequencies, arguments.snapshots or 1)


def require_speed(array: SensorArray, arguments: argparse.Namespace) -> None:
    """Raise a ValueError if the array file has no wave speed."""
    if array.speed is None:
        cure = "add speed"
        if arguments.array.lower().endswith(TABLES):
            table = os.path.basename(arguments.array)
            cure = f'write a file with kind = "positions", positions = "{table}" and speed'
        raise ValueError(
            f"{arguments.array}: the key 'speed' is missing: "
            f"a frequency requires the wave speed, m/s: {cure}"
        )


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
