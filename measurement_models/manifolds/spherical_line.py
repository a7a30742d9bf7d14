"""Spherical waves on a line of sensors, exact, in sin β and 1/R."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.line_phase import line_units
from arrivals.measurement_models.manifolds.local import LocalManifold
from arrivals.measurement_models.manifolds.located import range_estimate
from arrivals.measurement_models.manifolds.manifold import CandidatePoints
from arrivals.measurement_models.manifolds.points import (
    SPACING_OF_ONE,
    WALK_SHARE,
    cell_centres,
    cell_count,
    cosine_squared,
    sine_exists,
    sine_limits,
)
from arrivals.typing import Bool, Complex, Float

MIN_SQUARE = 1e-6  # of the distance of a sensor over R
LIMITS = -0.2, 1.5  # of 1/R over the largest expected


@dataclass(frozen=True, eq=False)
class SphericalLine(LocalManifold):
    """A line of sensors and sources at any distance: a = R/r exp(jk(R - r)), ‖a‖² = M.

    R is the distance of the source from the centre, r from a sensor. The prior of 1/R is
    N(0, (½ max)²); candidates lie on a grid of sin β and of 1/R up to its largest.

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`; the unit of 1/R is that of the curvature.
    max_inverse : float
        Largest 1/R expected, 1/m.

    Notes
    -----
    A range is infinite where 1/R is within three standard deviations of zero.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> line = spherical_line(PlaneWaves(SensorArray.ula(16, 0.08), (0.17,)), max_inverse=2.0)
    >>> x = line.from_doa([0.35], [0.5])
    >>> float(line.located(x, 1e-4 * np.ones((3, 1)))["range"][0].round(6))
    0.5
    """

    max_inverse: float

    merge_correlation: ClassVar[float | None] = 0.95

    def from_doa(self, doa: ArrayLike, distance: ArrayLike = np.inf) -> Float:
        """Return the points (2, n) of directions and distances (n,), rad and m."""
        return np.stack(np.broadcast_arrays(np.sin(doa), 1 / np.asarray(distance))) / self.scale

    def direction(self, x: Float) -> Float:
        """Return sin β within ±1: (..., 1, L)."""
        return sine_limits(x[..., :1, :] * self.unit[0])

    def inverse_range(self, x: Float) -> Float:
        """Return 1/R within the limits: (..., L)."""
        low, high = (share * self.max_inverse for share in LIMITS)
        return np.minimum(np.maximum(x[..., 1, :] * self.unit[1], low), high)

    def move(self, x: Float, step: Float) -> Float:
        """Return the points after displacements, sin β within ±1."""
        moved = x + step  # beyond ±1 the response is constant, and nothing would stop a point
        moved[..., 0, :] = self.direction(moved)[..., 0, :] / self.unit[0]
        return moved

    def relative_distance(self, x: Float) -> tuple[Float, Float, Float]:
        """Return u = sin β and v = 1/R (..., L, 1), and t = r/R of the sensors (..., L, M)."""
        u, v = self.direction(x)[..., 0, :, None], self.inverse_range(x)[..., None]
        p = self.positions[:, 0]
        # t = √(1 - 2puv + p²v²)
        return u, v, np.sqrt(np.maximum(1 - 2 * p * u * v + (p * v) ** 2, MIN_SQUARE))

    def expansion(self, x: Float) -> tuple[Complex, Complex, Complex]:
        """Return the response and its derivatives along sin β and 1/R."""
        u, v, t = self.relative_distance(x)
        p = self.positions[:, 0]
        # derivatives of t along u and v
        tu, tv = -p * v / t, (p * p * v - p * u) / t
        tuu, tuv, tvv = -tu * tu / t, -(p + tu * tv) / t, (p * p - tv * tv) / t
        # f = R - r = (2pu - p²v) / (1 + t)
        f = (2 * p * u - p * p * v) / (1 + t)
        fu, fv = p / t, -(p * p + f * tv) / (1 + t)
        fvv = -(2 * fv * tv + f * tvv) / (1 + t)
        phases = np.stack([f, fu, fv, -fu * tu / t, -fu * tv / t, fvv], axis=-3)
        phases -= phases.mean(axis=-1, keepdims=True)
        # l = ln R/r
        slopes = np.stack([-tu / t, -tv / t], axis=-3)
        bends = np.stack([tu * tu - t * tuu, tu * tv - t * tuv, tv * tv - t * tvv], axis=-3)
        bends /= (t * t)[..., None, :, :]
        gains = np.concatenate(normalized(-np.log(t), slopes, bends), axis=-3)
        turns = 1j * self.wavenumber[..., None] * phases[..., None, :, :, :]
        rows: Complex = np.asarray(self.powers * (gains[..., None, :, :, :] + turns))
        return np.exp(rows[..., 0, :, :]), rows[..., 1:3, :, :], rows[..., 3:, :, :]

    @cached_property
    def powers(self) -> Float:
        """Units of a response and its derivatives, (6, 1, 1)."""
        one, two = self.unit
        return np.array([1.0, one, two, one * one, one * two, two * two])[:, None, None]

    def size(self, x: Float) -> Float:
        """Return the root mean square of R/r over the sensors: (L,)."""
        t = self.relative_distance(x)[2]
        return np.asarray(np.sqrt((1 / t**2).mean(axis=-1)))

    def origin_phase(self, x: Float) -> Float:
        """Return the phase that is left out of a response, rad: (L,), at the first bin."""
        u, v, p = (
            self.direction(x)[0, :, None],
            self.inverse_range(x)[:, None],
            self.positions[:, 0],
        )
        t = np.sqrt(np.maximum(1 - 2 * p * u * v + (p * v) ** 2, MIN_SQUARE))
        f = ((2 * p * u - p * p * v) / (1 + t)).mean(axis=1)
        return np.asarray(self.waves.wavenumber[0] * (f + self.centre[0] * u[:, 0]))

    @property
    def walk_range(self) -> float:
        """Default standard deviation of the step of 1/R per unit of time, 1/m."""
        return WALK_SHARE * self.max_inverse

    def walk(self, x: Float, variance: float, curvature_variance: float = 0.0) -> Float:
        """Return the covariance of a step of some variance, rad², and of 1/R: (..., 3, L)."""
        along = variance * cosine_squared(self.direction(x)) / self.unit[0] ** 2
        return np.concatenate(
            [along, 0 * along, 0 * along + curvature_variance / self.unit[1] ** 2], axis=-2
        )

    def new_candidates(self) -> CandidatePoints:
        """Return a grid of sin β and 1/R, about one unit apart in 1/R."""
        reach = self.max_inverse / self.unit[1]
        n, n_ranges = cell_count(2 / (SPACING_OF_ONE * self.unit[0]), 1 + reach)
        grids = np.meshgrid(cell_centres(n), np.linspace(0, self.max_inverse, n_ranges))
        points = np.stack([each.T.ravel() for each in grids]) / self.scale
        precision = (2 * self.unit[1] / self.max_inverse) ** 2
        log_measure = np.log(2 / self.unit[0]) + 0.5 * np.log(2 * np.pi / precision)
        prior = np.array([0.0, 0.0, precision])
        return CandidatePoints(points, float(log_measure), prior, np.zeros(2))

    def distance(self, x: Float, others: Float) -> Float:
        """Return differences of direction, rad, of (..., 2, L) and (2, G): (..., L, G)."""
        doa, other = (np.arcsin(self.direction(each)[..., 0, :]) for each in (x, others))
        return np.asarray(np.abs(doa[..., None] - other[..., None, :]))

    def exists(self, x: Float, covariance: Float) -> Bool:
        """Return which points (2, L) are within three standard deviations of a direction."""
        return sine_exists(x[0] * self.unit[0], self.unit[0] * np.sqrt(covariance[0]))

    def located(self, x: Float, covariance: Float) -> dict[str, Float]:
        """Return doa, std, range, range_std and covariance of points (2, L)."""
        inverse_range = x[1] * self.unit[1]
        rates = np.zeros_like(inverse_range), np.full(inverse_range.shape, self.unit[1])
        return range_estimate(self.direction(x)[0], self.unit[0], inverse_range, rates, covariance)


def normalized(level: Float, slopes: Float, bends: Float) -> tuple[Float, Float, Float]:
    """Return log gains, their 2 first and 3 second derivatives, for a mean square of 1.

    ln g = l - ½ ln mean exp(2l), over the last axis.

    Parameters
    ----------
    level : ndarray, shape (..., L, M)
        l.
    slopes : ndarray, shape (..., 2, L, M)
        First derivatives of l.
    bends : ndarray, shape (..., 3, L, M)
        Second derivatives 11, 12, 22.

    Returns
    -------
    gain : ndarray, shape (..., 1, L, M)
    first : ndarray, shape (..., 2, L, M)
    second : ndarray, shape (..., 3, L, M)
    """
    gain = level[..., None, :, :]
    weight = np.exp(2 * gain)
    total = weight.sum(axis=-1, keepdims=True)
    weight /= total
    first = slopes - (weight * slopes).sum(axis=-1, keepdims=True)
    # ∂∂ ½ ln Σ exp 2l = ⟨l_ij⟩ + 2 (⟨l_i l_j⟩ - ⟨l_i⟩⟨l_j⟩)
    products = first[..., [0, 0, 1], :, :] * first[..., [0, 1, 1], :, :]
    second = bends - (weight * (bends + 2 * products)).sum(axis=-1, keepdims=True)
    return gain - 0.5 * np.log(total / gain.shape[-1]), first, second


@lru_cache(maxsize=256)
def spherical_line(waves: PlaneWaves, max_inverse: float) -> SphericalLine:
    """Return the manifold of spherical waves on a line.

    Parameters
    ----------
    waves : PlaneWaves
        A line of isotropic sensors.
    max_inverse : float
        Largest 1/R, 1/m: the inverse of the distance of the nearest source.
    """
    return SphericalLine(waves, line_units(waves), tuple(waves.centre.tolist()), max_inverse)
