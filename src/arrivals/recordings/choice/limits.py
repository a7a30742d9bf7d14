"""Frequencies and windows that fit an array and a rate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.recordings.framing import frequencies_in
from arrivals.validation import positive

LOWEST_HZ = 300.0  # below, rooms have few directions and much noise
WINDOW_S, SPEECH_STEP_S = 0.032, 0.064  # of speech
PERIODS = 3.0  # least number of periods in a window


def alias_frequency(array: SensorArray) -> float:
    """Return the frequency, Hz, at which the smallest spacing is half the wavelength.

    Parameters
    ----------
    array : SensorArray
        Two sensors or more, with a wave speed.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        If the array has one sensor, or no wave speed.

    Examples
    --------
    >>> alias_frequency(SensorArray.ula(4, spacing=0.05, speed=340.0))
    3400.0
    """
    if array.speed is None:
        raise ValueError("the array has no wave speed: the key 'speed' is missing, m/s")
    if array.n_sensors < 2:
        raise ValueError(f"array must have at least 2 sensors; got {array.n_sensors}")
    p = array.positions
    d2 = ((p[:, None] - p) ** 2).sum(axis=-1)
    return float(array.speed / (2 * np.sqrt(d2[~np.eye(len(p), dtype=bool)].min())))


@dataclass(frozen=True)
class BandLimits:
    """Band in which directions are resolved and the rate has frequencies.

    Parameters
    ----------
    low, high : float
        From 300 Hz, or a quarter of the alias limit if that is less, but at least 4 % of it, to
        1.5 times the alias limit or 0.475 of the rate, Hz.

    Examples
    --------
    >>> BandLimits.of(SensorArray.uca(8, radius=0.046, speed=343.0), rate=16000.0)
    BandLimits(low=300.0, high=7306.81...)
    """

    low: float
    high: float

    @classmethod
    def of(cls, array: SensorArray, rate: float) -> BandLimits:
        """Return the band of an array at a rate, Hz."""
        alias = alias_frequency(array)
        low = max(0.04 * alias, min(LOWEST_HZ, alias / 4))
        high = min(1.5 * alias, 0.475 * positive("rate", rate))
        if low >= high:
            raise ValueError(
                f"no frequency is usable: the array, of alias limit speed / (2 spacing) = "
                f"{alias:.4g} Hz, needs at least {low:.4g} Hz, and the rate, {rate:g} Hz, has "
                f"less than {high:.4g} Hz: pass a band or a frequency, or correct unit"
            )
        return cls(low, high)

    @classmethod
    def given(cls, band: Sequence[float], rate: float) -> BandLimits:
        """Return given edges, Hz, which must lie between 0 and half the rate."""
        low, high = (float(edge) for edge in band)
        frequencies_in((low, high), rate, 2)
        return cls(low, high)

    @property
    def window_duration(self) -> float:
        """Duration of a window, s: 32 ms, or three periods of the lowest frequency if longer."""
        return max(WINDOW_S, PERIODS / self.low)

    @property
    def has_speech(self) -> bool:
        """True if windows as short as speech requires have three periods."""
        return bool(self.window_duration < np.sqrt(2) * WINDOW_S)


def power_of_two(samples: float) -> int:
    """Return the power of two nearest to a number of samples by ratio, at least 2.

    Examples
    --------
    >>> power_of_two(512), power_of_two(1411), power_of_two(1536), power_of_two(0.1)
    (512, 1024, 2048, 2)
    """
    return int(2 ** round(math.log2(max(samples, 2.0))))
