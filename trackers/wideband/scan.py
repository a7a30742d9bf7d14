"""Grid of a tracker of densities: scan directions times values of a second unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.manifolds.manifold import AngleManifold, angle_manifold
from arrivals.measurement_models.observed import ObservedSnapshots
from arrivals.trackers.beamforming.block_scan import can_scan
from arrivals.trackers.beamforming.sphere_grid import half_space_normal
from arrivals.trackers.wideband.density_grid import DensityGrid
from arrivals.trackers.wideband.direction_grid import DirectionGrid
from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.sphere_density import SphereDensityGrid
from arrivals.trackers.wideband.sphere_waves import SphereWaves
from arrivals.trackers.wideband.tracked_sources import TrackedSources
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class Scan:
    """Measurement model with its noise, and the grid of its directions.

    Parameters
    ----------
    model : DirectionMeasurement
        Model whose snapshots are whitened.
    manifold : AngleManifold or SphereWaves
        Its response.
    grid : DensityGrid
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
    manifold: AngleManifold | SphereWaves
    grid: DensityGrid

    @classmethod
    def of(cls, measurement: DirectionMeasurement, settings: MixtureSettings) -> Scan:
        """Return the scan of a measurement model."""
        model = measurement
        if isinstance(model, ArraySnapshot) and model.unknowns == "sphere":
            normal = half_space_normal(model)
            on_half = None if normal is None else tuple(normal.tolist())
            grid = SphereDensityGrid(settings.sphere_step, on_half)
            return cls(model, SphereWaves.of(model, settings.diffuse), grid)
        if (
            settings.diffuse
            and isinstance(model, ArraySnapshot)
            and model.noise_coherence == "white"
        ):
            model = model.replace(noise_coherence="diffuse")
        manifold = angle_manifold("wideband_mixture", model.manifold())
        # of a line, a direction from behind is one in front
        behind = manifold.to_doa(manifold.from_doa(np.array([0.75 * np.pi])), slack=np.inf)
        is_line = bool(abs(behind[0]) <= np.pi / 2)
        return cls(model, manifold, DirectionGrid(is_line, settings.grid_step))

    def observe(self, z: ArrayLike | None) -> ObservedSnapshots | None:
        """Return the valid data of a measurement, whitened; None if there are too few."""
        observed = self.model.observe(z)
        if observed is None or not isinstance(self.manifold, SphereWaves):
            return observed
        if not can_scan(self.manifold.model, observed.sensors):
            return None
        y = self.manifold.whitened(observed.snapshots, observed.sensors, observed.bins)
        return replace(observed, snapshots=y)

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
        moved = self.grid.moved(q, variance).reshape(sources.density.shape)
        return replace(sources, density=moved)

    def located(self, density: Float, half_width: float) -> tuple[Float, Float]:
        """Return directions (d, n) and covariances (n, d, d) about peaks of (n, n_points)."""
        by_direction = density.reshape(len(density), self.n_nuisance, len(self.grid.doa))
        return self.grid.located(by_direction.sum(axis=1), half_width)
