"""PAST: signal subspace by recursive least squares, without a covariance or eigenvectors.

Equation numbers are those of Yang, "Projection approximation subspace tracking", IEEE Trans.
Signal Process. 43(1), 1995.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.covariance import used_data
from arrivals.trackers.beamforming.model_grid import scan_grid
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import DirectionFinder, NumberOfSources, SubspaceTracker
from arrivals.trackers.subspace.bin_values import column, is_zero, larger, power_of, where_bins
from arrivals.trackers.subspace.esprit import shift_invariance
from arrivals.trackers.subspace.music_spectrum import spectrum_search
from arrivals.trackers.subspace.past_blocks import past_steps
from arrivals.trackers.subspace.past_steps import (
    TINY,
    SensorInverses,
    incomplete_step,
    limited_trace,
    past_step,
    subspace_eigenvectors,
    with_dimensions,
)
from arrivals.trackers.subspace.root_music import polynomial_rooting
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, one_of

MIN_FORGETTING = 1e-6  # bounds P after a long gap: the weight of older data is at least this
MAX_RELATIVE_TRACE = 1e12  # of P relative to the power: bounds wind-up along unexcited directions


@register("past")
class PAST(SubspaceTracker[DirectionFinder]):
    """Directions from a signal subspace tracked by recursive least squares.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line on a uniform grid, or any array with the method "music"; several bins as in
        `RootMUSIC`, `ESPRIT` or `MUSIC`. Sensors that are missing in some of the bins of a
        snapshot are left out of it, or these bins.
    n_sources : int, "mdl" or "aic"
        As in `MUSIC`. If a criterion estimates the number, a subspace of `max_sources` dimensions
        is tracked, and the power outside it is noise.
    max_sources : int, optional
        As in `MUSIC`, but below half the sensors if None: with more dimensions, false sources are
        detected at first.
    forgetting : float
        As in `MUSIC`.
    interval : int
        As in `MUSIC`.
    method : {"esprit", "root_music", "music"}
        Method that computes directions from the subspace.
    n_directions : int
        Scan directions of the method "music".

    Attributes
    ----------
    W : ndarray, shape (n_sensors, n_tracked)
        Basis of the subspace, nearly orthonormal. With several bins this and the other arrays have
        a leading axis of bins, and `energy`, `prior` and `age` are arrays.
    inverse : ndarray, shape (n_tracked, n_tracked)
        P of the paper: the inverse of the weighted sum of z zᴴ, z = Wᴴy.
    energy : float
        Weighted sum of ‖y‖².
    prior : float
        Weight of the initial P: power of each dimension that is not data. Smaller eigenvalues
        count as noise.
    n_tracked : int
        Dimension of the subspace: that of `W`, or less if sensors have had no data yet.
    weight : ndarray, shape (n_sensors,)
        Sum of the weights of the valid data of each sensor.
    age : float
        Time since the last snapshot with power.

    Raises
    ------
    ValueError
        If the array does not suit the method, or `n_sources` is above its maximum.

    Notes
    -----
    Labels are -1, `std` and `existence` NaN. Directions are in ascending order. A sensor that is
    missing does not change its row of W: once one was missing, each has a P of its own (PETRELS).
    P starts at the inverse power of the first snapshot: the unit of the samples does not matter.
    With numba (`arrivals[fast]`) the loop over complete snapshots of one bin is compiled.

    References
    ----------
    Yang, table I; the number of sources as in his part on PASTd, sec. V.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
    >>> phases = np.exp(2j * np.pi * np.random.default_rng(0).random((100, 2)))
    >>> z = model.simulate(np.full((100, 2), [-0.2, 0.5]), phases, np.random.default_rng(1))
    >>> PAST(model, n_sources=2).run(z).doa[-1].round(2)
    array([-0.2,  0.5])
    """

    def __init__(
        self,
        measurement: ArraySnapshot,
        n_sources: NumberOfSources = "mdl",
        *,
        max_sources: int | None = None,
        forgetting: float = 0.96,
        interval: int = 1,
        method: str = "esprit",
        n_directions: int = 361,
    ) -> None:
        self.method = one_of("method", method, ("esprit", "root_music", "music"))
        self.n_directions = count("n_directions", n_directions, 3, 100_000)
        super().__init__(
            measurement,
            n_sources,
            max_sources=max_sources,
            forgetting=forgetting,
            interval=interval,
        )

    def reset(self) -> None:
        """Return to the state after construction: no snapshot, no direction."""
        self._reset_subspace()
        super().reset()

    rows: SensorInverses | None

    def _reset_subspace(self) -> None:
        n = self.measurement.array.n_sensors
        bins = (self.measurement.n_bins,) if self.measurement.n_bins > 1 else ()
        self.n_tracked, self.rows, self.weight = 0, None, np.zeros((*bins, n))
        self.age: Any = np.zeros(bins) if bins else 0.0
        self.energy: Any = np.zeros(bins) if bins else 0.0
        self.prior: Any = np.zeros(bins) if bins else 0.0
        self.W = np.zeros((*bins, n, self.n_slots), dtype=np.complex128)
        self.inverse = np.eye(self.n_slots, dtype=np.complex128)
        if bins:
            self.inverse = np.tile(self.inverse, (*bins, 1, 1))

    @property
    def n_slots(self) -> int:
        """Maximum number of reported sources: the dimension of the tracked subspace."""
        return self._dimension(self.measurement.array.n_sensors)

    def _dimension(self, n_sensors: int) -> int:
        """Return the dimension of the subspace of so many sensors."""
        if isinstance(self.n_sources, int):
            return min(self.n_sources, max(n_sensors - 1, 1))
        limit = self.max_sources or max(1, (n_sensors - 1) // 2)
        return min(limit, max(n_sensors - 1, 1))

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        """Apply forgetting to the weights; report no direction until the next measurement."""
        super().predict(u, dt=dt)
        dt = float(dt)
        self.weight = self.forgetting**dt * self.weight
        self.age = self.age + dt

    def update_subspace(self, z: Complex) -> None:
        """Make one step of PAST, or of PETRELS once a sensor was missing, for each snapshot."""
        model = self.measurement
        bins = (model.n_bins,) if model.n_bins > 1 else ()
        if self.W.shape != (*bins, model.array.n_sensors, self.n_slots):  # a parameter was changed
            self._reset_subspace()
        if not bins:
            rows = z[None] if z.ndim == 1 else z
            valid = ~np.isnan(rows)
            for n, y in enumerate(rows):
                if self.rows is None and self.weight.all() and valid.all():
                    self._add_complete(rows[n:])
                    return
                if valid[n].any():
                    self._add(np.where(valid[n], y, 0), valid[n], None)
            return
        for y in np.swapaxes(z.reshape(*bins, -1, z.shape[-1]), 0, 1):
            is_number = ~np.isnan(y)
            y = np.where(is_number, y, 0)
            valid, has_data = used_data(is_number * y.any(axis=1, keepdims=True))
            if has_data is not None and has_data.any():
                y = np.where(valid & has_data[:, None], y, 0)
                self._add(y, valid, None if has_data.all() else has_data)

    def _add_complete(self, Y: Complex) -> None:
        """Add snapshots without gaps, (n_snapshots, n_sensors), once all sensors had data."""
        beta = max(self.forgetting**self.age, MIN_FORGETTING)
        self.W, self.inverse, self.energy = past_steps(
            self.W, self.inverse, Y, beta, self.energy, MAX_RELATIVE_TRACE
        )
        self.weight, self.prior, self.age = self.weight + len(Y), beta * self.prior, 0.0

    def _add(self, y: Complex, valid: Bool, has_data: Bool | None) -> None:
        """Add a snapshot, ([n_bins,] n_sensors), to the bins with data, all if None."""
        power = power_of(y)
        known = self._known_sensors()
        new = valid & ~known
        per_sensor = (
            power if has_data is None else np.where(has_data, power, 1.0)
        ) / np.count_nonzero(valid)
        self._track_new_sensors(new, known, per_sensor)
        if y.ndim > 1:
            self._start_bins((power > 0) & (self.energy == 0), per_sensor)
        self.weight = self.weight + (valid if has_data is None else valid & has_data[:, None])
        beta, L = larger(self.forgetting**self.age, MIN_FORGETTING), self.n_tracked
        before = W, P = self.W[..., :L], self.inverse[..., :L, :L]
        if self.rows is None and (not known.any() or (valid == known).all()):
            W, P = past_step(W, P, y, beta)
        else:
            old = rows = self.rows or SensorInverses(np.stack([P] * y.shape[-1], axis=-3))
            rows = rows.restarted(new, 1 / per_sensor)
            noise = larger(self._noise_outside(), self.prior)
            W, P, rows, z = incomplete_step(W, P, rows, y, valid, beta, noise)
            power = power + power_of((W @ z[..., None])[..., known & ~valid, 0])
            if self.total_weight > 0:  # 0 after a gap in which all was forgotten
                power = power + np.count_nonzero(known & ~valid) * noise / self.total_weight
            self.rows = SensorInverses(where_bins(has_data, rows.P, old.P))
        energy = beta * self.energy + power
        P = limited_trace(P, MAX_RELATIVE_TRACE / larger(energy, TINY))
        W, P = where_bins(has_data, W, before[0]), where_bins(has_data, P, before[1])
        self.energy = where_bins(has_data, energy, self.energy)
        self.prior = where_bins(has_data, beta * self.prior, self.prior)
        self.age = where_bins(has_data, 0.0 * beta, self.age)
        # some sensors may have had no data
        self.W, self.inverse = with_dimensions(W, P, self.n_slots)

    def _known_sensors(self) -> Bool:
        known: Bool = self.weight > 0
        return known if known.ndim == 1 else np.asarray(known.any(axis=0))

    def _noise_outside(self) -> Any:
        """Return the weighted sum of a sensor's noise power, by the power outside the subspace."""
        known = self._known_sensors()
        if is_zero(self.energy) or known.sum() <= self.n_tracked:
            return 0.0 * self.energy
        return self.eigendecomposition(known)[0][..., -1]

    def _track_new_sensors(self, new: Bool, known: Bool, power: Any) -> None:
        """Add dimensions for sensors with their first data, of the power of a sensor."""
        old, L = self.n_tracked, self._dimension(int(np.count_nonzero(new | known)))
        if old < L:
            added = np.arange(old, L)
            self.W, self.inverse, self.n_tracked = self.W.copy(), self.inverse.copy(), L
            self.W[..., np.flatnonzero(new)[: L - old], added] = 1.0
            self.prior = larger(self.prior, power)
            self.inverse[..., added, added] = column(1 / power)
            if self.rows is not None:
                self.rows = self.rows.extended(L, 1 / power)

    def _start_bins(self, bins: Bool, power: Float) -> None:
        """Set P of bins with their first data to the inverse power of a sensor."""
        if bins.any():
            initial = np.eye(self.n_slots) / power[:, None, None]
            self.inverse = where_bins(bins, initial + 0j, self.inverse)
            self.prior = np.where(bins, power, self.prior)

    def sensor_weights(self) -> Float:
        """Return the sum of weights of the valid data of each sensor, ([n_bins,] n_sensors)."""
        return self.weight

    def eigendecomposition(
        self, valid_sensors: Bool, bins: Bool | None = None, n_largest: int | None = None
    ) -> tuple[Float, Complex]:
        """Return eigenvalues, falling, and all eigenvectors of W P⁻¹Wᴴ plus white noise."""
        n = int(valid_sensors.sum())
        L = min(n, self.n_tracked)
        W, inverse = self.W[..., valid_sensors, :], self.inverse
        energy, prior = self.energy, self.prior
        if bins is not None and not bins.all():
            W, inverse, energy, prior = W[bins], inverse[bins], energy[bins], prior[bins]
        if is_zero(energy):
            values = np.zeros((*np.shape(energy), n))
            return values, np.broadcast_to(np.eye(n, dtype=np.complex128), (*values.shape, n))
        if self.n_tracked < self.n_slots:
            W, inverse = W[..., : self.n_tracked], inverse[..., : self.n_tracked, : self.n_tracked]
        is_signal_only = n_largest is not None and n_largest <= L
        values, vectors = subspace_eigenvectors(W, inverse, complete=not is_signal_only)
        # the power outside, spread evenly
        noise = (energy - values.sum(axis=-1)) / max(n - L, 1)
        outside = np.full((*values.shape[:-1], n - L), column(noise))
        values = np.concatenate([values, outside], axis=-1)
        return np.maximum(values, column(larger(prior, noise))), vectors  # no dimension has less

    def direction_finder(self, model: ArraySnapshot) -> DirectionFinder:
        """Return the direction finder of `method`."""
        if model.coherence is not None:
            raise ValueError(
                "noise_coherence must be 'white' for past; got coherent noise: music whitens it"
            )
        if self.method == "music":
            return spectrum_search(model, scan_grid(self.measurement, self.n_directions))
        return polynomial_rooting(model) if self.method == "root_music" else shift_invariance(model)
