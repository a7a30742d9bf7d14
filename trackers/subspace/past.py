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
from arrivals.trackers.subspace.root_music import PolynomialRooting
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count, one_of

MIN_FORGETTING = 1e-6  # bounds P after a long gap: the weight of older data is at least this
MAX_RELATIVE_TRACE = 1e12  # of P relative to the power: bounds wind-up along unexcited directions


def past_step(W: Complex, P: Complex, y: Complex, beta: ArrayLike) -> tuple[Complex, Complex]:
    """Return W and P after one snapshot: algorithm PAST, Table I.

    Parameters
    ----------
    W : ndarray, shape (..., n_sensors, n_sources)
        Basis of the signal subspace, nearly orthonormal.
    P : ndarray, shape (..., n_sources, n_sources)
        Inverse of the weighted sum of z zᴴ, z = Wᴴy.
    y : ndarray, shape (..., n_sensors)
        Snapshot.
    beta : float or array_like, shape (...)
        Weight of the past.

    Returns
    -------
    W : ndarray, shape (..., n_sensors, n_sources)
        Updated basis.
    P : ndarray, shape (..., n_sources, n_sources)
        Updated inverse.

    References
    ----------
    Yang, table I.

    Examples
    --------
    >>> W, P = np.array([[1.0], [0.0]]), np.eye(1)
    >>> for _ in range(20):
    ...     W, P = past_step(W, P, np.array([3.0, 4.0]), 0.9)
    >>> W.round(3).ravel()
    array([0.6, 0.8])
    """
    beta = np.asarray(beta)[..., None, None]
    y = y[..., None]
    # z = Wᴴ y
    z = W.conj().swapaxes(-1, -2) @ y
    # h = P z
    h = P @ z
    hH = h.conj().swapaxes(-1, -2)
    # g = h / (β + zᴴh)
    gH = hH / (beta + (hH @ z).real)
    # P = Tri{P - g hᴴ} / β; the Hermitian part, since rounding would grow as β⁻ⁿ
    P = (P - h * gH) / (2 * beta)
    P = P + P.conj().swapaxes(-1, -2)
    # W = W + (y - W z) gᴴ
    return W + (y - W @ z) * gH, P


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
    missing is imputed: its expected value given the others, by W P⁻¹Wᴴ plus white noise. P starts
    at the inverse power of the first snapshot, so that the unit of the samples does not matter.

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
        self.n_directions = count("n_directions", n_directions, minimum=3)
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

    def _reset_subspace(self) -> None:
        n = self.measurement.array.n_sensors
        self.age, self.weight, self.n_tracked = 0.0, np.zeros(n), 0
        self.energy, self.prior = 0.0, 0.0
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
        """Make one step of PAST; missing sensors are imputed from the subspace."""
        if self.W.shape[1] != self.n_slots:  # the number of sources was changed
            self._reset_subspace()
        valid = ~np.isnan(z)
        y, unexplained = (z, 0.0) if valid.all() else self._imputed(z)
        power = float(np.vdot(y, y).real)
        self._track_new_sensors(valid, power)
        self.weight = self.weight + valid
        beta, L = max(self.forgetting**self.age, MIN_FORGETTING), self.n_tracked
        W, P = past_step(self.W[:, :L], self.inverse[:L, :L], y, beta)
        self.energy, self.age = beta * self.energy + power + unexplained, 0.0
        self.prior = beta * self.prior
        trace = self.energy * float(P.trace().real)
        P = P if trace < MAX_RELATIVE_TRACE else P * (MAX_RELATIVE_TRACE / trace)
        if self.n_slots > L:  # some sensors have had no data
            rest = self.n_slots - L
            W, P = np.pad(W, ((0, 0), (0, rest))), np.pad(P, (0, rest))
        self.W, self.inverse = W, P

    def _track_new_sensors(self, valid: Bool, power: float) -> None:
        """Add dimensions for sensors with their first data."""
        new = np.flatnonzero(valid & (self.weight == 0))
        old, L = self.n_tracked, self._dimension(len(new) + int(np.count_nonzero(self.weight)))
        if old < L:
            added = np.arange(old, L)
            self.W, self.inverse, self.n_tracked = self.W.copy(), self.inverse.copy(), L
            self.W[new[: L - old], added] = 1.0
            self.prior = max(self.prior, power / np.count_nonzero(valid))
            self.inverse[added, added] = np.count_nonzero(valid) / power

    def _imputed(self, z: Complex) -> tuple[Complex, float]:
        """Return a snapshot with expected values of missing sensors, and their variance's sum."""
        known = ~np.isnan(z) | (self.weight > 0)
        y = np.where(np.isnan(z), 0, z)
        if self.energy == 0:
            return y, 0.0
        values, vectors = self.eigendecomposition(known)
        # the noise of few snapshots is not known
        values = np.maximum(values, self.energy / (len(values) * self.total_weight))
        R = (vectors * values) @ vectors.conj().T
        y[known], variance = conditional_mean(R, z[known])
        return y, variance / self.total_weight

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
        S = R[:L] @ np.linalg.solve(inverse, R[:L].conj().T)
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


def conditional_mean(R: Complex, y: Complex) -> tuple[Complex, float]:
    """Return a snapshot whose missing sensors have their expected values.

    Parameters
    ----------
    R : ndarray, shape (n_sensors, n_sensors)
        Covariance, positive definite.
    y : ndarray, shape (n_sensors,)
        Snapshot; NaN where a sensor has no valid data.

    Returns
    -------
    completed : ndarray, shape (n_sensors,)
        y, and R_mo R_oo⁻¹ y_o at the missing sensors.
    variance : float
        Sum of the variances of the missing sensors, given the others.

    Examples
    --------
    >>> R = np.array([[1.0, 0.5], [0.5, 1.0]])
    >>> conditional_mean(R, np.array([2.0, np.nan]))
    (array([2., 1.]), 0.75)
    """
    missing = np.isnan(y)
    R_oo, R_om = R[np.ix_(~missing, ~missing)], R[np.ix_(~missing, missing)]
    K = np.linalg.solve(R_oo, R_om).conj().T
    completed = y.copy()
    completed[missing] = K @ y[~missing]
    variance = float(R.diagonal()[missing].sum().real - np.trace(K @ R_om).real)
    return completed, max(variance, 0.0)
