"""Diffuse noise: independent plane waves from all directions of the sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float
from arrivals.validation import count, positive, real

PINK_FROM = 100.0  # Hz: power falls by 3 dB an octave from here on, and is constant below
BLOCK = 256  # frequencies between two entries of the coarse table of phases


def sphere(n_points: int) -> Float:
    """Return unit vectors spread evenly over the sphere, (n_points, 3), on a Fibonacci spiral.

    Examples
    --------
    >>> sphere(100).mean(axis=0).round(2) + 0.0
    array([0., 0., 0.])
    """
    k = np.arange(count("n_points", n_points)) + 0.5
    z, azimuth = 1 - 2 * k / n_points, np.pi * (1 + np.sqrt(5)) * k
    rho = np.sqrt(1 - z**2)
    return np.stack([rho * np.cos(azimuth), rho * np.sin(azimuth), z], axis=1)


def diffuse_noise(
    n_samples: int,
    sensors: ArrayLike,
    rate: float,
    rng: np.random.Generator,
    *,
    n_waves: int = 60,
    speed: float = 343.0,
) -> Float:
    """Draw pink noise of plane waves from all directions of the sphere.

    Between sensors at a distance d the coherence of many waves is sin(k d) / (k d), k = 2π f / c.

    Parameters
    ----------
    n_samples : int
        Number of samples.
    sensors : array_like, shape (n_sensors, 3)
        Positions, m.
    rate : float
        Samples per second, Hz.
    rng : numpy.random.Generator
        Source of random numbers.
    n_waves : int
        Number of plane waves, each with its own noise.
    speed : float
        Speed of sound, m/s.

    Returns
    -------
    ndarray, shape (n_samples, n_sensors)
        Noise of mean power 1; periodic, with a period longer than `n_samples`.

    Examples
    --------
    >>> noise = diffuse_noise(4000, [[0, 0, 0], [0.05, 0, 0]], 16000.0, np.random.default_rng(0))
    >>> noise.shape, round(float(np.mean(noise**2)), 6)
    ((4000, 2), 1.0)
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = next_fast_len(count("n_samples", n_samples, 2) + BLOCK, real=True)
    f = np.fft.rfftfreq(n, 1 / positive("rate", rate))
    spectrum = rfft(rng.standard_normal((count("n_waves", n_waves), n)), axis=1)
    spectrum *= np.sqrt(1 / np.maximum(f, PINK_FROM))
    lead = real("sensors", sensors) @ sphere(n_waves).T / positive("speed", speed)
    field = np.empty((len(lead), len(f)), dtype=np.complex128)
    start, step = np.exp(2j * np.pi * f[::BLOCK, None] * lead[:, None]), f[:BLOCK, None]
    for sensor, coarse in enumerate(start):
        # exp(j 2π f τ) as a product of a coarse and a fine table
        phase = coarse[:, None] * np.exp(2j * np.pi * step * lead[sensor])
        field[sensor] = (spectrum.T * phase.reshape(-1, n_waves)[: len(f)]).sum(axis=1)
    noise = irfft(field, n, axis=1)[:, :n_samples].T
    return np.asarray(noise / np.sqrt(np.mean(noise**2)))
