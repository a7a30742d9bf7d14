"""Even grids of scan directions on the sphere, and the peaks of spectra there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sphere import azimuth_elevation
from arrivals.measurement_models.manifolds.phase import plane_axes
from arrivals.trackers.beamforming.scan_grid import TINY, Level, ScanGrid
from arrivals.typing import Float, Int

N_NEIGHBOURS = 8
MIN_RISE = 1e-9  # of the largest power: the ripple of a flat spectrum is rounding
N_STENCILS = 12  # of a search between grid points; one without a higher point halves the step
STENCIL = np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y])  # (8, 2)


def half_space_normal(model: ArraySnapshot) -> Float | None:
    """Return the unit vector (3,) into the half space of an array in a plane; None in space.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> half_space_normal(ArraySnapshot(SensorArray.uca(5, 0.4), 1.0, unknowns="sphere"))
    array([0., 0., 1.])
    """
    if not model.half_space:
        return None
    return np.asarray(plane_axes(model.array.positions - model.waves.centre)[2])


@dataclass(frozen=True, eq=False)
class SphereGrid(ScanGrid):
    """Evenly spread directions on the sphere, or on the half above a plane.

    A spectrum on the half is even about the plane: neighbours of directions at its edge are mirror
    images of others.

    Parameters
    ----------
    points : ndarray, shape (n_directions, 3)
        Unit vectors.
    normal : ndarray, shape (3,), or None
        Unit vector on the side of the half that is scanned; None for the whole sphere.

    Examples
    --------
    >>> from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
    >>> from arrivals.trackers.beamforming.scan_grid import log_level
    >>> grid = SphereGrid(fibonacci_sphere(2000), None)
    >>> def power_at(directions):
    ...     return np.cos(directions[0] - 0.5) * np.cos(directions[1]) + np.sin(directions[1])
    >>> power = power_at(grid.directions)
    >>> np.rad2deg(grid.peaks(power, log_level, power_at, 1)[0]).round(0).T
    array([[29., 45.]])
    """

    points: Float
    normal: Float | None

    @cached_property
    def directions(self) -> Float:  # type: ignore[override]  # read-only, as the field of others
        """Azimuths and elevations, rad, (2, n_directions)."""
        return np.stack(azimuth_elevation(self.points))

    @cached_property
    def step(self) -> float:
        """Mean distance of neighbours, rad."""
        area = 4 * np.pi if self.normal is None else 2 * np.pi
        return float(np.sqrt(area / len(self.points)))

    @cached_property
    def neighbours(self) -> Int:
        """Indices of the nearest directions, (8, n_directions)."""
        return np.ascontiguousarray(self._nearest[0].T)

    @property
    def ring(self) -> Float:
        """Unit vectors to the nearest directions or their mirror images, (n_directions, 8, 3)."""
        return self._nearest[1]

    @cached_property
    def _nearest(self) -> tuple[Int, Float]:
        from scipy.spatial import cKDTree

        points, index = self.points, np.arange(len(self.points))
        if self.normal is not None:
            height = points @ self.normal
            edge = np.flatnonzero((height > self.step / 4) & (height < 3 * self.step))
            index = np.concatenate([index, edge])
            points = np.concatenate([points, points[edge] - 2 * height[edge, None] * self.normal])
        nearest = cKDTree(points).query(self.points, N_NEIGHBOURS + 1)[1][:, 1:]
        return index[nearest], points[nearest]

    def peaks(
        self,
        power: Float,
        level: Level,
        power_at: Callable[[Float], Float],
        n: int,
        joined: bool = False,
    ) -> tuple[Float, Float]:
        """Return the highest points of finer and finer stencils about the peaks of the grid."""
        index = self.local_maxima(power)[: 2 * n + 4]
        u, value = self.points[index], power[index]
        rows, step = np.arange(len(index)), np.full((len(index), 1, 1), self.step / 2)
        stencils = self._stencils(index)
        for _ in range(N_STENCILS if len(index) else 0):
            candidates = self._on_grid_side(u[:, None] + step * stencils)
            powers = power_at(np.stack(azimuth_elevation(candidates.reshape(-1, 3))))
            powers = powers.reshape(len(index), -1)
            best = powers.argmax(axis=1)
            highest = powers[rows, best]
            rises = highest > value
            u = np.where(rises[:, None], candidates[rows, best], u)
            value = np.where(rises, highest, value)
            step = np.where(rises[:, None, None], step, step / 2)
        order = np.argsort(-value, kind="stable")
        u, value = u[order], value[order]
        # two searches may meet
        is_new = ~np.tril(u @ u.T > np.cos(self.step / 2), -1).any(axis=1)
        return np.stack(azimuth_elevation(u[is_new][:n])), value[is_new][:n]

    def local_maxima(self, power: Float) -> Int:
        """Return the indices of the local maxima among 8 neighbours, highest first.

        Of equal ones the first is taken.
        """
        around = power[self.neighbours]
        index = np.flatnonzero(power >= around.max(axis=0))
        around, value = around[:, index], power[index]
        is_second = ((around == value) & (self.neighbours[:, index] < index)).any(axis=0)
        rises = value > around.min(axis=0) + MIN_RISE * power.max()
        index = index[rises & ~is_second]
        return np.asarray(index[np.argsort(-power[index], kind="stable")])

    def _stencils(self, index: Int) -> Float:
        """Return 8 displacements about each of some directions, (len(index), 8, 3)."""
        azimuth, elevation = self.directions[:, index]
        east = np.stack([-np.sin(azimuth), np.cos(azimuth), 0 * azimuth], axis=-1)
        north = -np.sin(elevation)[:, None] * self.points[index]
        north[:, 2] += 1.0
        north /= np.maximum(np.cos(elevation), TINY)[:, None]
        return np.asarray(STENCIL[:, :1] * east[:, None] + STENCIL[:, 1:] * north[:, None])

    def _on_grid_side(self, v: Float) -> Float:
        """Return vectors (..., 3) of length one, those behind the plane mirrored."""
        v = v / np.sqrt((v * v).sum(axis=-1, keepdims=True))
        if self.normal is not None:
            v -= 2 * np.minimum(v @ self.normal, 0.0)[..., None] * self.normal
        return np.asarray(v)
