"""Directions on the sphere of an array in space, each with axes of its tangent plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere, unit_vectors
from arrivals.measurement_models.manifolds.local import LocalManifold
from arrivals.measurement_models.manifolds.located import tangent_estimate
from arrivals.measurement_models.manifolds.manifold import CandidatePoints
from arrivals.measurement_models.manifolds.points import (
    SAME_SOURCE,
    SPACING_OF_TWO,
    cell_count,
    sine_limits,
)
from arrivals.typing import Bool, Complex, Float

FEWEST_CANDIDATES = 100
IDENTITY = np.array([1.0, 0.0, 1.0])[:, None, None]  # elements 11, 12, 22


@dataclass(frozen=True, eq=False)
class TangentPlanes(LocalManifold):
    """Sensors in space: a direction n with orthonormal tangents e₁ and e₂, the unknowns.

    A point has the nine numbers of the rotation matrix with rows e₁, e₂, n. A move goes along a
    great circle and carries the tangents in parallel, so that covariances need no turning.

    Parameters
    ----------
    waves : PlaneWaves
    unit : tuple of float
    centre : tuple of float
        As in `PointResponse`; both units are equal.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sensor_array import SensorArray
    >>> manifold = tangent_planes(PlaneWaves(SensorArray(np.eye(3)), (2.0,)))
    >>> x = manifold.from_doa([0.5], [0.2])
    >>> fields = manifold.located(manifold.move(x, np.zeros((2, 1))), np.zeros((3, 1)))
    >>> fields["doa"].round(6), fields["elevation"].round(6)
    (array([0.5]), array([0.2]))
    """

    merge_correlation: ClassVar[float | None] = SAME_SOURCE

    @property
    def point_size(self) -> int:
        """Nine: a rotation matrix."""
        return 9

    @cached_property
    def centred(self) -> Float:
        """Positions from the centroid, m: (M, 3)."""
        return self.waves.array.positions - self.waves.centre

    def from_doa(self, doa: ArrayLike, elevation: ArrayLike = 0.0) -> Float:
        """Return the points (9, n) of azimuths and elevations (n,), rad."""
        return with_tangents(unit_vectors(doa, elevation).T)

    def direction(self, x: Float) -> Float:
        """Return unit vectors to points (..., 9, L): (..., 3, L)."""
        return x[..., 6:, :]

    def expansion(self, x: Float) -> tuple[Complex, Complex, Complex]:
        """Return the response and its derivatives along the tangents."""
        rows = x.reshape(*x.shape[:-2], 3, 3, x.shape[-1])
        paths = rows.swapaxes(-1, -2) @ self.centred.T  # (..., 3, L, M): of e₁, e₂ and n
        phases: Complex = np.asarray(1j * self.wavenumber[..., None] * paths[..., None, :, :, :])
        tangents, phase = phases[..., :2, :, :], phases[..., 2:, :, :]
        # Z = jk u Eᵀp,  H = -jk u² (n·p) I
        u = self.unit[0]
        return np.exp(phase[..., 0, :, :]), u * tangents, -u * u * IDENTITY * phase

    def damping_slope(self, Z: Complex, S: Float) -> Complex | float:
        """Return ½ Σ Sᵢⱼ ∂Hᵢⱼ = -½ u² tr(S) Z."""
        trace = S[..., :1, :, :] + S[..., 2:, :, :]
        return np.asarray(-0.5 * self.unit[0] ** 2 * trace * Z)

    def move(self, x: Float, step: Float) -> Float:
        """Return the points after displacements (..., 2, L) along great circles."""
        rows = x.reshape(*x.shape[:-2], 3, 3, x.shape[-1])
        t = step * self.unit[0]
        angle = np.hypot(t[..., 0, :], t[..., 1, :])[..., None, :]
        ahead = np.array([[1.0], [0.0]])
        e = np.where(angle > 1e-15, t / np.maximum(angle, 1e-15), ahead)[..., None, :]
        n, c, s = rows[..., 2, :, :], np.cos(angle), np.sin(angle)
        along = (e * rows[..., :2, :, :]).sum(axis=-3)
        turn = (c - 1) * along - s * n  # of the tangent along the circle
        tangents = rows[..., :2, :, :] + e * turn[..., None, :, :]
        moved = np.concatenate([tangents, (c * n + s * along)[..., None, :, :]], axis=-3)
        return moved.reshape(x.shape)

    def offset(self, x: Float, mean: Float) -> tuple[Float, Float | None]:
        """Return δ = E n/u on the tangents at `mean`, and its derivatives Eᵢ·eⱼ.

        In the half of directions behind, |δ| goes on growing, from 1/u to 2/u.
        """
        shape = np.broadcast_shapes(x.shape, mean.shape)
        rows = x.reshape(*x.shape[:-2], 3, 3, x.shape[-1])
        axes = mean.reshape(*mean.shape[:-2], 3, 3, mean.shape[-1])
        products = np.einsum("...iml,...jml->...ijl", axes, rows)
        products = products.reshape(*shape[:-2], 3, 3, shape[-1])
        delta, slope = products[..., :2, 2, :], products[..., :2, :2, :]
        behind = products[..., 2, 2, :] < 0
        if behind.any():
            delta, slope = reflected(delta, slope, behind)
        return delta / self.unit[0], slope

    def walk(self, x: Float, variance: float, curvature_variance: float = 0.0) -> Float:
        """Return the covariance (..., 3, L) of a step of some variance, rad², on a great circle."""
        one = np.full((*x.shape[:-2], x.shape[-1]), variance / self.unit[0] ** 2)
        return np.stack([one, np.zeros_like(one), one], axis=-2)

    def new_candidates(self) -> CandidatePoints:
        """Return a Fibonacci grid, of uniform density."""
        (n,) = cell_count(4 * np.pi / (SPACING_OF_TWO * self.unit[0]) ** 2)
        points = with_tangents(fibonacci_sphere(max(n, FEWEST_CANDIDATES)).T)
        log_measure = float(np.log(4 * np.pi) - 2 * np.log(self.unit[0]))
        return CandidatePoints(points, log_measure, np.zeros(3))

    def distance(self, x: Float, others: Float) -> Float:
        """Return angles, rad, between (..., 9, L) and (9, G): (..., L, G)."""
        cosine = self.direction(x).swapaxes(-1, -2) @ self.direction(others)
        return np.asarray(np.arccos(sine_limits(cosine)))

    def exists(self, x: Float, covariance: Float) -> Bool:
        """Return True: every point is a direction."""
        return np.ones(x.shape[-1], dtype=np.bool_)

    def located(self, x: Float, covariance: Float) -> dict[str, Float]:
        """Return doa (azimuth), std, elevation and covariance of points (9, L)."""
        axes = x[:6].reshape(2, 3, x.shape[-1])
        u = np.array(self.unit)[:, None, None] * np.eye(2)[..., None]
        return tangent_estimate(
            self.direction(x), axes, np.broadcast_to(u, (2, 2, x.shape[-1])), covariance
        )


def reflected(delta: Float, slope: Float, behind: Bool) -> tuple[Float, Float]:
    """Return offsets (..., 2, L) of length 2 - |δ| where directions are behind, and their slopes.

    Examples
    --------
    >>> delta, slope = np.array([[0.6], [0.0]]), np.eye(2)[..., None]
    >>> delta, slope = reflected(delta, slope, np.array([True]))
    >>> delta.ravel(), slope[..., 0].round(2)
    (array([1.4, 0. ]), array([[-1.  ,  0.  ],
           [ 0.  ,  2.33]]))
    """
    length = np.maximum(np.hypot(delta[..., 0, :], delta[..., 1, :]), 1e-9)[..., None, :]
    e = np.where(length > 1e-9, delta / length, [[1.0], [0.0]])
    share = 2 / length - 1
    along = (e[..., :, None, :] * slope).sum(axis=-3, keepdims=True)
    # ∂δ' = (2/s - 1) ∂δ - 2/s e eᵀ ∂δ
    turned = share[..., None, :] * slope - (share + 1)[..., None, :] * e[..., :, None, :] * along
    at = behind[..., None, :]
    return np.where(at, (2 - length) * e, delta), np.where(at[..., None, :], turned, slope)


@lru_cache(maxsize=256)
def tangent_planes(waves: PlaneWaves) -> TangentPlanes:
    """Return the manifold of an array in space.

    Parameters
    ----------
    waves : PlaneWaves
        Isotropic sensors, not all in a plane.
    """
    p = waves.array.positions - waves.centre
    square = (waves.wavenumber**2).mean() * (p**2).sum(axis=1).mean() / 3
    unit = float(square**-0.5)
    return TangentPlanes(waves, (unit, unit), tuple(waves.centre.tolist()))


def with_tangents(n: Float) -> Float:
    """Return points (9, L) of unit vectors (3, L): two tangents, then the vector.

    References
    ----------
    Duff et al., "Building an orthonormal basis, revisited", J. Computer Graphics Techniques 6(1),
    2017: without a square root, and continuous but at one pole.

    Examples
    --------
    >>> with_tangents(np.array([[0.0], [0.0], [1.0]])).reshape(3, 3) + 0
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    x, y, z = n
    s = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (s + z)
    b = x * y * a
    return np.stack([1 + s * x * x * a, s * b, -s * x, b, s + y * y * a, -y, x, y, z])
