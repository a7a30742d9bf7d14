"""Bank of Kalman filters as arrays, and gated nearest-neighbour assignment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.equations import predict_gaussian, update_gaussian
from arrivals.typing import Bool, Float, Int


@dataclass(frozen=True, eq=False)
class TrackBank:
    """Tracks in slots, some of which are free.

    Parameters
    ----------
    mean : ndarray, shape (n_slots, n)
        State; entry 0 is measured. NaN in free slots.
    covariance : ndarray, shape (n_slots, n, n)
        Covariance of the state; 0 in free slots.
    label : ndarray of int, shape (n_slots,)
        -1 in free slots.
    hits : ndarray of int, shape (n_slots,)
        Number of assigned measurements.
    misses : ndarray of int, shape (n_slots,)
        Number of steps since the last measurement.
    n_labels : int
        Number of labels assigned so far.
    """

    mean: Float
    covariance: Float
    label: Int
    hits: Int
    misses: Int
    n_labels: int = 0

    @classmethod
    def empty(cls, n_slots: int, n: int) -> Self:
        """Return a bank without tracks."""
        none, zero = np.full(n_slots, -1), np.zeros(n_slots, dtype=np.int64)
        return cls(np.full((n_slots, n), np.nan), np.zeros((n_slots, n, n)), none, zero, zero)

    @property
    def used(self) -> Bool:
        """Mask of the slots that hold a track."""
        return np.asarray(self.label >= 0)

    def predict(self, motion: MotionModel, dt: float) -> Self:
        """Return the bank after a step of a linear motion, so far without a measurement."""
        F, used = motion.F(np.zeros(motion.dim_x), dt), self.used
        P = predict_gaussian(self.covariance[used], F, motion.Q(dt))
        moved = self.replace_slots(used, mean=self.mean[used] @ F.T, covariance=P)
        return replace(moved, misses=self.misses + used)

    def update(self, slots: Int, residual: Float, variance: float) -> Self:
        """Return the bank after a measurement of some tracks."""
        H, R = np.eye(1, self.mean.shape[1]), np.full((1, 1), variance)
        updated = update_gaussian(self.mean[slots], self.covariance[slots], residual[:, None], H, R)
        return self.replace_slots(
            slots, mean=updated.x, covariance=updated.P, hits=self.hits[slots] + 1, misses=0
        )

    def add(self, z: Float, covariance: Float) -> Self:
        """Return the bank with a new track for each measurement, while slots are free.

        Measurements have the shape of entry 0 of the state.
        """
        free_slots = np.flatnonzero(~self.used)[: len(z)]
        mean = np.zeros((len(free_slots), *self.mean.shape[1:]))
        mean[:, 0] = z[: len(free_slots)]
        label = self.n_labels + np.arange(len(free_slots))
        bank = self.replace_slots(
            free_slots, mean=mean, covariance=covariance, label=label, hits=1, misses=0
        )
        return replace(bank, n_labels=self.n_labels + len(free_slots))

    def remove(self, slots: Bool) -> Self:
        """Return the bank without some tracks."""
        return self.replace_slots(slots, mean=np.nan, covariance=0.0, label=-1, hits=0, misses=0)

    def replace_slots(self, slots: Int | Bool, **changes: Any) -> Self:
        """Return the bank with new values of some arrays at some slots."""
        arrays = {name: getattr(self, name).copy() for name in changes}
        for name, values in changes.items():
            arrays[name][slots] = values
        return replace(self, **arrays)


def nearest(residual: Float, variance: Float, gate: float) -> tuple[Int, Int]:
    """Assign measurements to tracks: first the most pairs within the gate, then the nearest.

    Parameters
    ----------
    residual : ndarray, shape (n_tracks, n_measurements) or (n_tracks, n_measurements, n)
        Measurements minus predictions, numbers or vectors.
    variance : ndarray, shape (n_tracks,)
        Variance of the residuals along each axis.
    gate : float
        Maximum distance of a pair, in standard deviations.

    Returns
    -------
    track, measurement : ndarray of int, shape (n_pairs,)
        Indices of the pairs.

    References
    ----------
    Blackman and Popoli, *Design and Analysis of Modern Tracking Systems*, 1999, sec. 6.4.

    Examples
    --------
    >>> nearest(np.array([[0.1, 5.0], [2.0, 0.5]]), np.array([1.0, 1.0]), gate=3.0)
    (array([0, 1]), array([0, 1]))
    """
    from scipy.optimize import linear_sum_assignment

    square = residual**2 if residual.ndim == 2 else (residual**2).sum(axis=-1)
    distance = square / variance[:, None]
    is_within = distance <= gate**2
    outside = gate**2 * (1 + min(distance.shape))  # above the cost of all pairs within the gate
    track, measurement = linear_sum_assignment(np.where(is_within, distance, outside))
    is_pair = is_within[track, measurement]
    return track[is_pair], measurement[is_pair]
