"""Any array's response as a short Fourier series of its direction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.manifold import (
    UNIFORM_STD_OF_CIRCLE,
    UNIFORM_STD_OF_LINE,
    Reference,
)
from arrivals.typing import Complex, Float, Int

MOST_POINTS = 1 << 20
NEGLIGIBLE = 1e-9  # of the largest harmonic


def fourier_series(function: Callable[[Float], Complex], n_points: int) -> Complex:
    """Return the coefficients, k = -K..K, of functions on the circle: (..., n) -> (..., 2K + 1).

    Harmonics below 1e-9 of the largest are dropped at both ends.

    Parameters
    ----------
    function : callable
        Takes angles (n,), gives values (..., n).
    n_points : int
        Number of angles at which it is sampled: more than twice the highest harmonic.

    References
    ----------
    Doron and Doron, "Wavefield modeling and array processing", IEEE TSP 42(10), 1994: the
    manifold separation.

    Examples
    --------
    >>> fourier_series(lambda theta: 2 + np.exp(-1j * theta), 16).round(6) + 0
    array([1.+0.j, 2.+0.j, 0.+0.j])
    """
    if n_points > MOST_POINTS:
        wanted = f"at most {MOST_POINTS // 8} wavelengths apart"
        raise ValueError(f"positions must be {wanted}; got a response of {n_points} points")
    theta = 2 * np.pi * np.arange(n_points) / n_points
    series = np.fft.fftshift(np.fft.fft(function(theta), axis=-1), axes=-1) / n_points
    size = np.abs(series).reshape(-1, n_points).max(axis=0)
    k = np.arange(n_points) - n_points // 2
    degree = int(np.abs(k[size > NEGLIGIBLE * size.max()]).max(initial=0))
    return np.ascontiguousarray(series[..., np.abs(k) <= degree])


@dataclass(frozen=True, eq=False)
class FourierManifold:
    """A response a(θ) = G d(θ), d_k = exp(jkθ), k = -K..K, in the direction itself.

    θ is the azimuth, or, of a line, the direction from broadside continued to the whole circle,
    where β and π - β have one response (`front_back_ambiguous`).
    Phases are counted at the centroid of the sensors, or at the first of them.

    Parameters
    ----------
    waves : PlaneWaves
    reference : {"middle", "first"}
    coefficients : ndarray, shape (n_nuisance, n_bins, n_sensors, 2K + 1)
    norm : ndarray, shape (n_nuisance, n_bins, D + 1), or None
        One-sided coefficients of ‖a(θ)‖² = Re Σ cᵢ exp(jiθ); None of isotropic elements: M.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> manifold = fourier_manifold(PlaneWaves(SensorArray.uca(8, 0.65), [1.0]))
    >>> int(manifold.harmonics.max()), manifold.norm_squared()
    (16, 8.0)
    """

    waves: PlaneWaves
    reference: Reference
    coefficients: Complex
    norm: Complex | None

    @property
    def n_sensors(self) -> int:
        """Number of sensors."""
        return self.waves.array.n_sensors

    @property
    def n_unknowns(self) -> int:
        """One: the direction."""
        return 1

    @property
    def n_bins(self) -> int:
        """Number of frequency bins."""
        return len(self.waves.wavelengths)

    @property
    def harmonics(self) -> Int:
        """The integers k = -K..K."""
        degree = self.coefficients.shape[-1] // 2
        return np.arange(-degree, degree + 1)

    @property
    def front_back_ambiguous(self) -> bool:
        """True if two angles stand for one direction: on a line."""
        return self.waves.is_line

    @property
    def nuisance_weights(self) -> Float:
        """Prior of the values of the second parameter: uniform."""
        n = self.waves.n_nuisance
        return np.full(n, 1 / n)

    def steering(self, theta: ArrayLike) -> Complex:
        """Return the responses to angles (n,): (n_nuisance, n_bins, n_sensors, n)."""
        d = np.exp(1j * np.multiply.outer(self.harmonics, np.asarray(theta, dtype=np.float64)))
        return np.asarray(self.coefficients @ d)

    def norm_squared(self) -> float | Complex:
        """Return ‖a(θ)‖², or its Fourier coefficients where it changes with the angle."""
        return float(self.n_sensors) if self.norm is None else self.norm

    def to_doa(self, theta: ArrayLike, slack: ArrayLike = 0.0) -> Float:
        """Return directions, rad; of a line, those in front. Every angle has one."""
        doa = (np.asarray(theta, dtype=np.float64) + np.pi) % (2 * np.pi) - np.pi
        if not self.front_back_ambiguous:
            return np.asarray(doa)
        return np.where(np.abs(doa) > np.pi / 2, np.copysign(np.pi, doa) - doa, doa)

    def doa_std(self, theta: ArrayLike, std: ArrayLike) -> Float:
        """Return the standard deviations, at most that of a uniform direction."""
        limit = UNIFORM_STD_OF_LINE if self.front_back_ambiguous else UNIFORM_STD_OF_CIRCLE
        return np.minimum(np.asarray(std, dtype=np.float64), limit)

    def slope(self, theta: ArrayLike) -> Float:
        """Return 1: the angle is the direction."""
        return np.ones(np.shape(theta))

    def from_doa(self, doa: ArrayLike) -> Float:
        """Return the angles of directions: the same."""
        return np.array(doa, dtype=np.float64)

    def to_amplitude(self, w: ArrayLike, theta: ArrayLike) -> Complex:
        """Return amplitudes at the origin of coordinates; of several snapshots their size alone.

        An unknown slowness or elevation leaves the phase at the origin unknown, too.
        """
        w = np.asarray(w, dtype=np.complex128)
        if self.n_bins > 1 or self.waves.n_nuisance > 1:
            return np.asarray(np.abs(w) + 0j)
        path = self.waves.directions(np.asarray(theta))[0] @ _origin(self.waves, self.reference)
        return np.asarray(w * np.exp(-1j * self.waves.wavenumber[0] * path))

    def without(self, sensors: Sequence[int] | Int) -> FourierManifold:
        """Return the manifold of the array without some sensors."""
        return fourier_manifold(self.waves.without(sensors), self.reference)

    def only(self, bins: Sequence[int] | Int) -> FourierManifold:
        """Return the manifold of some of the bins."""
        return fourier_manifold(self.waves.only(bins), self.reference)


def _origin(waves: PlaneWaves, reference: Reference) -> Float:
    return waves.centre if reference == "middle" else waves.array.positions[0]


@lru_cache(maxsize=64)  # of several megabytes each, where the array is large
def fourier_manifold(waves: PlaneWaves, reference: Reference = "middle") -> FourierManifold:
    """Return the manifold of any array: by one FFT, cached.

    Parameters
    ----------
    waves : PlaneWaves
    reference : {"middle", "first"}
        Where phases are counted: at the centroid, where the amplitude's phase and the angle are
        uncorrelated a posteriori, or at the first sensor.
    """
    origin = _origin(waves, reference)
    radius = np.linalg.norm(waves.array.positions - origin, axis=1).max()
    phase = waves.wavenumber.max() * radius * max(waves.slowness or (1.0,))
    n_gains = 0 if waves.response is None else waves.response.gains.shape[-2]
    n_points = max(512, 1 << int(np.ceil(np.log2(8 * (phase + 20) + 2 * n_gains))))
    G = fourier_series(lambda theta: waves.steering(theta, origin), n_points)
    return FourierManifold(waves, reference, G, _norm_series(waves, n_points))


def _norm_series(waves: PlaneWaves, n_points: int) -> Complex | None:
    """Return the one-sided coefficients of ‖a(θ)‖², or None of isotropic elements."""
    if waves.response is None:
        return None

    def norm_squared(theta: Float) -> Complex:
        return np.asarray((np.abs(waves.steering(theta)) ** 2).sum(axis=2) + 0j)

    series = fourier_series(norm_squared, n_points)
    K = series.shape[-1] // 2
    one_sided = series[..., K:].copy()
    one_sided[..., 1:] *= 2
    return np.asarray(one_sided)
