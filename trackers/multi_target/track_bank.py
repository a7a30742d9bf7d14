"""A bank of Kalman filters, one a track, as arrays: births, deaths and nearest neighbours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.equations import predict_gaussian, update_gaussian
from arrivals.typing import Bool, Float, Int


@dataclass(frozen=True, eq=False)
class TrackBank:
    """Tracks in places of which some are free.

    Parameters
    ----------
    mean : ndarray, shape (n_places, n)
        What is measured is entry 0. NaN in free places.
    covariance : ndarray, shape (n_places, n, n)
    label : ndarray of int, shape (n_places,)
        -1 in free places.
    hits, misses : ndarray of int, shape (n_places,)
        Measurements that a track had, and steps since the last.
    n_labels : int
        Labels given so far.
    """

    mean: Float
    covariance: Float
    label: Int
    hits: Int
    misses: Int
    n_labels: int = 0

    @classmethod
    def empty(cls, n_places: int, n: int) -> TrackBank:
        """Return a bank without tracks."""
        none, zero = np.full(n_places, -1), np.zeros(n_places, dtype=np.int64)
        return cls(np.full((n_places, n), np.nan), np.zeros((n_places, n, n)), none, zero, zero)

    @property
    def used(self) -> Bool:
        """Which places hold a track."""
        return np.asarray(self.label >= 0)

    def predicted(self, motion: MotionModel, dt: float) -> TrackBank:
        """Return the bank after a step of the motion, which is linear."""
        F, on = motion.F(np.zeros(motion.dim_x), dt), self.used
        P = predict_gaussian(self.covariance[on], F, motion.Q(dt))
        return self._with(on, mean=self.mean[on] @ F.T, covariance=P)

    def corrected(self, place: Int, residual: Float, variance: float) -> TrackBank:
        """Return the bank in which some tracks had a measurement, and the others had none."""
        H, R = np.eye(1, self.mean.shape[1]), np.full((1, 1), variance)
        found = update_gaussian(self.mean[place], self.covariance[place], residual[:, None], H, R)
        missed = replace(self, misses=self.misses + self.used)
        return missed._with(
            place, mean=found.x, covariance=found.P, hits=self.hits[place] + 1, misses=0
        )

    def with_births(self, z: Float, covariance: Float) -> TrackBank:
        """Return the bank with a new track for each measurement, as long as there are places."""
        free = np.flatnonzero(~self.used)[: len(z)]
        mean = np.zeros((len(free), self.mean.shape[1]))
        mean[:, 0] = z[: len(free)]
        label = self.n_labels + np.arange(len(free))
        born = self._with(free, mean=mean, covariance=covariance, label=label, hits=1, misses=0)
        return replace(born, n_labels=self.n_labels + len(free))

    def without(self, gone: Bool) -> TrackBank:
        """Return the bank less some tracks."""
        return self._with(gone, mean=np.nan, covariance=0.0, label=-1, hits=0, misses=0)

    def _with(self, place: Int | Bool, **changes: Any) -> TrackBank:
        arrays = {name: getattr(self, name).copy() for name in changes}
        for name, values in changes.items():
            arrays[name][place] = values
        return replace(self, **arrays)


def nearest(residual: Float, variance: Float, gate: float) -> tuple[Int, Int]:
    """Assign measurements to tracks: most of those within the gate, then the nearest.

    Parameters
    ----------
    residual : ndarray, shape (n_tracks, n_measurements)
    variance : ndarray, shape (n_tracks,)
        Of the residuals.
    gate : float
        Standard deviations beyond which nothing is assigned.

    Returns
    -------
    track, measurement : ndarray of int, shape (n_pairs,)

    References
    ----------
    Blackman and Popoli, *Design and Analysis of Modern Tracking Systems*, 1999, sec. 6.4.

    Examples
    --------
    >>> nearest(np.array([[0.1, 5.0], [2.0, 0.5]]), np.array([1.0, 1.0]), gate=3.0)
    (array([0, 1]), array([0, 1]))
    """
    from scipy.optimize import linear_sum_assignment

    square = residual**2 / variance[:, None]
    within = square <= gate**2
    outside = gate**2 * (1 + min(square.shape))  # no assignment gains by leaving the gate
    track, measurement = linear_sum_assignment(np.where(within, square, outside))
    kept = within[track, measurement]
    return track[kept], measurement[kept]
