"""Grid of a tracker of densities: scan directions times values of a second unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.manifold import AngleManifold, angle_manifold
from arrivals.trackers.wideband.direction_grid import DirectionGrid
from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.tracked_sources import TrackedSources
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class Scan:
    """Measurement model with its noise, and the grid of its directions.

    Parameters
    ----------
    model : DirectionMeasurement
        Model whose snapshots are whitened.
    manifold : AngleManifold
        Its response.
    grid : DirectionGrid
        Directions.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(4, 0.5), [1.0, 1.2])
    >>> scan = Scan.of(model, MixtureSettings())
    >>> scan.model.noise_coherence, scan.n_points
    ('diffuse', 61)
    """

    model: DirectionMeasurement
    manifold: AngleManifold
    grid: DirectionGrid

    @classmethod
    def of(cls, measurement: DirectionMeasurement, settings: MixtureSettings) -> Scan:
        """Return the scan of a measurement model."""
        model = measurement
        if (
            settings.diffuse
            and isinstance(model, ArraySnapshot)
            and model.noise_coherence == "white"
        ):
            model = model.replace(noise_coherence="diffuse")
        manifold = angle_manifold("wideband_mixture", model.manifold())
        # of a line, a direction from behind is one in front
        behind = manifold.to_doa(manifold.from_doa(np.array([0.75 * np.pi])), slack=np.inf)
        grid = DirectionGrid(bool(abs(behind[0]) <= np.pi / 2), settings.grid_step)
        return cls(model, manifold, grid)

    @property
    def n_nuisance(self) -> int:
        """Number of values of an unknown slowness or elevation, 1 if there is none."""
        return len(self.manifold.nuisance_weights)

    @property
    def n_points(self) -> int:
        """Number of points of the grid."""
        return self.n_nuisance * len(self.grid.doa)

    def is_like(self, other: Scan) -> bool:
        """Return True if levels and densities have the same bins and points in both."""
        same_bins = self.manifold.n_bins == other.manifold.n_bins
        return same_bins and self.grid == other.grid and self.n_nuisance == other.n_nuisance

    def walk(self, sources: TrackedSources, variance: float) -> TrackedSources:
        """Return the sources after a random walk of their directions."""
        q = sources.density.reshape(-1, self.n_nuisance, len(self.grid.doa))
        moved = (q @ self.grid.walk(variance)).reshape(sources.density.shape)
        return replace(sources, density=moved)

    def moments(self, density: Float, half_width: float) -> tuple[Float, Float]:
        """Return mean and variance of directions about the peaks of densities (n, n_points)."""
        by_direction = density.reshape(len(density), self.n_nuisance, len(self.grid.doa))
        return self.grid.moments(by_direction.sum(axis=1), half_width)
