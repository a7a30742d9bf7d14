"""Response of an array after the whitening of noise that is coherent between sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from arrivals.measurement_models.arrays.noise_coherence import NoiseCoherence
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.fourier import (
    NEGLIGIBLE,
    FourierManifold,
    fourier_manifold,
)
from arrivals.measurement_models.manifolds.manifold import Reference
from arrivals.typing import Complex, Int


@dataclass(frozen=True, eq=False)
class WhitenedManifold(FourierManifold):
    """A response L a(θ) = L G d(θ), L = chol(Γ)⁻¹, of snapshots L z in white noise.

    Parameters
    ----------
    waves : PlaneWaves
    reference : {"middle", "first"}
    coefficients : ndarray, shape (n_nuisance, n_bins, n_sensors, 2K + 1)
        L G.
    norm : ndarray, shape (n_nuisance, n_bins, D + 1)
        One-sided coefficients of ‖L a(θ)‖² = Re Σ cᵢ exp(jiθ).
    noise : NoiseCoherence
        Γ of the bins and sensors.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> circle = SensorArray.uca(5, 0.4)
    >>> manifold = ArraySnapshot(circle, wavelength=1.0, noise_coherence="diffuse").manifold()
    >>> manifold.without([1]) is manifold.without([1])
    True
    """

    noise: NoiseCoherence

    def without(self, sensors: Sequence[int] | Int) -> WhitenedManifold:
        """Return the manifold of the array without some sensors, cached."""
        return _without(self, tuple(map(int, sensors))) if len(sensors) else self

    def only(self, bins: Sequence[int] | Int) -> WhitenedManifold:
        """Return the manifold of some of the bins, cached."""
        return self if len(bins) == self.n_bins else _only(self, tuple(map(int, bins)))


@lru_cache(maxsize=64)
def _without(manifold: WhitenedManifold, sensors: tuple[int, ...]) -> WhitenedManifold:
    waves, noise = manifold.waves.without(sensors), manifold.noise.without(sensors)
    return whitened_manifold(waves, noise, manifold.reference)


@lru_cache(maxsize=64)
def _only(manifold: WhitenedManifold, bins: tuple[int, ...]) -> WhitenedManifold:
    waves, noise = manifold.waves.only(bins), manifold.noise.only(bins)
    return whitened_manifold(waves, noise, manifold.reference)


def whitened_manifold(
    waves: PlaneWaves, noise: NoiseCoherence, reference: Reference = "middle"
) -> WhitenedManifold:
    """Return the whitened manifold of any array.

    Parameters
    ----------
    waves : PlaneWaves
    noise : NoiseCoherence
        Of the array's sensors, at the bins of the waves.
    reference : {"middle", "first"}
        As in `fourier_manifold`.
    """
    G = fourier_manifold(waves, reference).coefficients
    L = noise.whitening(np.ones(G.shape[2], dtype=np.bool_))
    return WhitenedManifold(waves, reference, L @ G, norm_series(L @ G), noise)


def norm_series(G: Complex) -> Complex:
    """Return the one-sided coefficients of ‖G d(θ)‖² = Re Σ cᵢ exp(jiθ), i = 0..D.

    Coefficients below 1e-9 of the largest are dropped at the end.

    Parameters
    ----------
    G : ndarray, shape (..., n_sensors, 2K + 1)
        Coefficients of the harmonics k = -K..K.

    Returns
    -------
    ndarray of complex, shape (..., D + 1)

    Examples
    --------
    >>> norm_series(np.array([[0.0, 1.0, 0.5]])).round(6)  # |1 + exp(jθ) / 2|²
    array([1.25+0.j, 1.  +0.j])
    """
    n_points = 1 << int(np.ceil(np.log2(2 * G.shape[-1])))  # above twice the highest harmonic
    values = np.fft.fft(G, n_points, axis=-1)
    power = (values.real**2 + values.imag**2).sum(axis=-2)
    series = np.fft.ifft(power, axis=-1)[..., : G.shape[-1]]  # of angles that run backwards
    series[..., 1:] *= 2
    size = np.abs(series).reshape(-1, G.shape[-1]).max(axis=0)
    degree = int(np.flatnonzero(size > NEGLIGIBLE * size.max()).max())
    return np.ascontiguousarray(series[..., : degree + 1])
