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
        """Weighted sum of the snapshots' outer products, (n_sensors, n_sensors)."""
        return np.asarray(self.sums.products.sum(axis=0))

    def reset_covariance(self, n_sensors: int) -> None:
        """Set sums and weights to zero."""
        self.sums = PatternSums.empty(n_sensors)

    def apply_forgetting(self, dt: float) -> None:
        """Multiply sums and weights by forgetting^dt."""
        self.sums = self.sums.forget(self.forgetting**dt)

    def add_snapshot(self, z: Complex) -> None:
        """Add the outer product of a snapshot, NaN where a sensor has no valid data."""
        self.sums = self.sums.add(z)

    def sensors_with_data(self) -> Bool:
        """Return the sensors with enough data, relative to the others, (n_sensors,)."""
        return has_enough_data(self.sums.sensor_weights)

    def mean_covariance(self, sensors: Bool) -> Complex:
        """Return the mean covariance of some sensors with data, positive semidefinite: (n, n)."""
        return self.sums.mean_covariance(sensors)


def has_enough_data(weights: Float) -> Bool:
    """Return the sensors whose data have enough weight, at least 0.3 of the largest.

    Examples
    --------
    >>> has_enough_data(np.array([20.0, 5.0, 7.0, 0.0]))
    array([ True, False,  True, False])
    """
    return np.asarray((weights > 0) & (weights >= MIN_RELATIVE_WEIGHT * weights.max()))
