"""Samples for the tests of recordings, and the check of a refused file."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from arrivals.recordings import read
from arrivals.typing import Float

RATE = 8000.0
NUMBERS = np.random.default_rng(0).uniform(-1, 1, (50, 3))


def plane_wave(
    delays: Float, frequency: float, n_samples: int = 4000, amplitude: float = 1.0
) -> Float:
    """Return samples (n_samples, n_sensors) of a tone with delays in s."""
    t = np.arange(n_samples)[:, None] / RATE
    return amplitude * np.cos(2 * np.pi * frequency * (t - delays) + 0.3)


def assert_refused(path: Path, message: str, **arguments: Any) -> None:
    """Check that reading raises one line that begins with the path and matches a message."""
    with pytest.raises(ValueError, match=message) as error:
        read(path, **arguments)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def sio_bytes(
    samples: NDArray[Any], order: str = ">", record: int = 128, pad: bool = True
) -> bytes:
    """Return an SIO file of samples (n_samples, n_channels), by loops over records."""
    width, (n, channels) = samples.dtype.itemsize, samples.shape
    per, kind = record // width, int(samples.dtype.kind == "f")
    rounds = -(-n // per)
    words = (7, rounds * channels, record, channels, width, kind, n, 32677)
    parts = [(struct.pack(order + "8I", *words) + b"name".ljust(96)).ljust(record, b"\0")]
    for i in range(rounds):
        for channel in range(channels):
            block = samples[i * per : (i + 1) * per, channel].astype(order + samples.dtype.str[1:])
            is_last = (i, channel) == (rounds - 1, channels - 1)
            parts.append(block.tobytes() if is_last and not pad else block.tobytes().ljust(record))
    return b"".join(parts)
