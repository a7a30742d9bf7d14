"""Sample covariances: running averages, spatial smoothing, diagonal loading."""

from __future__ import annotations

import numpy as np

from arrivals.typing import Complex, Float
from arrivals.validation import count


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

    Each pair of sensors is averaged over the snapshots in which both have valid data.

    Attributes
    ----------
    forgetting : float
        Weight of the past after one unit of time.
    covariance : ndarray, shape (n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products.
    weight : ndarray, shape (n_sensors, n_sensors)
        Sum of the weights, for each pair of sensors.

    Examples
    --------
    >>> running = RunningCovariance()
    >>> running.forgetting = 0.5
    >>> running.reset_covariance(2)
    >>> for z in ([1.0, 1j], [3.0, np.nan]):
    ...     running.apply_forgetting(1.0)
    ...     running.add_snapshot(np.array(z))
    >>> running.mean_covariance().real.round(3)
    array([[6.333, 0.   ],
           [0.   , 1.   ]])
    """

    forgetting: float
    covariance: Complex
    weight: Float

    def reset_covariance(self, n_sensors: int) -> None:
        """Set sums and weights to zero."""
        shape = (n_sensors, n_sensors)
        self.covariance, self.weight = np.zeros(shape, dtype=np.complex128), np.zeros(shape)

    def apply_forgetting(self, dt: float) -> None:
        """Multiply sums and weights by forgetting^dt."""
        factor = self.forgetting**dt
        self.covariance, self.weight = factor * self.covariance, factor * self.weight

    def add_snapshot(self, z: Complex) -> None:
        """Add the outer product of a snapshot, NaN where a sensor has no valid data."""
        valid = ~np.isnan(z)
        y = np.where(valid, z, 0)
        self.covariance = self.covariance + np.multiply.outer(y, y.conj())
        self.weight = self.weight + np.multiply.outer(valid, valid)

    def mean_covariance(self) -> Complex:
        """Return the weighted mean, (n_sensors, n_sensors); 0 for pairs without data."""
        return np.asarray(self.covariance / np.where(self.weight > 0, self.weight, 1.0))
