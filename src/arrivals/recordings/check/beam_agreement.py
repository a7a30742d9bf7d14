"""Agreement of each channel with the beam of the others."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
from arrivals.recordings.check.segments import PhaseSegments
from arrivals.typing import Complex, Float, Int

ELEVATIONS = (1.0, 0.9, 0.75)  # cosines: sources up to 40 degrees over a plane
MIN_DIRECTIONS, MAX_DIRECTIONS = 36, 720
PER_WAVELENGTH = 8  # directions for each wavelength of the diameter
SPHERE = 4096  # directions on the sphere, above which they are twice as far apart
MAX_BLOCK = 2**22  # complex numbers of the beams that are computed together: 32 MB


def scan_responses(array: SensorArray, frequency: Float) -> Complex:
    """Return responses to plane waves of a grid of directions.

    Parameters
    ----------
    array : SensorArray
        With a wave speed.
    frequency : ndarray, shape (n_bins,)
        Hz.

    Returns
    -------
    ndarray, shape (n_bins, n_sensors, n_directions)
        Of directions on a line, in a plane with elevations to 40 degrees, or on the sphere.

    Examples
    --------
    >>> scan_responses(SensorArray.uca(4, 0.05, speed=343.0), np.array([1000.0, 2000.0])).shape
    (2, 4, 108)
    """
    p, speed = array.positions, array.speed or np.nan
    diameter = 2 * np.linalg.norm(p - p.mean(axis=0), axis=1).max()
    wanted = PER_WAVELENGTH * diameter * frequency.max() / speed
    n = int(np.clip(wanted, MIN_DIRECTIONS, MAX_DIRECTIONS))
    path = p @ _directions(array.dim, n).T / speed
    phase = np.multiply.outer(2 * np.pi * frequency, path)
    return np.exp(1j * phase).astype(np.complex64)


def _directions(dim: int, n: int) -> Float:
    if dim == 1:
        return np.linspace(-1, 1, n)[:, None]
    if dim == 2:
        azimuth = 2 * np.pi * np.arange(n) / n
        circle = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
        return np.concatenate([cosine * circle for cosine in ELEVATIONS])
    return fibonacci_sphere(max(min(n * n, SPHERE), n * n // 4))


def beam_power(segments: PhaseSegments, responses: Complex) -> Float:
    """Return the weighted mean power of the beams of each segment, as a share of the largest.

    Parameters
    ----------
    segments : PhaseSegments
        Phase factors and weights.
    responses : ndarray, shape (n_bins, n_sensors, n_directions)
        As of `scan_responses`.

    Returns
    -------
    ndarray, shape (n_segments, n_directions)
        Sums over the bins, each up to its weight.

    Examples
    --------
    >>> segments = PhaseSegments(np.ones((1, 2, 4, 3)), np.ones((1, 2)), np.ones(2), 64)
    >>> beam_power(segments, np.ones((2, 3, 1)))
    array([[2.]])
    """
    n_segments, n_bins, n_windows, n_channels = segments.phasors.shape
    power = np.zeros((n_segments, responses.shape[2]))
    size = n_windows * responses.shape[2] * n_bins
    block = max(1, MAX_BLOCK // size)
    for first in range(0, n_segments, block):
        part = segments.phasors[first : first + block]
        y = np.moveaxis(part, 1, 0).reshape(n_bins, -1, n_channels)
        beam = y @ responses.conj()  # (n_bins, n_segments n_windows, n_directions)
        square = (beam.real**2 + beam.imag**2).reshape(n_bins, len(part), n_windows, -1)
        weight = segments.weight[first : first + block].astype(np.float32)
        power[first : first + block] = np.einsum("tf,ftnd->td", weight, square, optimize=True)
    return np.asarray(power / (n_windows * n_channels**2))


def bin_power(segments: PhaseSegments, responses: Complex, direction: Int) -> Float:
    """Return the weighted mean power of one beam of each segment, as in `beam_power`, by bin.

    Parameters
    ----------
    segments, responses
        As in `beam_power`.
    direction : ndarray of int, shape (n_segments,)
        Index of each segment's direction.

    Returns
    -------
    ndarray, shape (n_segments, n_bins)

    Examples
    --------
    >>> segments = PhaseSegments(np.ones((1, 2, 4, 3)), np.ones((1, 2)), np.ones(2), 64)
    >>> bin_power(segments, np.ones((2, 3, 1)), np.zeros(1, int))
    array([[1., 1.]])
    """
    a = np.moveaxis(responses[:, :, direction], 2, 0).conj()
    beam = np.einsum("tfnm,tfm->tfn", segments.phasors, a, optimize=True) / segments.n_channels
    return np.asarray(segments.weight * (np.abs(beam) ** 2).mean(axis=2))


def agreement(
    segments: PhaseSegments,
    responses: Complex,
    direction: Int,
    delays: Float,
    recorded: Complex | None = None,
) -> Complex:
    """Return the agreement of each channel with the beam of the others, by assumed delay.

    With the phases c = u conj(a) of a channel steered to the direction, and the mean b of those of
    the other channels, it is Σ w c conj(b) exp(j 2π f τ) / Σ w |b|: 1 for equal signals, 0 for
    independent ones, -1 for opposite signs.

    Parameters
    ----------
    segments : PhaseSegments
        Phase factors and weights.
    responses : ndarray, shape (n_bins, n_sensors, n_directions)
        As of `scan_responses`.
    direction : ndarray of int, shape (n_segments,)
        Index of each segment's direction.
    delays : ndarray, shape (n_delays,)
        Assumed delays τ of the channel, s.
    recorded : ndarray, optional
        Phase factors u of the channels, if those of the segments, which make the beams, are
        corrected.

    Returns
    -------
    ndarray, shape (n_delays, n_channels)

    Examples
    --------
    >>> u = np.ones((1, 2, 4, 3))
    >>> u[..., 2] = -1
    >>> segments = PhaseSegments(u, np.ones((1, 2)), np.ones(2), 64)
    >>> agreement(segments, np.ones((2, 3, 1)), np.zeros(1, int), np.zeros(1)).real
    array([[nan, nan, -1.]])
    """
    a = np.moveaxis(responses[:, :, direction], 2, 0)[:, :, None]  # (t, f, 1, m)
    c = segments.phasors * a.conj()
    others = (c.sum(axis=-1, keepdims=True) - c) / max(1, segments.n_channels - 1)
    weight = segments.weight[:, :, None, None]
    c = c if recorded is None else recorded * a.conj()
    products = (weight * c * others.conj()).sum(axis=(0, 2))  # (f, m)
    size = (weight * np.abs(others)).sum(axis=(0, 1, 2))
    turn = np.exp(2j * np.pi * np.multiply.outer(delays, segments.frequency))
    with np.errstate(invalid="ignore"):
        return np.asarray(turn @ products / np.where(size > 0, size, np.nan))
