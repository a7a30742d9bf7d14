"""Base classes of the subspace methods: number of sources, subspace, directions."""

from __future__ import annotations

from abc import abstractmethod
from functools import partial
from typing import ClassVar, Generic, Literal, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurements import is_complete
from arrivals.trackers.beamforming.block_scan import part_in_use
from arrivals.trackers.beamforming.covariance import used_data
from arrivals.trackers.beamforming.source_number import number_of_sources
from arrivals.trackers.direction_tracker import DirectionTracker, warn_of_ambiguity
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.kinds_of_estimates import kind_of_estimate
from arrivals.trackers.subspace.amplitudes import wave_amplitudes
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, instance, no_control, one_of, probability, time_step

NumberOfSources: TypeAlias = int | Literal["aic", "mdl"] | None


class Subspaces(NamedTuple):
    """Orthonormal bases of the signal subspace, (..., n, K), and the noise, (..., n, n - K).

    The leading axis of a step of several bins is that of the bins. The noise is (n, 0) for a
    method that does not need it.
    """

    signal: Complex
    noise: Complex


class DirectionFinder(Protocol):
    """Method that computes directions from subspaces."""

    @property
    def max_sources(self) -> int:
        """Maximum number of directions."""

    def needs_noise(self, n_sources: int) -> bool:
        """Return True if the directions of so many sources depend on the noise's basis."""

    def directions(self, subspaces: Subspaces) -> Float:
        """Return directions, rad, (n,) or (n_unknowns, n); at most one a signal dimension."""


F = TypeVar("F", bound=DirectionFinder)


class SubspaceTracker(DirectionTracker, Generic[F]):
    """Base of trackers of fewer sources than sensors, by their signal subspace.

    A subclass implements `update_subspace`, `sensor_weights`, `eigendecomposition` and
    `direction_finder`, and extends `predict` and `reset`.

    Parameters
    ----------
    measurement : ArraySnapshot
        Any array, bins and snapshots.
    n_sources : int, "mdl" or "aic"
        Number of sources, or the criterion that estimates it.
    max_sources : int, optional
        Maximum number that a criterion may find.
    forgetting : float
        Weight of the past after one unit of time.
    interval : int
        Directions are computed at every `interval`-th snapshot.

    Attributes
    ----------
    total_weight, total_squared_weight : float
        Sum of the weights of the snapshots, and of their squares.
    n_snapshots : int
        Number of snapshots with valid data.
    last_report : DirectionEstimate
        Directions that were computed last.
    n_missing : int
        Number of steps since the last snapshot with valid data.
    """

    unknowns: ClassVar[tuple[str, ...]] = ("azimuth",)  # that the method can estimate

    def __init__(
        self,
        measurement: ArraySnapshot,
        n_sources: NumberOfSources = "mdl",
        *,
        max_sources: int | None = None,
        forgetting: float = 0.96,
        interval: int = 1,
    ) -> None:
        self.measurement = instance("measurement", measurement, ArraySnapshot)
        self.n_sources: NumberOfSources = n_sources
        self.max_sources = max_sources
        self.forgetting = probability("forgetting", forgetting)
        self.interval = count("interval", interval)
        if max_sources is not None:
            count("max_sources", max_sources, maximum=1000)
        if isinstance(n_sources, str):
            one_of("n_sources", n_sources, ("aic", "mdl"))
        elif n_sources is not None:
            self.n_sources = count("n_sources", n_sources, maximum=1000)
        self._kind_of_estimate()
        self._check_number_of_sources()
        warn_of_ambiguity(measurement)
        self.reset()

    def _check_number_of_sources(self) -> None:
        model = self.measurement
        limit = self.direction_finder(self.subarray_model(model)).max_sources
        n_sources = self.n_sources if isinstance(self.n_sources, int) else 1
        if n_sources > limit:
            raise ValueError(
                f"n_sources must be at most {limit} for {type(self).__name__} on this array of "
                f"{model.array.n_sensors} sensors; got {n_sources}"
            )

    def reset(self) -> None:
        """Return to the state after construction: no snapshot, no direction."""
        self.total_weight, self.total_squared_weight, self.n_snapshots = 0.0, 0.0, 0
        self.n_missing = 0
        self.estimate_kind = self._kind_of_estimate()
        self.report_none()
        self.last_report = self.estimate

    def _kind_of_estimate(self) -> type[DirectionEstimate]:
        return kind_of_estimate(self.measurement, type(self).__name__, *self.unknowns)

    @property
    def n_slots(self) -> int:
        """Maximum number of reported sources."""
        if isinstance(self.n_sources, int):
            return self.n_sources
        limit = self.measurement.array.n_sensors - 1
        return min(self.max_sources or limit, limit)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Apply forgetting to the weights; report no direction until the next measurement."""
        dt = time_step(dt)
        no_control(u)
        factor = self.forgetting**dt
        self.total_weight = factor * self.total_weight
        self.total_squared_weight = factor**2 * self.total_squared_weight
        self.n_missing = self.n_missing + 1
        self.estimate_kind = self._kind_of_estimate()
        self.report_none()

    def update(self, z: ArrayLike | None) -> None:
        """Add the snapshots of a step; compute directions at every `interval`-th snapshot."""
        z = self.measurement.snapshot(z)
        n_new = self.measurement.n_snapshots if is_complete(z) else self._count(~np.isnan(z))
        if n_new == 0:
            return
        self.update_subspace(z)
        self.total_weight = self.total_weight + n_new
        self.total_squared_weight = self.total_squared_weight + n_new
        is_due = (self.n_snapshots + n_new) // self.interval > self.n_snapshots // self.interval
        self.n_snapshots = self.n_snapshots + n_new
        follows_gap, self.n_missing = self.n_missing > 1, 0
        if is_due:
            directions = self._directions()
            amplitude = partial(wave_amplitudes, self.measurement, directions, z)
            self.report_directions(directions, amplitude=amplitude)
            self.last_report = self.estimate
        elif follows_gap:
            self.last_report = self.estimate  # none
        else:
            self.report_estimate(self.last_report)

    def _count(self, valid: Bool) -> int:
        """Return the number of snapshots of a step with data in some bin."""
        model = self.measurement
        has_data = valid.reshape(model.n_bins, model.n_snapshots, -1).any(axis=(0, 2))
        return int(has_data.sum())

    @abstractmethod
    def update_subspace(self, z: Complex) -> None:
        """Add the snapshots of a step, NaN where a sensor has no valid data."""

    @abstractmethod
    def sensor_weights(self) -> Float:
        """Return the sum of weights of the valid data of each sensor, ([n_bins,] n_sensors)."""

    @abstractmethod
    def eigendecomposition(
        self, valid_sensors: Bool, bins: Bool | None = None, n_largest: int | None = None
    ) -> tuple[Float, Complex]:
        """Return eigenvalues, falling, and eigenvectors of the covariance of valid sensors.

        Those of some of the bins, if the model has several. n_largest are sufficient; all if None.
        """

    @abstractmethod
    def direction_finder(self, model: ArraySnapshot) -> F:
        """Return the method that computes directions with the sensors of the model."""

    def subarray_model(self, model: ArraySnapshot) -> ArraySnapshot:
        """Return the model of the sensors of the eigenvectors: all, unless a method smooths."""
        return model

    def current_subspaces(self) -> tuple[F, Subspaces] | None:
        """Return the direction finder and the subspaces of the valid sensors.

        Returns
        -------
        tuple of DirectionFinder and Subspaces, or None
            None if there are no data, too few sensors for the method, or no source.
        """
        if self.total_squared_weight == 0:
            return None
        weights = self.sensor_weights()
        valid_sensors, bins = used_data(weights)
        if bins is not None and not bins.any():
            return None
        try:
            model = part_in_use(self.measurement, valid_sensors, bins)
            finder = self.direction_finder(self.subarray_model(model))
        except ValueError:  # too few sensors are left for the method
            return None
        n_largest = self._sufficient_dimensions(finder)
        values, vectors = self.eigendecomposition(valid_sensors, bins, n_largest)
        if bins is not None:
            weights = weights[bins].mean(axis=0)
            if model.n_bins == 1:  # one of several is left
                values, vectors = values[0], vectors[0]
        n_sources = 0
        if np.count_nonzero(values[..., 0]):
            n_sources = self._number_of_sources(values, weights[valid_sensors])
        K = min(n_sources, finder.max_sources)
        return (finder, Subspaces(vectors[..., :K], vectors[..., K:])) if K > 0 else None

    def _sufficient_dimensions(self, finder: F) -> int | None:
        """Return the number of eigenvectors of a known number of sources; None for all."""
        if not isinstance(self.n_sources, int):
            return None
        n = min(self.n_sources, finder.max_sources)
        has_full_rank = self.n_snapshots >= n > 0
        return n if has_full_rank and not finder.needs_noise(n) else None

    def _directions(self) -> Float:
        """Return the directions, rad, (n_unknowns, n), in rising order of the first unknown."""
        current = self.current_subspaces()
        if current is None:
            return np.zeros((self.estimate_kind.n_unknowns, 0))
        finder, subspaces = current
        directions = finder.directions(subspaces)
        directions = directions[None] if directions.ndim == 1 else directions
        return directions[:, directions[0].argsort(kind="stable")]

    def _number_of_sources(self, eigenvalues: Float, weights: Float) -> int:
        """Return the number of sources, given or estimated; weights are those of the sensors."""
        if isinstance(self.n_sources, int):
            return self.n_sources
        share = float((weights / self.total_weight).mean())  # of complete data
        # the number of snapshots of equal weight with the same variance of the mean
        n_effective = self.total_weight**2 / self.total_squared_weight
        estimate = number_of_sources(
            eigenvalues, share * n_effective, self.n_sources or "mdl", joint=eigenvalues.ndim > 1
        )
        return min(int(estimate), self.n_slots)
