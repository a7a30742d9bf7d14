"""Protocol of the grids on which densities of directions are kept."""

from __future__ import annotations

from typing import Any, Protocol

from arrivals.typing import Complex, Float


class DensityGrid(Protocol):
    """Directions of densities, of one angle or on the sphere.

    Grids are immutable and hashable.

    Examples
    --------
    >>> import numpy as np
    >>> from arrivals.trackers.wideband.direction_grid import DirectionGrid
    >>> grid: DensityGrid = DirectionGrid(is_line=True, step=np.pi / 4)
    >>> grid.distance.shape
    (5, 5)
    """

    def __hash__(self) -> int:
        """Return the same for the same grid."""

    @property
    def step(self) -> float:
        """Distance of neighbours, rad."""

    @property
    def doa(self) -> Float:
        """Directions, of the sphere the azimuths, rad, (n_directions,)."""

    @property
    def distance(self) -> Float:
        """Distances of directions, rad, (n_directions, n_directions)."""

    def responses(self, manifold: Any) -> Complex:
        """Return whitened responses to the directions, (n_nuisance, n_bins, n_sensors, n)."""

    def moved(self, density: Float, variance: float) -> Float:
        """Return densities (..., n_directions) after a random walk of a variance, rad²."""

    def located(self, density: Float, half_width: float) -> tuple[Float, Float]:
        """Return directions (d, n) and covariances (n, d, d) about the peaks of densities."""
