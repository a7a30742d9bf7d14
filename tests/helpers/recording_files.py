"""Samples for the tests of recordings, and the check of a refused file."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

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
