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

from arrivals.measurements import all_true, is_complete
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
    products : ndarray of complex, shape (n_patterns, [n_bins,] n_sensors, n_sensors)
        Sums of the outer products, 0 for sensors without data.
    weights : ndarray, shape (n_patterns, [n_bins])
        Sums of the weights.
    squared_weight : float or ndarray, shape (n_bins,)
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
    squared_weight: float | Float = 0.0

    @classmethod
    def empty(cls, n_sensors: int, n_bins: int = 1) -> PatternSums:
        """Return sums of no snapshot; several bins have an axis of their own."""
        bins = (n_bins,) if n_bins > 1 else ()
        products = np.zeros((0, *bins, n_sensors, n_sensors), dtype=np.complex128)
        valid = np.zeros((0, n_sensors), dtype=np.bool_)
        return cls(valid, products, np.zeros((0, *bins)), np.zeros(bins) if bins else 0.0)

    @property
    def sensor_weights(self) -> Float:
        """Sum of the weights of the data of each sensor, ([n_bins,] n_sensors)."""
        if len(self.valid) == 1:  # the usual case
            return np.asarray(self.weights[0, ..., None] * self.valid[0])
        return np.asarray(self.weights.T @ self.valid)

    @property
    def n_effective(self) -> float:
        """Number of complete snapshots of equal weight with as much information, of a bin."""
        squared_weight = float(np.mean(self.squared_weight))
        if squared_weight == 0:
            return 0.0
        n_bins = np.size(self.squared_weight)
        numbers = float((self.weights.T @ self.valid.mean(axis=1)).sum() / n_bins)
        return float(self.weights.sum() / n_bins) * numbers / squared_weight

    def forget(self, factor: float) -> PatternSums:
        """Return the sums with all weights multiplied by a factor."""
        squared_weight = factor**2 * self.squared_weight
        return PatternSums(
            self.valid, factor * self.products, factor * self.weights, squared_weight
        )

    def add(self, z: Complex) -> PatternSums:
        """Return the sums with one more snapshot, or several of equal weight.

        Parameters
        ----------
        z : ndarray, shape ([n_bins,] [n_snapshots,] n_sensors)
            Snapshots, NaN where a sensor is missing.

        Returns
        -------
        PatternSums
            The sums; sets of sensors without new data come first.
        """
        if z.ndim > 1:
            return self._add_block(z)
        valid = ~np.isnan(z)
        y = np.where(valid, z, 0)
        product, squared_weight = np.multiply.outer(y, y.conj()), self.squared_weight + 1
        same = (self.valid == valid).all(axis=1)
        if len(same) == 1 and same[0]:  # the usual case
            return PatternSums(
                self.valid, self.products + product, self.weights + 1, squared_weight
            )
        return self._joined(valid[None], product[None], np.ones(1), squared_weight)

    def _add_block(self, z: Complex) -> PatternSums:
        """Return the sums with the snapshots of a step: one product for each set and bin."""
        bins, M = self.weights.shape[1:], z.shape[-1]
        Y = z.reshape(*bins, -1, M)
        if len(self.valid) == 1 and all_true(self.valid):
            products = Y.swapaxes(-1, -2) @ Y.conj()
            if is_complete(products):  # the usual case
                n = Y.shape[-2]
                return PatternSums(
                    self.valid, self.products + products, self.weights + n, self.squared_weight + n
                )
        is_valid = ~np.isnan(Y)
        has_data = is_valid.any(axis=-1)
        squared_weight = self.squared_weight + has_data.sum(axis=-1)
        if is_valid.all():
            sets, member = np.ones((1, M), dtype=np.bool_), np.ones((1, *Y.shape[:-1]))
        else:
            Y = np.where(is_valid, Y, 0)
            sets, index, numbers = np.unique(
                is_valid.reshape(-1, M), axis=0, return_inverse=True, return_counts=True
            )
            numbers = np.where(sets.any(axis=1), numbers, 0)
            kept = np.argsort(-numbers, kind="stable")[:MAX_PATTERNS]
            kept = kept[numbers[kept] > 0]
            member = (index.reshape(has_data.shape) == kept.reshape(-1, *[1] * has_data.ndim)) + 0.0
            sets = sets[kept]
        # axes: sets, bins, sensors, snapshots
        products = np.swapaxes(Y, -1, -2) @ (member[..., None] * Y.conj())
        return self._joined(sets, products, member.sum(axis=-1), squared_weight)

    def _joined(
        self, valid: Bool, products: Complex, weights: Float, squared_weight: float | Float
    ) -> PatternSums:
        """Return the sums plus those of other sets of sensors, which come last."""
        same = (self.valid[:, None] == valid).all(axis=-1)  # (old, new)
        if same.shape == (1, 1) and same[0, 0]:
            return PatternSums(
                self.valid, self.products + products, self.weights + weights, squared_weight
            )
        old = np.flatnonzero(~same.any(axis=1))
        old = old[max(len(old) + len(valid) - MAX_PATTERNS, 0) :]
        before = same.T.astype(np.float64)
        kept_products = np.tensordot(before, self.products, axes=1)
        return PatternSums(
            np.concatenate([self.valid[old], valid]),
            np.concatenate([self.products[old], kept_products + products]),
            np.concatenate([self.weights[old], np.tensordot(before, self.weights, 1) + weights]),
            squared_weight,
        )

    def select(self, sensors: Bool, bins: Bool | None = None) -> PatternSums:
        """Return the sums of some of the sensors, and of some of the bins."""
        if bins is not None and not bins.all():
            squared_weight = np.asarray(self.squared_weight)[bins]
            some = PatternSums(
                self.valid, self.products[:, bins], self.weights[:, bins], squared_weight
            )
            return some.select(sensors)
        if len(self.weights) == 1 and all_true(sensors):
            return self
        valid, index = np.unique(self.valid[:, sensors], axis=0, return_inverse=True)
        shape = (len(valid), *self.products.shape[1:-2], *2 * valid.shape[1:])
        products = np.zeros(shape, dtype=np.complex128)
        weights = np.zeros((len(valid), *self.weights.shape[1:]))
        np.add.at(products, index.ravel(), self.products[..., sensors, :][..., sensors])
        np.add.at(weights, index.ravel(), self.weights)
        has_data = valid.any(axis=1)
        return PatternSums(
            valid[has_data], products[has_data], weights[has_data], self.squared_weight
        )

    def mean_covariance(self, sensors: Bool, bins: Bool | None = None) -> Complex:
        """Return the covariance of some of the sensors, positive semidefinite.

        Parameters
        ----------
        sensors : ndarray of bool, shape (n_sensors,)
            Sensors, each with data in every one of the bins.
        bins : ndarray of bool, shape (n_bins,), optional
            Bins with data; all if None.

        Returns
        -------
        ndarray, shape ([n_bins,] n, n)
            The weighted mean of the outer products, if all snapshots are complete.
        """
        sums = self.select(sensors, bins)
        if not all_true(sums.valid):
            return expected_covariance(sums)
        if len(sums.weights) == 1:
            return sums.products[0] / sums.weights[0, ..., None, None]  # type: ignore[no-any-return]
        weight = sums.weights.sum(axis=0)
        return np.asarray(sums.products.sum(axis=0) / weight[..., None, None])


def expected_covariance(sums: PatternSums) -> Complex:
    """Return the covariance of largest likelihood of incomplete snapshots.

    Parameters
    ----------
    sums : PatternSums
        Sums of the snapshots; every sensor has data in some, in each bin.

    Returns
    -------
    ndarray, shape ([n_bins,] n_sensors, n_sensors)
        Positive semidefinite.

    References
    ----------
    Little and Rubin, *Statistical Analysis with Missing Data*, 2nd ed., 2002, sec. 11.2.2;
    the structure of plane waves in white noise: Tipping and Bishop, J. R. Stat. Soc. B 61(3), 1999.
    """
    n = sums.valid.shape[1]
    # axes: sets, bins, sensors, sensors
    products, weights = sums.products.reshape(len(sums.valid), -1, n, n), sums.weights
    weights = weights.reshape(len(weights), -1)
    is_complete, total = sums.valid.all(axis=1), weights.sum(axis=0)[:, None, None]
    complete = products[is_complete].sum(axis=0)
    o, S = sums.valid[~is_complete][:, None], products[~is_complete]
    w, diagonal = weights[~is_complete][..., None, None], np.arange(n)
    pairs = np.einsum("pf,pi,pj->fij", weights, sums.valid, sums.valid, optimize=True)
    R = products.sum(axis=0) / np.where(pairs > 0, pairs, 1.0)
    values, vectors = np.linalg.eigh(R)
    middle = np.median(values, axis=-1, keepdims=True)
    values = np.maximum(values, np.maximum(middle, 1e-3 * values[:, -1:]))
    for _ in range(MAX_ITERATIONS):
        R_white = (vectors * values[:, None]) @ vectors.conj().swapaxes(1, 2)
        R_o = o[..., None] * R_white  # rows of the valid sensors
        R_oo = R_o * o[..., None, :]
        R_oo[..., diagonal, diagonal] += ~o
        # Kᴴ = R_oo⁻¹ R_o: the conditional mean is K y, the conditional covariance R - K R_o
        KH = np.linalg.solve(R_oo, R_o)
        K = KH.conj().swapaxes(-1, -2)
        expected = K @ S @ KH + w * (R_white - K @ R_o)
        last, R = R, (complete + expected.sum(axis=0)) / total
        R = (R + R.conj().swapaxes(1, 2)) / 2
        change, largest = np.abs(R - last).max(axis=(1, 2)), np.abs(R).max(axis=(1, 2))
        if (change <= TOLERANCE * largest).all():
            break
        values, vectors = np.linalg.eigh(R)
        n_sources = number_of_sources(values[:, ::-1], max(sums.n_effective, 1.0))
        # plane waves in white noise: the smallest eigenvalues are equal
        is_noise = np.arange(n) < n - n_sources[:, None]
        noise = np.where(is_noise, values, 0).sum(axis=1) / is_noise.sum(axis=1)
        noise = np.maximum(noise, MIN_RELATIVE_NOISE * values[:, -1])
        values = np.where(is_noise, noise[:, None], values)
    return np.asarray(R.reshape(sums.products.shape[1:]))
