"""Readings of each sensor collected over time, for steps with few readings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arrivals.motion_models.base import MotionModel
from arrivals.trackers.rss.belief import Entries, transition_matrices
from arrivals.typing import Bool, Float

# of a reading to the mean before, in variances; beyond, the mean restarts
MAX_SQUARED_CHANGE = 16.0


@dataclass(frozen=True, eq=False)
class PooledReadings:
    """Weighted mean of the latest readings of each sensor; most arrays (n_sensors,).

    Parameters
    ----------
    xi : ndarray
        Means, Np.
    W : ndarray
        Their weights, Np⁻²; 0 where there was no reading.
    age : ndarray
        Time since the last reading.
    sensors : ndarray, shape (n_sensors, 2)
        Positions of the sensors at that time, m.
    n_repeated : int
        Steps with readings since a sensor had its first one.
    """

    xi: Float
    W: Float
    age: Float
    sensors: Float
    n_repeated: int = 0

    @classmethod
    def none(cls, n: int) -> PooledReadings:
        """Return no readings of n sensors."""
        return cls(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros((n, 2)))

    @property
    def seen(self) -> Bool:
        """True for the sensors that have had a reading."""
        return np.asarray(self.W > 0)

    def later(self, dt: float) -> PooledReadings:
        """Return the readings after a time step."""
        return replace(self, age=self.age + dt)

    def aged(self, spread: Float) -> Float:
        """Return the weights, given the variances, Np², of the levels' changes since; inf: 0."""
        valid = np.isfinite(spread)
        return np.where(valid, self.W / (1 + self.W * np.where(valid, spread, 0.0)), 0.0)

    def joined(self, xi: Float, W: Float, sensors: Float, spread: Float) -> PooledReadings:
        """Return the means with the readings of a step, W = 0 where missing.

        Examples
        --------
        >>> two = PooledReadings.none(2)
        >>> for z, W in (([1.0, 5.0], [1.0, 0.0]), ([2.0, 0.0], [1.0, 0.0])):
        ...     two = two.joined(np.array(z), np.array(W), np.zeros((2, 2)), np.zeros(2))
        >>> two.xi, two.W
        (array([1.5, 0. ]), array([2., 0.]))
        """
        valid, before = W > 0, self.aged(spread)
        # a level that has changed by more than its variance allows starts a new mean
        changed = np.square(xi - self.xi) * before * W > MAX_SQUARED_CHANGE * (before + W)
        before = np.where(changed, 0.0, before)
        total = np.where(valid, before + W, 1.0)
        mean = (before * self.xi + W * xi) / total
        return PooledReadings(
            np.where(valid, mean, self.xi),
            np.where(valid, total, self.W),
            np.where(valid, 0.0, self.age),
            np.where(valid[:, None], sensors, self.sensors),
            0 if (valid & ~self.seen).any() else self.n_repeated + 1,
        )

    def is_complete(self, n_readings: int) -> bool:
        """Return True if no sensor is likely to follow that has had no reading.

        Parameters
        ----------
        n_readings : int
            Number of readings of the last step.
        """
        n = int(self.seen.sum())
        return self.n_repeated >= (1 if n_readings == n else n)


def displacement_variance(motion: MotionModel, P0: Float, position: Entries, age: Float) -> Float:
    """Return the variances of a coordinate of new sources after times `age`, m².

    Parameters
    ----------
    motion : MotionModel
    P0 : ndarray, shape (n, n)
        Covariance of a new source's state, zero for its position.
    position : tuple of two int
        Entries of a state that are the position.
    age : ndarray, shape (n_sensors,)

    Examples
    --------
    >>> from arrivals.motion_models import ConstantVelocity
    >>> P0 = np.diag([0.0, 4.0, 0.0, 4.0])
    >>> displacement_variance(ConstantVelocity(q=0.0), P0, (0, 2), np.array([0.0, 3.0]))
    array([ 0., 36.])
    """
    times, at = np.unique(age, return_inverse=True)
    variance, x = np.zeros(len(times)), np.zeros((1, motion.dim_x))
    for k, dt in enumerate(times.tolist()):
        if dt > 0:
            F = np.atleast_3d(transition_matrices(motion, x, dt).T).T[0]
            P = F @ P0 @ F.T + motion.Q(dt)
            variance[k] = 0.5 * (P[position[0], position[0]] + P[position[1], position[1]])
    return np.asarray(variance[at.ravel()])
