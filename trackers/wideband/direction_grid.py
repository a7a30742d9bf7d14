"""Scan directions of densities: distances, random walk and moments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.motion_models.von_mises import wrap
from arrivals.parameters import FrozenModel
from arrivals.typing import Complex, Float

SMALLEST = np.finfo(float).tiny
UNIFORM_VARIANCE = (6 * np.pi) ** 2  # rad², after which every direction is as likely


@dataclass(frozen=True)
class DirectionGrid(FrozenModel):
    """Equally spaced directions: of a line ±90° with both ends, else the full circle.

    Parameters
    ----------
    is_line : bool
        True for directions of a line.
    step : float
        Largest distance of neighbours, rad.

    Examples
    --------
    >>> grid = DirectionGrid(is_line=True, step=np.pi / 4)
    >>> np.rad2deg(grid.doa)
    array([-90., -45.,   0.,  45.,  90.])
    """

    is_line: bool
    step: float

    @cached_property
    def doa(self) -> Float:
        """Directions, rad, (n_directions,)."""
        span = np.pi if self.is_line else 2 * np.pi
        n = max(int(np.ceil(span / self.step - 1e-9)), 4)
        if self.is_line:
            return np.linspace(-np.pi / 2, np.pi / 2, n + 1)
        return np.linspace(-np.pi, np.pi, n, endpoint=False)

    @cached_property
    def offset(self) -> Float:
        """Direction of each column minus that of each row, rad, (n_directions, n_directions)."""
        return self.difference(self.doa, self.doa[:, None])

    @cached_property
    def distance(self) -> Float:
        """Distances of directions, rad, (n_directions, n_directions)."""
        return np.asarray(np.abs(self.offset))

    def difference(self, one: Float, other: Float) -> Float:
        """Return differences of directions, rad."""
        return np.asarray(one - other if self.is_line else wrap(one - other))

    def responses(self, manifold: AngleManifold) -> Complex:
        """Return the responses of an array, (n_nuisance, n_bins, n_sensors, n_directions)."""
        return manifold.steering(manifold.from_doa(self.doa))

    def moved(self, density: Float, variance: float) -> Float:
        """Return densities (..., n_directions) after a random walk of a variance, rad²."""
        return np.asarray(density @ self.walk(variance))

    def located(self, density: Float, half_width: float) -> tuple[Float, Float]:
        """Return directions (1, n), rad, and variances (n, 1, 1), as `moments` does."""
        doa, variance = self.moments(density, half_width)
        return doa[None], variance[:, None, None]

    def walk(self, variance: float) -> Float:
        """Return the transition matrix of a random walk, cached: rows are densities to move.

        Neighbours exchange probability at a constant rate, and the ends of a line reflect: two
        walks in a row equal one of the sum of their variances.
        """
        return _walk(self, variance)

    def moments(self, density: Float, half_width: float) -> tuple[Float, Float]:
        """Return mean and variance of densities (n, n_directions) about their peaks, (n,), (n,).

        They are those of the part within `half_width`, rad. Of a density narrower than the grid's
        step they are vertex and curvature of the parabola through three points of its logarithm.
        """
        top = density.argmax(axis=-1)
        offset = self.offset[top]
        w = density * (np.abs(offset) <= half_width + 1e-9)
        w = w / np.maximum(w.sum(axis=-1, keepdims=True), SMALLEST)
        mean = (w * offset).sum(axis=-1)
        variance = (w * (offset - mean[:, None]) ** 2).sum(axis=-1)
        step = float(self.doa[1] - self.doa[0])
        level = np.log(np.maximum(density, SMALLEST))
        before, after = top - 1, (top + 1) % len(self.doa)
        if self.is_line:  # even about the ends
            before, after = np.abs(before), len(self.doa) - 1 - np.abs(len(self.doa) - 2 - top)
        row = np.arange(len(top))
        left, middle, right = level[row, before], level[row, top], level[row, after]
        bend = np.maximum(2 * middle - left - right, SMALLEST)
        is_narrow = variance < step**2
        shift = step * np.clip((right - left) / (2 * bend), -0.5, 0.5)
        doa = self.doa[top] + np.where(is_narrow, shift, mean)
        variance = np.where(is_narrow, step**2 / bend, variance)
        return np.asarray(doa if self.is_line else wrap(doa)), np.asarray(variance)


@lru_cache(maxsize=32)
def _walk(grid: DirectionGrid, variance: float) -> Float:
    """Return exp(t L), L the Laplacian of the grid, of the given variance, rad²."""
    from scipy.linalg import expm

    n = len(grid.doa)
    L = np.eye(n, k=1) + np.eye(n, k=-1)
    if not grid.is_line:
        L[0, -1] = L[-1, 0] = 1
    L -= np.diag(L.sum(axis=1))
    spacing = float(grid.doa[1] - grid.doa[0])
    variance = min(variance, UNIFORM_VARIANCE)
    matrix = np.maximum(expm(variance / (2 * spacing**2) * L), 0)
    matrix /= matrix.sum(axis=1, keepdims=True)
    matrix.setflags(write=False)
    return np.asarray(matrix)
