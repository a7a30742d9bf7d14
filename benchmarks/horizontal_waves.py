"""Azimuth of horizontal waves as a point: one unknown without a Fourier series."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.local import LocalManifold
from arrivals.measurement_models.manifolds.manifold import UNIFORM_STD_OF_CIRCLE, CandidatePoints
from arrivals.measurement_models.manifolds.points import (
    SPACING_OF_ONE,
    cell_count,
)
from arrivals.typing import Bool, Complex, Float

HALVES = np.array([0.5, 1.0, 0.5])[:, None, None]  # of the elements 11, 12, 22 in ½ Σ Sᵢⱼ


@dataclass(frozen=True, eq=False)
class HorizontalWaves(LocalManifold):
    """The azimuth of horizontal waves, of sensors in a plane or in space.

    The response is that of `FourierManifold`, of isotropic elements, without its series.

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> circle = horizontal_waves(PlaneWaves(SensorArray.uca(8, 0.65), (1.0,)))
    >>> circle.located(circle.from_doa([4.0]), np.zeros((1, 1)))["doa"].round(4)
    array([-2.2832])
    """

    @cached_property
    def levelled(self) -> Float:
        """Horizontal positions from the centroid, m: (M, 2)."""
        p = self.waves.array.positions[:, :2]
        return np.asarray(p - p.mean(axis=0))

    def from_doa(self, doa: ArrayLike) -> Float:
        """Return the points (1, n) of azimuths (n,), rad."""
        return np.asarray(doa, dtype=np.float64)[None] / self.scale

    def direction(self, x: Float) -> Float:
        """Return unit vectors to points (..., 1, L): (..., 3, L)."""
        azimuth = x[..., 0, :] * self.unit[0]
        return np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-2)

    def expansion(self, x: Float) -> tuple[Complex, Complex, Complex]:
        """Return the response and its derivatives along the azimuth."""
        n = self.direction(x)[..., :2, :]
        turned = np.stack([n, np.stack([-n[..., 1, :], n[..., 0, :]], axis=-2)], axis=-3)
        u, paths = self.unit[0], turned.swapaxes(-1, -2) @ self.levelled.T  # (..., 2, L, M)
        phases: Complex = np.asarray(1j * self.wavenumber[..., None] * paths[..., None, :, :, :])
        phase, slope = phases[..., :1, :, :], phases[..., 1:, :, :]
        return np.exp(phase[..., 0, :, :]), u * slope, -u * u * phase

    def damping_slope(self, Z: Complex, S: Float) -> Complex | float:
        """Return ½ S ∂H = -½ S unit² Z."""
        return np.asarray(-0.5 * self.unit[0] ** 2 * S * Z)

    def wrap(self, azimuth: Float) -> Float:
        """Return azimuths in [-π, π)."""
        return (azimuth + np.pi) % (2 * np.pi) - np.pi

    def offset(self, x: Float, mean: Float) -> tuple[Float, Float | None]:
        """Return the differences the shorter way round, and None for an identity."""
        return self.wrap((x - mean) * self.unit[0]) / self.unit[0], None

    def walk(self, x: Float, variance: float, curvature_variance: float = 0.0) -> Float:
        """Return the covariance of a step of some variance, rad²: (..., 1, L)."""
        return np.full(x.shape, variance / self.unit[0] ** 2)

    def new_candidates(self) -> CandidatePoints:
        """Return an even grid of the circle."""
        (n,) = cell_count(2 * np.pi / self.unit[0] / SPACING_OF_ONE)
        grid = (-np.pi + 2 * np.pi * np.arange(n) / n) / self.unit[0]
        log_measure = float(np.log(2 * np.pi / self.unit[0]))
        return CandidatePoints(grid[None], log_measure, np.zeros(1))

    def distance(self, x: Float, others: Float) -> Float:
        """Return angles, rad, between (..., 1, L) and (1, G): (..., L, G)."""
        apart = (x[..., 0, :, None] - others[..., 0, None, :]) * self.unit[0]
        return np.abs(self.wrap(apart))

    def exists(self, x: Float, covariance: Float) -> Bool:
        """Return True: every point is a direction."""
        return np.ones(x.shape[-1], dtype=np.bool_)

    def located(self, x: Float, covariance: Float) -> dict[str, Float]:
        """Return doa and std of points (1, L)."""
        std = np.minimum(self.unit[0] * np.sqrt(covariance[0]), UNIFORM_STD_OF_CIRCLE)
        return {"doa": self.wrap(x[0] * self.unit[0]), "std": std}


@lru_cache(maxsize=256)
def horizontal_waves(waves: PlaneWaves) -> HorizontalWaves:
    """Return the manifold of the azimuth of horizontal waves, without an element response."""
    p = waves.array.positions[:, :2] - waves.centre[:2]
    unit = ((waves.wavenumber**2).mean() * (p**2).sum(axis=1).mean() / 2) ** -0.5
    return HorizontalWaves(waves, (float(unit),), tuple(waves.centre.tolist()))
