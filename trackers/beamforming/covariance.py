"""Sample covariances: running averages, spatial smoothing, diagonal loading."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.beamforming.incomplete import PatternSums
from arrivals.typing import Bool, Complex, Float
from arrivals.validation import count

MIN_RELATIVE_WEIGHT = 0.3  # of the data of a sensor, relative to that with most data


def diagonal_loading(R: Complex | Float, loading: float) -> Complex | Float:
    """Return covariances with `loading` times their mean power added to the diagonal.

    Parameters
    ----------
    R : ndarray, shape (..., n_sensors, n_sensors)
        Covariances.
    loading : float
        Relative to the mean of the diagonal.

    Returns
    -------
    ndarray, shape (..., n_sensors, n_sensors)
        Loaded covariances.

    Examples
    --------
    >>> diagonal_loading(np.ones((2, 2)), 0.5)
    array([[1.5, 1. ],
           [1. , 1.5]])
    """
    n = R.shape[-1]
    power = np.trace(R, axis1=-2, axis2=-1).real / n
    return np.asarray(R + loading * power[..., None, None] * np.eye(n))


def spatial_smoothing(R: Complex, length: int, *, backward: bool = False) -> Complex:
    """Average the covariance of a uniform line over its subarrays of `length` sensors.

    Echoes of one source are coherent and span one dimension; each subarray receives them with
    other phases, and the average spans as many dimensions as there are subarrays, twice that with
    `backward`.

    Parameters
    ----------
    R : ndarray, shape (..., n_sensors, n_sensors)
        Covariances; sensors in the order of the line.
    length : int
        Sensors of a subarray; at least 1, at most n_sensors.
    backward : bool
        Average with J R* J too: the covariance of the line in reversed order.

    Returns
    -------
    ndarray, shape (..., length, length)
        Smoothed covariances.

    Raises
    ------
    ValueError
        If the line has no subarray of that length.

    References
    ----------
    Shan, Wax and Kailath, "On spatial smoothing for direction-of-arrival estimation of coherent
    signals", IEEE Trans. ASSP 33(4), 1985, (13); backward: Pillai and Kwon, IEEE Trans. ASSP
    37(1), 1989, (12).

    Examples
    --------
    >>> spatial_smoothing(np.diag([1.0, 2.0, 6.0]), 2).real
    array([[1.5, 0. ],
           [0. , 4. ]])
    >>> spatial_smoothing(np.diag([1.0, 2.0, 6.0]), 2, backward=True).real
    array([[2.75, 0.  ],
           [0.  , 2.75]])
    """
    n = R.shape[-1]
    if count("length", length) > n:
        raise ValueError(f"length must be at most n_sensors, {n}; got {length}")
    starts = range(n - length + 1)
    mean = sum(R[..., s : s + length, s : s + length] for s in starts) / len(starts)  # (13)
    mean = np.asarray(mean, dtype=np.complex128)
    return (mean + mean.conj()[..., ::-1, ::-1]) / 2 if backward else mean  # (12)


class RunningCovariance:
    """Mixin of trackers with an exponentially weighted covariance of the snapshots.

    Attributes
    ----------
    forgetting : float
        Weight of the past after one unit of time.
    sums : PatternSums
        Weighted sums of the snapshots' outer products, for each set of sensors with data.

    Examples
    --------
    >>> running = RunningCovariance()
    >>> running.forgetting = 0.5
    >>> running.reset_covariance(2)
    >>> for z in ([1.0, 1j], [3.0, 3j]):
    ...     running.apply_forgetting(1.0)
    ...     running.add_snapshot(np.array(z))
    >>> running.mean_covariance(running.sensors_with_data()).real.round(3)
    array([[6.333, 0.   ],
           [0.   , 6.333]])
    """

    forgetting: float
    sums: PatternSums

    @property
    def covariance(self) -> Complex:
        """Weighted sum of the snapshots' outer products, ([n_bins,] n_sensors, n_sensors)."""
        return np.asarray(self.sums.products.sum(axis=0))

    def reset_covariance(self, n_sensors: int, n_bins: int = 1) -> None:
        """Set sums and weights to zero."""
        self.sums = PatternSums.empty(n_sensors, n_bins)

    def fit_covariance(self, n_sensors: int, n_bins: int) -> None:
        """Set sums to zero if they are those of another number of sensors or bins."""
        bins = (n_bins,) if n_bins > 1 else ()
        if self.sums.products.shape[1:] != (*bins, n_sensors, n_sensors):
            self.reset_covariance(n_sensors, n_bins)

    def apply_forgetting(self, dt: float) -> None:
        """Multiply sums and weights by forgetting^dt."""
        self.sums = self.sums.forget(self.forgetting**dt)

    def add_snapshot(self, z: Complex) -> None:
        """Add the outer products of a step, of any shape of `ArraySnapshot`; NaN is missing."""
        self.sums = self.sums.add(z)

    def add_block(self, Y: Complex) -> None:
        """Add the snapshots of a step, (n_bins, n_sensors, n_snapshots)."""
        rows = np.swapaxes(Y, 1, 2)
        self.sums = self.sums.add(rows if len(rows) > 1 else rows[0])

    def data_weights(self) -> Float:
        """Return the sum of weights of the data of each sensor, ([n_bins,] n_sensors).

        With several bins, that of a sensor of zeros alone in a bin is zero.
        """
        weights = self.sums.sensor_weights
        if weights.ndim == 1:
            return weights
        power = np.diagonal(self.sums.products, axis1=-2, axis2=-1).real.sum(axis=0)
        return np.asarray(np.where(power > 0, weights, 0.0))

    def sensors_with_data(self) -> Bool:
        """Return the sensors with enough data, relative to the others, (n_sensors,)."""
        return used_data(self.data_weights())[0]

    def mean_covariance(self, sensors: Bool, bins: Bool | None = None) -> Complex:
        """Return the mean covariance of some sensors and bins, positive semidefinite."""
        return self.sums.mean_covariance(sensors, bins)


def has_enough_data(weights: Float) -> Bool:
    """Return the sensors whose data have enough weight, at least 0.3 of the largest.

    Examples
    --------
    >>> has_enough_data(np.array([20.0, 5.0, 7.0, 0.0]))
    array([ True, False,  True, False])
    """
    largest = weights.max()
    return weights >= (MIN_RELATIVE_WEIGHT * largest if largest > 0 else np.inf)


def used_data(weights: Float) -> tuple[Bool, Bool | None]:
    """Return the sensors and the bins with enough data.

    Parameters
    ----------
    weights : ndarray, shape (n_sensors,) or (n_bins, n_sensors)
        Sums of the weights of the data.

    Returns
    -------
    sensors : ndarray of bool, shape (n_sensors,)
        Sensors with enough data, relative to the others.
    bins : ndarray of bool, shape (n_bins,), or None
        Bins in which each of these sensors has enough; None if bins have no axis. Where bins lack
        different sensors, the larger part of the data is used.

    Examples
    --------
    >>> used_data(np.array([[9.0, 9.0], [9.0, 8.0], [9.0, 0.0]]))
    (array([ True,  True]), array([ True,  True, False]))
    """
    if weights.ndim == 1:
        return has_enough_data(weights), None
    has_enough = has_enough_data(weights)
    # the sensors that are there in most bins, in the bins that have all of them
    sensors = has_enough_data(weights.sum(axis=0))
    bins = np.asarray(sensors.any() & has_enough[:, sensors].all(axis=1))
    # the bins with any data, by the sensors that all of them have
    all_bins = np.asarray(has_enough.any(axis=1))
    common = np.asarray(all_bins.any() & has_enough[all_bins].all(axis=0))
    if bins.sum() * sensors.sum() >= all_bins.sum() * common.sum():
        return sensors, bins
    return common, all_bins
