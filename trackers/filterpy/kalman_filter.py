"""Kalman filter with filterpy's constructor."""

from __future__ import annotations

from typing import ClassVar

from numpy.typing import ArrayLike

from arrivals.trackers.filterpy.dimensions import LinearByDimensions
from arrivals.trackers.gaussian.kalman import Kalman


class KalmanFilter(LinearByDimensions, Kalman):
    """Kalman filter that is constructed as `filterpy.kalman.KalmanFilter`.

    Parameters
    ----------
    dim_x, dim_z : int
        Numbers of entries of state and measurement.
    dim_u : int
        Number of control inputs; `B` is assigned.

    Examples
    --------
    >>> import numpy as np
    >>> kf = KalmanFilter(dim_x=2, dim_z=1)
    >>> kf.x, kf.P = np.array([0.0, 1.0]), 10.0
    >>> kf.F[0, 1] = 1.0
    >>> kf.H = np.array([[1.0, 0.0]])
    >>> kf.Q *= 0.01
    >>> kf.predict()
    >>> kf.update(2.0)
    >>> kf.x.round(2)
    array([1.95, 1.48])
    """

    plain: ClassVar[type[Kalman]] = Kalman
    linear_steps = True  # `predict` differs in the order of its arguments alone

    def predict(
        self,
        u: ArrayLike | None = None,
        B: ArrayLike | None = None,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
        *,
        dt: float = 1.0,
    ) -> None:
        """Predict mean and covariance; parameters as in `GaussianFilter.predict`."""
        super().predict(u, dt=dt, F=F, Q=Q, B=B)
