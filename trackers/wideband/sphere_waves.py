"""Whitened responses of an array to plane waves of azimuth and elevation in diffuse noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.noise_coherence import NoiseCoherence, diffuse_coherence
from arrivals.parameters import FrozenModel
from arrivals.trackers.beamforming.block_scan import plane_wave_responses
from arrivals.typing import Bool, Complex, Float, Int


@dataclass(frozen=True)
class SphereWaves(FrozenModel):
    """Responses of some sensors of an array, as `AngleManifold` has them for one angle.

    Parameters
    ----------
    model : ArraySnapshot
        Of azimuth and elevation.
    coherence : NoiseCoherence, optional
        Of the noise between all sensors; white if None.
    missing : tuple of int
        Sensors that are left out.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.uca(5, 0.4), [1.0, 1.2], unknowns="sphere")
    >>> SphereWaves.of(model).without([2]).responses(np.zeros((2, 7))).shape
    (1, 2, 4, 7)
    """

    model: ArraySnapshot
    coherence: NoiseCoherence | None = None
    missing: tuple[int, ...] = ()

    @classmethod
    def of(cls, model: ArraySnapshot, diffuse: bool = True) -> SphereWaves:
        """Return the responses of a model in diffuse noise, or in white noise."""
        if not diffuse:
            return cls(model)
        noise = diffuse_coherence(model.array, model.wavelengths, model.white)
        return cls(model, NoiseCoherence(noise))

    @property
    def n_bins(self) -> int:
        """Number of frequency bins."""
        return self.model.n_bins

    @property
    def nuisance_weights(self) -> Float:
        """One weight: a third unknown does not exist."""
        return np.ones(1)

    def without(self, sensors: Sequence[int] | Int) -> SphereWaves:
        """Return the responses of the other sensors."""
        return self.replace(missing=tuple(int(each) for each in sensors))

    def whitened(self, snapshots: Complex, sensors: Bool, bins: Bool | None = None) -> Complex:
        """Return L times numbers (..., n_bins, n_sensors, n) of some sensors and bins."""
        if self.coherence is None:
            return snapshots
        L = self.coherence.whitening(sensors)
        return np.asarray((L if bins is None else L[bins]) @ snapshots)

    def responses(self, directions: Float) -> Complex:
        """Return whitened responses to directions (2, n), rad: (1, n_bins, n_sensors, n)."""
        sensors = np.ones(self.model.array.n_sensors, dtype=np.bool_)
        sensors[list(self.missing)] = False
        return self.whitened(plane_wave_responses(self.model, directions)[:, :, sensors], sensors)
