"""The covariance of snapshots: a running one, and one smoothed over subarrays."""

from __future__ import annotations

import numpy as np

from arrivals.typing import Complex, Float
from arrivals.validation import count


def smoothed(R: Complex, length: int, *, backward: bool = False) -> Complex:
    """Average the covariance of a uniform line over its subarrays of `length` sensors.

    Echoes of one source are coherent and span one dimension; each subarray hears them with other
    phases, and the average spans as many as there are subarrays, twice that with `backward`.

    Parameters
    ----------
    R : ndarray, shape (..., n_sensors, n_sensors)
        Sensors in the order of the line.
    length : int
        At least 1, at most n_sensors.
    backward : bool
        Average with J R* J too, what the line hears when it is read from its other end.

    Returns
    -------
    ndarray, shape (..., length, length)

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
    >>> smoothed(np.diag([1.0, 2.0, 6.0]), 2).real
    array([[1.5, 0. ],
           [0. , 4. ]])
    >>> smoothed(np.diag([1.0, 2.0, 6.0]), 2, backward=True).real
    array([[2.75, 0.  ],
           [0.  , 2.75]])
    """
    n = R.shape[-1]
    if count("length", length) > n:
        raise ValueError(f"length must be at most n_sensors, {n}; got {length}")
    starts = range(n - length + 1)
    mean = sum(R[..., s : s + length, s : s + length] for s in starts) / len(starts)
    mean = np.asarray(mean, dtype=np.complex128)
    return (mean + mean.conj()[..., ::-1, ::-1]) / 2 if backward else mean


class RunningCovariance:
    """What a tracker has whose belief is the covariance of the snapshots, the past fading.

    Each pair of sensors is averaged over the snapshots in which both were heard.

    Attributes
    ----------
    forgetting : float
        Weight that the past keeps from step to step.
    covariance : ndarray, shape (n_sensors, n_sensors)
        Weighted sum of the snapshots' outer products.
    weight : ndarray, shape (n_sensors, n_sensors)
        Sum of the weights, for each pair of sensors.

    Examples
    --------
    >>> running = RunningCovariance()
    >>> running.forgetting = 0.5
    >>> running._know_nothing(2)
    >>> for z in ([1.0, 1j], [3.0, np.nan]):
    ...     running._fade(1.0)
    ...     running._add(np.array(z))
    >>> running._mean().real.round(3)
    array([[6.333, 0.   ],
           [0.   , 1.   ]])
    """

    forgetting: float
    covariance: Complex
    weight: Float

    def _know_nothing(self, n_sensors: int) -> None:
        shape = (n_sensors, n_sensors)
        self.covariance, self.weight = np.zeros(shape, dtype=np.complex128), np.zeros(shape)

    def _fade(self, dt: float) -> None:
        fading = self.forgetting**dt
        self.covariance, self.weight = fading * self.covariance, fading * self.weight

    def _add(self, z: Complex) -> None:
        """Add a snapshot, NaN where a sensor was not heard."""
        heard = ~np.isnan(z)
        y = np.where(heard, z, 0)
        self.covariance = self.covariance + np.multiply.outer(y, y.conj())
        self.weight = self.weight + np.multiply.outer(heard, heard)

    def _mean(self) -> Complex:
        return np.asarray(self.covariance / np.where(self.weight > 0, self.weight, 1.0))
