"""PAST: signal subspace by recursive least squares, without a covariance or eigenvectors.

Equation numbers are those of Yang, "Projection approximation subspace tracking", IEEE Trans.
Signal Process. 43(1), 1995.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.registry import register
from arrivals.trackers.subspace.base import (
    DirectionFinder,
    NumberOfSources,
    SubspaceTracker,
    uniform_line,
)
from arrivals.trackers.subspace.esprit import ShiftInvariance
from arrivals.trackers.subspace.music import SpectrumSearch
from arrivals.trackers.subspace.past_steps import (
    SensorInverses,
    incomplete_step,
    limited_trace,
    past_step,
)
from arrivals.trackers.subspace.root_music import PolynomialRooting
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, one_of

TINY = 1e-290  # an energy above zero
MIN_FORGETTING = 1e-6  # bounds P after a long gap: the weight of older data is at least this
MAX_RELATIVE_TRACE = 1e12  # of P relative to the power: bounds wind-up along unexcited directions


@register("past")
class PAST(SubspaceTracker[DirectionFinder]):
    """Directions from a signal subspace tracked by recursive least squares.

    Parameters
    ----------
    measurement : ArraySnapshot
        A line on a uniform grid, or any array with the method "music".
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
        Basis of the subspace, nearly orthonormal.
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
    P starts at the inverse power of the first snapshot, so that the unit of the samples does not
    matter.

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
        self.age, self.weight, self.n_tracked = 0.0, np.zeros(n), 0
        self.energy, self.prior, self.rows = 0.0, 0.0, None
        self.W = np.zeros((n, self.n_slots), dtype=np.complex128)
        self.inverse = np.eye(self.n_slots, dtype=np.complex128)

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
        self.weight = self.forgetting**dt * self.weight
        self.age = self.age + dt

    def update_subspace(self, z: Complex) -> None:
        """Make one step of PAST, or of PETRELS once a sensor was missing."""
        if self.W.shape[1] != self.n_slots:  # the number of sources was changed
            self._reset_subspace()
        valid = ~np.isnan(z)
        y = np.where(valid, z, 0)
        power = float(np.vdot(y, y).real)
        known = self.weight > 0
        new = valid & ~known
        self._track_new_sensors(new, power / np.count_nonzero(valid))
        self.weight = self.weight + valid
        beta, L = max(self.forgetting**self.age, MIN_FORGETTING), self.n_tracked
        W, P = self.W[:, :L], self.inverse[:L, :L]
        if self.rows is None and (not known.any() or (valid == known).all()):
            W, P = past_step(W, P, y, beta)
        else:
            rows = SensorInverses(np.stack([P] * len(y))) if self.rows is None else self.rows
            rows = rows.restarted(new, np.count_nonzero(valid) / power)
            noise = max(self._noise_outside(), self.prior)
            W, P, self.rows, z = incomplete_step(W, P, rows, y, valid, beta, noise)
            expected = (W @ z)[known & ~valid]
            power += float(np.vdot(expected, expected).real)
            if self.total_weight > 0:  # 0 after a gap in which all was forgotten
                power += len(expected) * noise / self.total_weight
        self.energy, self.age = beta * self.energy + power, 0.0
        self.prior = beta * self.prior
        P = limited_trace(P, MAX_RELATIVE_TRACE / max(self.energy, TINY))
        if self.n_slots > L:  # some sensors have had no data
            rest = self.n_slots - L
            W, P = np.pad(W, ((0, 0), (0, rest))), np.pad(P, (0, rest))
        self.W, self.inverse = W, P

    def _noise_outside(self) -> float:
        """Return the weighted sum of a sensor's noise power, by the power outside the subspace."""
        known = self.weight > 0
        if self.energy == 0 or known.sum() <= self.n_tracked:
            return 0.0
        return float(self.eigendecomposition(known)[0][-1])

    def _track_new_sensors(self, new: Bool, power: float) -> None:
        """Add dimensions for sensors with their first data, of the power of a sensor."""
        old, L = self.n_tracked, self._dimension(int(np.count_nonzero(new | (self.weight > 0))))
        if old < L:
            added = np.arange(old, L)
            self.W, self.inverse, self.n_tracked = self.W.copy(), self.inverse.copy(), L
            self.W[np.flatnonzero(new)[: L - old], added] = 1.0
            self.prior = max(self.prior, power)
            self.inverse[added, added] = 1 / power
            if self.rows is not None:
                self.rows = self.rows.extended(L, 1 / power)

    def sensor_weights(self) -> Float:
        """Return the sum of weights of the valid data of each sensor, (n_sensors,)."""
        return self.weight

    def eigendecomposition(self, valid_sensors: Bool) -> tuple[Float, Complex]:
        """Return eigenvalues, falling, and eigenvectors of W P⁻¹Wᴴ plus white noise."""
        n = int(valid_sensors.sum())
        L = min(n, self.n_tracked)
        if self.energy == 0:
            return np.zeros(n), np.eye(n, dtype=np.complex128)
        W, inverse = self.W[valid_sensors], self.inverse
        if self.n_tracked < self.n_slots:
            W, inverse = W[:, : self.n_tracked], inverse[: self.n_tracked, : self.n_tracked]
        Q, R = np.linalg.qr(W, mode="complete")
        try:
            S = R[:L] @ np.linalg.solve(inverse, R[:L].conj().T)
        except np.linalg.LinAlgError:  # a leap of the level by many orders: P has lost its rank
            S = R[:L] @ np.linalg.pinv(inverse, hermitian=True) @ R[:L].conj().T
        values, rotation = np.linalg.eigh((S + S.conj().T) / 2)
        noise = (self.energy - values.sum()) / max(n - L, 1)  # the power outside, spread evenly
        values = np.concatenate([values[::-1], np.full(n - L, noise)])
        values = np.maximum(values, max(self.prior, noise))  # no dimension has less than noise
        return values, np.concatenate([Q[:, :L] @ rotation[:, ::-1], Q[:, L:]], axis=1)

    def direction_finder(self, model: ArraySnapshot) -> DirectionFinder:
        """Return the direction finder of `method`."""
        if self.method == "music":
            wavelength = model.plain_wavelength("past")
            return SpectrumSearch(model.array, wavelength, self.n_directions)
        line = uniform_line(model)
        return PolynomialRooting(line) if self.method == "root_music" else ShiftInvariance(line)
