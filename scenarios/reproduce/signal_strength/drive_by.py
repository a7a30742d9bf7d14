"""Fig. 2: a synthetic drive-by sound, its complex envelope in short segments, and their laws."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.typing import Complex, Float

RATE = 48_000.0  # Hz
SEGMENT = 120  # samples
N_SEGMENTS = 4
CARRIER = 1100.0  # Hz, the dominant frequency
FUNDAMENTAL, LINE_WIDTH, RESONANCE = 25.0, 10.0, 150.0  # Hz: of an engine, and of its body
FAR_SEGMENTS = 6  # between envelope samples that count as far apart: 15 ms
LAGS = 12  # segments


def drive_by(n_samples: int, rng: np.random.Generator) -> Float:
    """Return a harmonic sound: lines at the multiples of 25 Hz whose phases drift.

    Their amplitudes are those of a resonance at 1100 Hz; 20 dB below is white noise.

    Parameters
    ----------
    n_samples : int
        At 48 kHz.
    rng : Generator

    Examples
    --------
    >>> drive_by(480, np.random.default_rng(0)).shape
    (480,)
    """
    t = np.arange(n_samples) / RATE
    sound = np.zeros(n_samples)
    drift = np.sqrt(2 * np.pi * LINE_WIDTH / RATE)
    for k in range(20, 90):
        frequency = k * FUNDAMENTAL
        amplitude = 1 / np.sqrt(1 + (2 * (frequency - CARRIER) / RESONANCE) ** 2)
        phase = rng.uniform(0, 2 * np.pi) + drift * np.cumsum(rng.standard_normal(n_samples))
        sound += amplitude * np.cos(2 * np.pi * frequency * t + phase)
    return np.asarray(sound + 0.1 * sound.std() * rng.standard_normal(n_samples))


def envelope(sound: Float) -> Complex:
    """Return one complex envelope a segment of 120 samples, at the dominant frequency.

    Examples
    --------
    >>> t = np.arange(480) / RATE
    >>> np.abs(envelope(np.cos(2 * np.pi * 1200 * t))).round(2)
    array([0.86, 0.86, 0.86, 0.86])
    """
    n = len(sound) // SEGMENT
    t = np.arange(n * SEGMENT) / RATE
    base = 2 * sound[: n * SEGMENT] * np.exp(-2j * np.pi * CARRIER * t)
    return np.asarray(base.reshape(n, SEGMENT).mean(axis=1))


class EnvelopeLaw(NamedTuple):
    """Tests of envelope samples as circular Gaussian and uncorrelated.

    Parameters
    ----------
    p_gaussian : float
        Kolmogorov-Smirnov probability of real and imaginary parts, samples far apart.
    p_circular : float
        Probability of as large a mean of z², of circular Gaussian samples.
    p_uncorrelated : float
        Probability of as large a correlation of samples 15 ms apart, of independent ones.
    correlation : ndarray, shape (LAGS + 1,)
        |E z(t) z*(t + lag)|/E|z|² of lags of 0, 1, .. segments.
    samples : ndarray
        Real and imaginary parts of the first segments, in units of their deviation.
    """

    p_gaussian: float
    p_circular: float
    p_uncorrelated: float
    correlation: Float
    samples: Float

    @property
    def limit(self) -> float:
        """Size of a correlation that independent samples exceed in 5 % of the records."""
        return float(np.sqrt(np.log(20) / (len(self.samples) / 2)))


def envelope_law(n_records: int, rng: np.random.Generator) -> EnvelopeLaw:
    """Test the envelope of independent records of LAGS + 1 segments each.

    Parameters
    ----------
    n_records : int
    rng : Generator
    """
    from scipy.stats import kstest

    records = [envelope(drive_by((LAGS + 1) * SEGMENT, rng)) for _ in range(n_records)]
    z = np.array(records)
    z /= np.sqrt(np.mean(np.abs(z) ** 2, axis=0))
    parts = np.concatenate([z[:, 0].real, z[:, 0].imag])
    correlation = np.abs((z[:, :1].conj() * z).mean(axis=0))
    # |mean|² of n products of mean power p is exponential of mean p/n
    circularity = np.abs((z[:, 0] ** 2).mean()) ** 2 * n_records / 2
    far = correlation[FAR_SEGMENTS] ** 2 * n_records
    return EnvelopeLaw(
        float(kstest(parts / parts.std(), "norm").pvalue), float(np.exp(-circularity)),
        float(np.exp(-far)), correlation, parts / parts.std(),
    )  # fmt: skip
