"""Grid of densities on the sphere: distances, random walk, mean direction and covariance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from arrivals.measurement_models.arrays.sphere import azimuth_elevation
from arrivals.parameters import FrozenModel
from arrivals.trackers.beamforming.model_grid import n_sphere_directions, sphere_grid
from arrivals.trackers.beamforming.sphere_grid import SphereGrid
from arrivals.trackers.wideband.direction_grid import SMALLEST
from arrivals.trackers.wideband.sphere_waves import SphereWaves
from arrivals.typing import Complex, Float

MIN_DIRECTIONS = 20
MAX_NARROW = 0.3  # trace of a covariance, in squared steps, below which moments are rounded
UNIFORM_VARIANCE = 20.0  # rad² along each axis, after which every direction is as likely


@dataclass(frozen=True)
class SphereDensityGrid(FrozenModel):
    """Even directions on the sphere, or on the half above a plane.

    Parameters
    ----------
    step : float
        Mean distance of neighbours, rad.
    normal : tuple of float, or None
        Of the plane; None for the whole sphere.

    Examples
    --------
    >>> grid = SphereDensityGrid(np.deg2rad(4.0), (0.0, 0.0, 1.0))
    >>> len(grid.doa), grid.moved(np.eye(1289)[:1], 0.01).max().round(2)
    (1289, np.float64(0.1))
    """

    step: float
    normal: tuple[float, ...] | None

    @cached_property
    def scan(self) -> SphereGrid:
        """The directions and their neighbours."""
        n = n_sphere_directions(self.step, self.normal is not None)
        return sphere_grid(max(n, MIN_DIRECTIONS), self.normal)

    @property
    def doa(self) -> Float:
        """Azimuths, rad, (n_directions,)."""
        return self.scan.doa

    def responses(self, waves: SphereWaves) -> Complex:
        """Return the responses of an array to the directions, (1, n_bins, n_sensors, n)."""
        return waves.responses(self.scan.directions)

    @cached_property
    def distance(self) -> Float:
        """Distances of directions, rad, (n_directions, n_directions)."""
        u = self.scan.points
        return np.asarray(np.arccos(np.clip(u @ u.T, -1, 1)))

    @cached_property
    def _laplacian(self) -> Any:
        """Sparse rates at which neighbours exchange probability, for 1 rad² along each axis."""
        from scipy.sparse import coo_matrix, diags

        neighbours, n = self.scan.neighbours, len(self.doa)
        source = np.broadcast_to(np.arange(n), neighbours.shape).ravel()
        links = coo_matrix((np.ones(source.size), (source, neighbours.ravel())), shape=(n, n))
        links = (links + links.T).tocsr() / 2
        links = links - diags(links.diagonal())  # mirror images of themselves
        L = links - diags(np.asarray(links.sum(axis=1)).ravel())
        # mean squared distance that a unit of time adds along two axes: 2
        pairs = links.tocoo()
        square = pairs.data @ self.distance[pairs.row, pairs.col] ** 2 / n
        return (2 / square * L).tocsc()

    def moved(self, density: Float, variance: float) -> Float:
        """Return densities (..., n_directions) after a random walk, rad² along each axis.

        Neighbours exchange probability at a constant rate: two walks in a row equal one of the
        sum of their variances.
        """
        from scipy.sparse.linalg import expm_multiply

        if variance == 0 or density.size == 0:
            return density
        if variance > UNIFORM_VARIANCE:
            total = density.sum(axis=-1, keepdims=True)
            return np.broadcast_to(total / len(self.doa), density.shape).copy()
        rows = density.reshape(-1, len(self.doa))
        moved = np.maximum(expm_multiply(variance * self._laplacian, rows.T).T, 0.0)
        moved *= rows.sum(axis=1, keepdims=True) / np.maximum(
            moved.sum(axis=1, keepdims=True), SMALLEST
        )
        return np.asarray(moved).reshape(density.shape)

    def located(self, density: Float, half_width: float) -> tuple[Float, Float]:
        """Return directions (2, n), rad, and covariances (n, 2, 2) of densities about their peaks.

        They are those of the part within `half_width`, rad, in the tangent plane: elevation, then
        azimuth along its circle. Where a density is on few points, they are maximum and curvature
        of the quadratic function that fits its logarithm at the peak and around.
        """
        top = density.argmax(axis=-1)
        u, (azimuth, elevation) = self.scan.points[top], self.scan.directions[:, top]
        north = np.stack(
            [-np.sin(elevation) * np.cos(azimuth), -np.sin(elevation) * np.sin(azimuth),
             np.cos(elevation)], axis=-1,
        )  # fmt: skip
        frame = np.stack([north, np.cross(north, u)], axis=-1)  # (n, 3, 2)
        w = density * (self.distance[top] <= half_width + 1e-9)
        w = w / np.maximum(w.sum(axis=-1, keepdims=True), SMALLEST)
        x = self.scan.points @ frame  # (n, n_directions, 2)
        mean = (w[..., None] * x).sum(axis=1)
        x = x - mean[:, None]
        covariance = np.swapaxes(w[..., None] * x, 1, 2) @ x
        vertex, inverse = self._quadratic(np.log(np.maximum(density, SMALLEST)), top, frame)
        is_narrow = np.trace(covariance, axis1=1, axis2=2) < MAX_NARROW * self.step**2
        mean = np.where(is_narrow[:, None], vertex, mean)
        covariance = np.where(is_narrow[:, None, None], inverse, covariance)
        height = np.sqrt(np.maximum(1 - (mean**2).sum(axis=-1), 0.0))
        v = height[:, None] * u + (frame @ mean[..., None])[..., 0]
        if self.scan.normal is not None:
            v -= 2 * np.minimum(v @ self.scan.normal, 0.0)[:, None] * self.scan.normal
        return np.stack(azimuth_elevation(v)), covariance

    def _quadratic(self, level: Float, top: Any, frame: Float) -> tuple[Float, Float]:
        """Return maxima (n, 2) of quadratic fits about the peaks, and covariances (n, 2, 2)."""
        vectors = self.scan.ring[top]
        x, y = np.moveaxis(vectors @ frame, -1, 0) / self.step  # (n, 8)
        row = np.arange(len(top))
        rise = level[row[:, None], self.scan.neighbours[:, top].T] - level[row, top][:, None]
        terms = np.stack([x, y, x * x / 2, x * y, y * y / 2], axis=-1)
        gx, gy, xx, xy, yy = (np.linalg.pinv(terms) @ rise[..., None])[..., 0].T
        curvature = -np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1)
        values, axes = np.linalg.eigh(curvature)
        # of a peak at most a step away, no flatter than the step is wide
        inverse = (axes / np.maximum(values, 1.0)[:, None]) @ np.swapaxes(axes, 1, 2)
        shift = (inverse @ np.stack([gx, gy], -1)[..., None])[..., 0]
        length = np.linalg.norm(shift, axis=-1, keepdims=True)
        shift = shift / np.maximum(length, 1.0)
        return self.step * shift, self.step**2 * inverse
