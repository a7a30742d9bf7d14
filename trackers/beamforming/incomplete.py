"""Covariance of snapshots of which some sensors are missing.

The snapshots are summed for each set of sensors that had data together. Where sets differ, the
covariance is the one of largest likelihood under plane waves in white noise, by the
expectation-maximization algorithm: each missing sensor is replaced by its conditional mean, and
its conditional covariance is added. Means of the pairs that are there are not semidefinite: their
negative and raised eigenvalues count as sources.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.trackers.beamforming.source_number import number_of_sources
from arrivals.typing import Bool, Complex, Float

MAX_PATTERNS = 64  # sets of sensors; those without new data for longest are dropped
MAX_ITERATIONS = 20
TOLERANCE = 1e-3  # change of the covariance, relative to its largest entry
MIN_RELATIVE_NOISE = 1e-12  # of the largest eigenvalue: snapshots without noise


@dataclass(frozen=True, eq=False)
class PatternSums:
    """Weighted sums of outer products of snapshots, for each set of valid sensors.

    Parameters
    ----------
    valid : ndarray of bool, shape (n_patterns, n_sensors)
        Sensors with data.
    products : ndarray of complex, shape (n_patterns, n_sensors, n_sensors)
        Sums of the outer products, 0 for sensors without data.
    weights : ndarray, shape (n_patterns,)
        Sums of the weights.
    squared_weight : float
        Sum of the squared weights of all snapshots.

    Examples
    --------
    >>> sums = PatternSums.empty(2).add(np.array([1.0, 1j])).forget(0.5)
    >>> sums = sums.add(np.array([3.0, np.nan]))
    >>> sums.sensor_weights, sums.mean_covariance(np.array([True, False])).real.round(3)
    (array([1.5, 0.5]), array([[6.333]]))
    """

    valid: Bool
    products: Complex
    weights: Float
    squared_weight: float = 0.0

    @classmethod
    def empty(cls, n_sensors: int) -> PatternSums:
        """Return sums of no snapshot."""
        products = np.zeros((0, n_sensors, n_sensors), dtype=np.complex128)
        return cls(np.zeros((0, n_sensors), dtype=np.bool_), products, np.zeros(0))

    @property
    def sensor_weights(self) -> Float:
        """Sum of the weights of the data of each sensor, (n_sensors,)."""
        return np.asarray(self.weights @ self.valid)

    @property
    def n_effective(self) -> float:
        """Number of complete snapshots of equal weight with as much information."""
        if self.squared_weight == 0:
            return 0.0
        numbers = float(self.weights @ self.valid.mean(axis=1))
        return float(self.weights.sum()) * numbers / self.squared_weight

    def forget(self, factor: float) -> PatternSums:
        """Return the sums with all weights multiplied by a factor."""
        squared_weight = factor**2 * self.squared_weight
        return PatternSums(
            self.valid, factor * self.products, factor * self.weights, squared_weight
        )

    def add(self, z: Complex) -> PatternSums:
        """Return the sums with one more snapshot, (n_sensors,), NaN where a sensor is missing."""
        valid = ~np.isnan(z)
        y = np.where(valid, z, 0)
        product, squared_weight = np.multiply.outer(y, y.conj()), self.squared_weight + 1
        same = (self.valid == valid).all(axis=1)
        if len(same) == 1 and same[0]:  # the usual case
            return PatternSums(
                self.valid, self.products + product, self.weights + 1, squared_weight
            )
        # the set of this snapshot comes last
        old = np.flatnonzero(~same)[-(MAX_PATTERNS - 1) :]
        return PatternSums(
            np.concatenate([self.valid[old], valid[None]]),
            np.concatenate([self.products[old], (self.products[same].sum(axis=0) + product)[None]]),
            np.append(self.weights[old], self.weights[same].sum() + 1),
            squared_weight,
        )

    def select(self, sensors: Bool) -> PatternSums:
        """Return the sums of some of the sensors."""
        if sensors.all() and len(self.weights) == 1:
            return self
        valid, index = np.unique(self.valid[:, sensors], axis=0, return_inverse=True)
        products = np.zeros((len(valid), *2 * valid.shape[1:]), dtype=np.complex128)
        weights = np.zeros(len(valid))
        np.add.at(products, index.ravel(), self.products[:, sensors][:, :, sensors])
        np.add.at(weights, index.ravel(), self.weights)
        has_data = valid.any(axis=1)
        return PatternSums(
            valid[has_data], products[has_data], weights[has_data], self.squared_weight
        )

    def mean_covariance(self, sensors: Bool) -> Complex:
        """Return the covariance of some of the sensors, positive semidefinite.

        Parameters
        ----------
        sensors : ndarray of bool, shape (n_sensors,)
            Sensors, each with data.

        Returns
        -------
        ndarray, shape (n, n)
            The weighted mean of the outer products, if all snapshots are complete.
        """
        sums = self.select(sensors)
        if sums.valid.all():
            return np.asarray(sums.products.sum(axis=0) / sums.weights.sum())
        return expected_covariance(sums)


def expected_covariance(sums: PatternSums) -> Complex:
    """Return the covariance of largest likelihood of incomplete snapshots.

    Parameters
    ----------
    sums : PatternSums
        Sums of the snapshots; every sensor has data in some.

    Returns
    -------
    ndarray, shape (n_sensors, n_sensors)
        Positive semidefinite.

    References
    ----------
    Little and Rubin, *Statistical Analysis with Missing Data*, 2nd ed., 2002, sec. 11.2.2;
    the structure of plane waves in white noise: Tipping and Bishop, J. R. Stat. Soc. B 61(3), 1999.
    """
    is_complete = sums.valid.all(axis=1)
    complete = sums.products[is_complete].sum(axis=0)
    o, S, w = sums.valid[~is_complete], sums.products[~is_complete], sums.weights[~is_complete]
    n, diagonal = o.shape[1], np.arange(o.shape[1])
    pairs = np.einsum("p,pi,pj->ij", sums.weights, sums.valid, sums.valid, optimize=True)
    R = sums.products.sum(axis=0) / np.where(pairs > 0, pairs, 1.0)
    values, vectors = np.linalg.eigh(R)
    values = np.maximum(values, max(float(np.median(values)), 1e-3 * float(values[-1])))
    for _ in range(MAX_ITERATIONS):
        R_white = (vectors * values) @ vectors.conj().T
        R_o = o[:, :, None] * R_white  # rows of the valid sensors
        R_oo = R_o * o[:, None, :]
        R_oo[:, diagonal, diagonal] += ~o
        # Kᴴ = R_oo⁻¹ R_o: the conditional mean is K y, the conditional covariance R - K R_o
        KH = np.linalg.solve(R_oo, R_o)
        K = KH.conj().swapaxes(1, 2)
        expected = K @ S @ KH + w[:, None, None] * (R_white - K @ R_o)
        last, R = R, (complete + expected.sum(axis=0)) / sums.weights.sum()
        R = (R + R.conj().T) / 2
        if np.abs(R - last).max() <= TOLERANCE * np.abs(R).max():
            break
        values, vectors = np.linalg.eigh(R)
        n_sources = int(number_of_sources(values[::-1], max(sums.n_effective, 1.0)))
        # plane waves in white noise: the smallest eigenvalues are equal
        noise = float(values[: n - n_sources].mean())
        values[: n - n_sources] = max(noise, MIN_RELATIVE_NOISE * float(values[-1]))
    return np.asarray(R)
