"""Samples of two wideband sources about an array, block by block."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.typing import Float

RATE = 16000.0
BLOCK = 320  # samples: 20 ms
TURN = 40.0  # s in which the first source goes round


def moving_sources(array: SensorArray, seconds: float, *, seed: int = 0) -> Iterator[Float]:
    """Yield blocks (320, n_sensors) of noise from two directions, one of which moves.

    The second source pauses in every other four seconds.

    Parameters
    ----------
    array : SensorArray
        Array in a plane, with a speed.
    seconds : float
        Length.
    seed : int
        Of the noise.
    """
    speed = array.wavelength(1.0)  # m/s
    rng = np.random.default_rng(seed)
    frequencies = np.fft.rfftfreq(2 * BLOCK, 1 / RATE)
    band = (frequencies > 300) & (frequencies < 4000)
    window = np.sin(np.pi * (np.arange(2 * BLOCK) + 0.5) / (2 * BLOCK))
    late = np.zeros((BLOCK, array.n_sensors))
    for n in range(round(seconds * RATE / BLOCK)):
        t = n * BLOCK / RATE
        doa = np.array([2 * np.pi * t / TURN - np.pi, np.deg2rad(120.0)])
        a = array.steering_vector(doa[:, None], speed / frequencies[band])
        loud = np.array([1.0, 0.8 * (t % 8 < 4)])
        w = rng.standard_normal((2, 2, band.sum())) * loud[:, None]
        spectrum = np.zeros((len(frequencies), array.n_sensors), dtype=complex)
        spectrum[band] = np.einsum("sf,sfm->fm", w[0] + 1j * w[1], a)
        block = np.fft.irfft(spectrum, axis=0) * window[:, None]
        yield 0.5 * (late + block[:BLOCK]) + 0.001 * rng.standard_normal(late.shape)
        late = block[BLOCK:]
