"""Extended Kalman filter with filterpy's constructor."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.linear import LinearMeasurement
from arrivals.trackers.filterpy.dimensions import LinearByDimensions
from arrivals.trackers.gaussian.ekf import EKF
from arrivals.trackers.gaussian.filterpy_names.function_updates import has_functions


class ExtendedKalmanFilter(LinearByDimensions, EKF):
    """Extended Kalman filter that is constructed as `filterpy.kalman.ExtendedKalmanFilter`.

    The motion is linear, by the matrix `F`; a subclass may define `predict_x` instead, the
    prediction of the mean. The measurement function is an argument of each update.

    Parameters
    ----------
    dim_x, dim_z : int
        Numbers of entries of state and measurement.
    dim_u : int
        Number of control inputs; `B` is assigned.

    Examples
    --------
    >>> ekf = ExtendedKalmanFilter(dim_x=1, dim_z=1)
    >>> ekf.x = np.array([2.0])
    >>> ekf.predict()
    >>> ekf.update(6.25, HJacobian=lambda x: np.array([2 * x]), Hx=np.square)
    >>> ekf.x.round(2)
    array([2.55])
    """

    plain: ClassVar[type[EKF]] = EKF

    def predict(self, u: ArrayLike | None = None, **step: Any) -> None:
        """Predict mean and covariance; parameters as in `GaussianFilter.predict`."""
        before = dict(vars(self))
        try:
            super().predict(u, **step)
            if type(self).predict_x is not ExtendedKalmanFilter.predict_x:
                P = self.P
                self.x, self.P = before["x"], before["P"]
                self.predict_x(u)
                self.record_prediction(np.ravel(self.x), P, self.last_dt)
        except Exception:
            vars(self).update(before)
            raise

    def update(self, z: ArrayLike | None, *arguments: Any, **named: Any) -> None:
        """Update mean and covariance by a measurement.

        Parameters
        ----------
        z : array_like, shape (m,) or (m, 1), or float
            None or NaN where it is missing; the valid entries are used.
        *arguments, **named
            HJacobian, Hx, R, args, hx_args, residual, as in filterpy; or those of `EKF.update`,
            once `measurement` or `H` was assigned.

        Raises
        ------
        TypeError
            If there is no measurement function.
        """
        model = self.measurement
        without = isinstance(model, LinearMeasurement) and not model.matrix.any()
        if without and not has_functions(arguments, named) and named.get("H") is None:
            raise TypeError("update must be called with HJacobian and Hx, or assign measurement")
        super().update(z, *arguments, **named)
