"""Responses whose phases are linear in the unknowns: base, and planar arrays in (u, v)."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sphere import unit_vectors
from arrivals.measurement_models.manifolds.located import tangent_estimate
from arrivals.measurement_models.manifolds.manifold import CandidatePoints
from arrivals.measurement_models.manifolds.points import (
    MIN_COSINE,
    SAME_SOURCE,
    SPACING_OF_TWO,
    PointResponse,
    cell_centres,
    cell_count,
    lattice_images,
    sine_limits,
)
from arrivals.symmetric import PAIRS
from arrivals.typing import Bool, Complex, Float

RIM_MARGIN = 0.5  # of points beyond the rim by noise, rad rms of the phases over the array


@dataclass(frozen=True, eq=False)
class PhaseManifold(PointResponse):
    """A response a(x) = exp(j K x) of constant phase slopes K.

    The mean over N(x, S) is exact: exp(j K x - ½ KᵀS K).

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`.
    """

    is_linear: ClassVar[bool] = True

    @property
    @abstractmethod
    def path(self) -> Float:
        """Change of the path to each sensor with each unknown: (d, M)."""

    @cached_property
    def slopes(self) -> Float:
        """K in internal units, without its mean over the sensors: (F, d, M), rad."""
        path = self.scale * self.path
        return np.asarray(self.wavenumber * (path - path.mean(axis=1, keepdims=True)))

    @cached_property
    def exponents(self) -> Complex:
        """jK, then the damping -½ KᵢKⱼ of each element of S: (F, d + d(d+1)/2, M)."""
        K = self.slopes
        damping = [-(0.5 if i == j else 1.0) * K[:, i] * K[:, j] for i, j in PAIRS[K.shape[1]]]
        return np.concatenate([1j * K, np.stack(damping, axis=1)], axis=1)

    @cached_property
    def factors(self) -> Complex:
        """Factors 1, jKᵢ and -KᵢKⱼ of the mean response and its derivatives: (F, P, 1, M)."""
        K = self.slopes
        second = [-K[:, i] * K[:, j] + 0j for i, j in PAIRS[K.shape[1]]]
        one = np.ones_like(K[:, :1])
        return np.concatenate([one, 1j * K, np.stack(second, axis=1)], axis=1)[:, :, None]

    @cached_property
    def gram(self) -> Float:
        """Σₘ KᵢKⱼ: (F, d(d+1)/2, 1)."""
        K = self.slopes
        return np.stack([(K[:, i] * K[:, j]).sum(axis=-1) for i, j in PAIRS[K.shape[1]]], axis=1)[
            ..., None
        ]

    def responses(self, x: Float, covariance: Float) -> Complex:
        """Return the mean responses and their derivatives: (B, F, 1+d+d(d+1)/2, L, M)."""
        numbers = np.concatenate([x, covariance], axis=-2).swapaxes(-1, -2)  # (B, L, d + pairs)
        # ⟨a⟩ = exp(j K x - ½ KᵀS K)
        mean = np.exp(numbers[..., None, :, :] @ self.exponents)
        return np.asarray(mean[..., None, :, :] * self.factors)

    def at(self, x: Float) -> tuple[Complex, Float]:
        """Return a(x) (F, G, M) of points (d, G), and Σₘ KᵢKⱼ (F, d(d+1)/2, 1)."""
        return np.exp(1j * (x.T @ self.slopes)), self.gram


@dataclass(frozen=True, eq=False)
class DirectionCosines(PhaseManifold):
    """Sensors in a plane: cosines (u, v) of a direction with two axes of the plane.

    Directions are those of the half space into which the normal points; the others are their
    mirror images, of equal response.

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`.
    axes : tuple of tuple of float
        Orthonormal axes of the plane, then its normal: (3, 3).
    images : tuple of tuple of float
        Changes of (u, v) that leave the response of the whole array as it is: (2, n).

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> square = SensorArray([[0.0, 0.0], [0.0, 0.5], [0.5, 0.0], [0.5, 0.5]])
    >>> manifold = direction_cosines(PlaneWaves(square, (1.0,)))
    >>> x = manifold.from_doa([0.3], [0.4])
    >>> manifold.candidates().points.shape, manifold.located(x, np.zeros((3, 1)))["elevation"]
    ((2, 37), array([0.4]))
    """

    axes: tuple[tuple[float, ...], ...]
    images: tuple[tuple[float, ...], ...]

    merge_correlation: ClassVar[float | None] = SAME_SOURCE

    @cached_property
    def frame(self) -> Float:
        """The axes as a matrix, (3, 3)."""
        return np.array(self.axes)

    @property
    def path(self) -> Float:
        """Coordinates of the sensors along the axes: (2, M)."""
        p = self.positions
        return np.asarray(self.frame[:2, : p.shape[1]] @ p.T)

    def from_doa(self, doa: ArrayLike, elevation: ArrayLike = 0.0) -> Float:
        """Return the points (2, n) of azimuths and elevations (n,), rad."""
        return np.asarray(self.frame[:2] @ unit_vectors(doa, elevation).T / self.scale)

    @cached_property
    def shifts(self) -> Float:
        """The images as displacements, (2, n, 1)."""
        return np.array(self.images)[..., None] / self.scale[:, None]

    @cached_property
    def far_outside(self) -> float:
        """Square of u and v beyond which a direction on the horizon is unlikely."""
        return (1 + RIM_MARGIN * max(self.unit)) ** 2

    def move(self, x: Float, step: Float) -> Float:
        """Return the points after displacements; far beyond the rim their images, if any within."""
        moved = x + step
        outside = ((moved * self.scale) ** 2).sum(axis=-2) > self.far_outside
        if not (outside.any() and self.shifts.size):
            return moved
        images = moved[..., None, :] + self.shifts  # (..., 2, n, L)
        square = ((images * self.scale[:, None]) ** 2).sum(axis=-3)
        best = square.argmin(axis=-2)[..., None, :]
        image = np.take_along_axis(images, best[..., None, :, :], axis=-2)[..., 0, :]
        inside = np.take_along_axis(square, best, axis=-2)[..., 0, :] <= 1
        return np.where((outside & inside)[..., None, :], image, moved)

    def plane_cosines(self, x: Float) -> Float:
        """Return u, v and the cosine with the normal, (..., 3, L); points beyond the rim on it."""
        uv = x * self.scale
        square = (uv**2).sum(axis=-2, keepdims=True)
        uv = uv / np.sqrt(np.maximum(square, 1.0))
        return np.concatenate([uv, np.sqrt(np.maximum(1 - square, 0.0))], axis=-2)

    def direction(self, x: Float) -> Float:
        """Return unit vectors to points (..., 2, L): (..., 3, L)."""
        return np.asarray(self.frame.T @ self.plane_cosines(x))

    def rates(self, x: Float) -> tuple[Float, Float]:
        """Return the unit vector e (..., 2, L) away from the normal, and the cosine with it.

        A step along a great circle changes (u, v) by the cosine times its part away from the
        normal, along e, and by its part across. The cosine (..., L) is at least 0.1.
        """
        cosines = self.plane_cosines(x)
        u, v = cosines[..., 0, :], cosines[..., 1, :]
        radius = np.hypot(u, v)
        far = radius > 1e-12
        radius = np.where(far, radius, 1.0)
        e = np.stack([np.where(far, u / radius, 1.0), np.where(far, v / radius, 0.0)], axis=-2)
        return e, np.maximum(cosines[..., 2, :], MIN_COSINE)

    def walk(self, x: Float, variance: float, curvature_variance: float = 0.0) -> Float:
        """Return the covariance (..., 3, L) of a step of some variance, rad², on a great circle."""
        e, w = self.rates(x)
        e1, e2 = e[..., 0, :], e[..., 1, :]
        one, two = self.unit
        # Q = σ² J Jᵀ,  J = [w e, e⊥]:  J Jᵀ = I - (1 - w²) e eᵀ
        loss = 1 - w * w
        Q = [(1 - loss * e1 * e1) / one**2, -loss * e1 * e2 / (one * two)]
        return variance * np.stack([*Q, (1 - loss * e2 * e2) / two**2], axis=-2)

    def new_candidates(self) -> CandidatePoints:
        """Return a square grid on the disc of directions, of a uniform density in (u, v)."""
        counts = cell_count(*(2 / (SPACING_OF_TWO * unit) for unit in self.unit))
        grids = map(cell_centres, counts)
        uv = np.stack([each.ravel() for each in np.meshgrid(*grids, indexing="ij")])
        uv = uv[:, (uv**2).sum(axis=0) <= 1.0]
        log_measure = float(np.log(np.pi / np.prod(self.unit)))
        return CandidatePoints(uv / self.scale, log_measure, np.zeros(3))

    @cached_property
    def candidate_cosines(self) -> Float:
        """Cosines of the candidates, (3, G)."""
        return self.plane_cosines(self.candidates().points)

    def distance(self, x: Float, others: Float) -> Float:
        """Return angles, rad, between (..., 2, L) and (2, G): (..., L, G)."""
        is_grid = others is self.candidates().points
        known = self.candidate_cosines if is_grid else self.plane_cosines(others)
        cosine = self.plane_cosines(x).swapaxes(-1, -2) @ known
        return np.asarray(np.arccos(sine_limits(cosine)))

    def exists(self, x: Float, covariance: Float) -> Bool:
        """Return which points (2, L) are within three standard deviations of the disc."""
        e, _ = self.rates(x)
        one, two = self.scale * e  # the deviation along e, in (u, v)
        s11, s12, s22 = covariance
        std = np.sqrt(np.maximum(one * one * s11 + 2 * one * two * s12 + two * two * s22, 0.0))
        return np.asarray(np.hypot(*(x * self.scale)) <= 1 + 3 * std + 1e-9)

    def located(self, x: Float, covariance: Float) -> dict[str, Float]:
        """Return doa (azimuth), std, elevation and covariance of points (2, L)."""
        e, w = self.rates(x)
        cosines = self.plane_cosines(x)
        n, height = self.frame.T @ cosines, cosines[2]
        # t: unit tangents with (u, v) parts w e and e⊥
        outwards = self.frame[:2].T @ e
        across = self.frame[:2].T @ np.stack([-e[1], e[0]])
        away = height * outwards - np.sqrt(1 - height**2) * self.frame[2][:, None]
        inverse = np.stack([e / w, np.stack([-e[1], e[0]])]) * self.scale  # (2, 2, L): J⁻¹
        return tangent_estimate(n, np.stack([away, across]), inverse, covariance)


@lru_cache(maxsize=256)
def direction_cosines(waves: PlaneWaves) -> DirectionCosines:
    """Return the manifold of a planar array, in a plane of any orientation.

    The first axis is that of x in the plane, and the normal points upwards; where the plane is
    vertical, to growing y, and where it is that of y and z, to growing x.

    Parameters
    ----------
    waves : PlaneWaves
        Isotropic sensors in a plane, not in a line.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> wall = SensorArray([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5]])
    >>> direction_cosines(PlaneWaves(wall, (1.0,))).frame.round(3) + 0
    array([[ 1.,  0.,  0.],
           [ 0.,  0., -1.],
           [ 0.,  1.,  0.]])
    """
    frame = plane_axes(waves.array.positions - waves.centre)
    p = frame[:2, : waves.array.dim] @ (waves.array.positions - waves.centre).T
    square = (waves.wavenumber**2).mean() * (p**2).mean(axis=1)
    unit = tuple((1 / np.sqrt(square)).tolist())
    images = lattice_images(p, waves.wavelengths[0]) if len(waves.wavelengths) == 1 else p[:, :0]
    return DirectionCosines(
        waves,
        unit,
        tuple(waves.centre.tolist()),
        tuple(map(tuple, frame)),
        tuple(map(tuple, images)),
    )


def plane_axes(p: Float) -> Float:
    """Return two axes of the plane through centred positions (n, 2 or 3), and its normal: (3, 3).

    Examples
    --------
    >>> plane_axes(np.array([[1.0, 0.0], [-1.0, 1.0], [0.0, -1.0]]))
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    if p.shape[1] == 2:
        return np.eye(3)
    normal = np.linalg.svd(p)[2][2]
    normal[np.abs(normal) < 1e-9] = 0.0
    upwards = next(each for each in normal[::-1] if each)  # z, else y, else x
    normal = normal * np.sign(upwards) / np.linalg.norm(normal)
    start = np.eye(3)[0 if abs(normal[0]) < 0.99 else 1]
    first = start - (start @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal])
