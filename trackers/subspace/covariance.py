"""Base class of subspace methods by eigenvectors of a running covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.trackers.beamforming.block_scan import part_in_use, whitened_covariance
from arrivals.trackers.beamforming.covariance import RunningCovariance, spatial_smoothing
from arrivals.trackers.subspace.base import F, NumberOfSources, SubspaceTracker
from arrivals.trackers.subspace.decompositions import largest_eigenvectors
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance


class CovarianceSubspace(RunningCovariance, SubspaceTracker[F]):
    """Base of trackers by the eigenvectors of a running covariance, smoothed on request.

    Parameters
    ----------
    measurement, n_sources, max_sources, forgetting, interval
        As in `SubspaceTracker`.
    smoothing : int, optional
        Sensors of the subarrays of `spatial_smoothing`; None: no smoothing.
    backward : bool
        Average with the reversed line.
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        n_sources: NumberOfSources = "mdl",
        *,
        max_sources: int | None = None,
        forgetting: float = 0.96,
        smoothing: int | None = None,
        backward: bool = False,
        interval: int = 1,
    ) -> None:
        self.smoothing, self.backward = smoothing, instance("backward", backward, bool)
        super().__init__(
            measurement,
            n_sources,
            max_sources=max_sources,
            forgetting=forgetting,
            interval=interval,
        )

    def reset(self) -> None:
        """Return to the state after construction: no snapshot, no direction."""
        self.reset_covariance(self.measurement.array.n_sensors, self.measurement.n_bins)
        super().reset()

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Apply forgetting to the covariance; reported directions do not change."""
        super().predict(u, dt=dt)
        self.apply_forgetting(dt)

    def update_subspace(self, z: Complex) -> None:
        """Add the snapshots of a step to the covariances of their bins."""
        model = self.measurement
        self.fit_covariance(model.array.n_sensors, model.n_bins)
        self.add_snapshot(z)

    def sensor_weights(self) -> Float:
        """Return the sum of weights of the valid data of each sensor, ([n_bins,] n_sensors)."""
        return self.data_weights()

    @property
    def _is_smoothed(self) -> bool:
        return self.smoothing is not None or self.backward

    def _subarray_length(self, n_sensors: int) -> int:
        return n_sensors if self.smoothing is None else self.smoothing

    def eigendecomposition(
        self, valid_sensors: Bool, bins: Bool | None = None, n_largest: int | None = None
    ) -> tuple[Float, Complex]:
        """Return eigenvalues, falling, and eigenvectors of the (smoothed) mean covariance."""
        R = self.mean_covariance(valid_sensors, bins)
        if self.measurement.coherence is not None:
            R = whitened_covariance(part_in_use(self.measurement, valid_sensors, bins), R)
        if self._is_smoothed:
            order = np.argsort(self.measurement.array.positions[valid_sensors, 0])
            length = self._subarray_length(len(order))
            R = spatial_smoothing(R[..., order, :][..., order], length, backward=self.backward)
        return largest_eigenvectors(R, n_largest)

    def subarray_model(self, model: ArraySnapshot) -> ArraySnapshot:
        """Return the model of the first subarray, or of all sensors without smoothing."""
        if not self._is_smoothed:
            return model
        if model.coherence is not None:
            raise ValueError(
                "noise_coherence must be 'white' with smoothing; got coherent noise, whose "
                "whitening removes the shifts"
            )
        positions, n = np.sort(model.array.positions[:, 0]), model.array.n_sensors
        length = count("smoothing", self._subarray_length(n))
        spacing = model.array.spacing
        uniform = spacing is not None and round((positions[-1] - positions[0]) / spacing) == n - 1
        if not uniform or length > n:
            raise ValueError(
                f"spatial smoothing requires a uniform line without gaps of at least {length} "
                f"sensors; got {n} sensors in {model.array.dim} dimension(s)"
                + ("" if uniform else ", not a uniform line")
            )
        return model.replace(array=SensorArray(positions[:length]))
