"""filterpy's extended Kalman filter with two models built in. Importing this imports filterpy."""

from __future__ import annotations

from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel


class ModelEKF(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy has no types
    """filterpy's filter; `predict()` and `update(z)` use the models.

    Parameters
    ----------
    motion : MotionModel
    measurement : MeasurementModel
    dt : float
        Length of a step.

    Examples
    --------
    >>> from arrivals.measurement_models import Bearing
    >>> from arrivals.motion_models import RandomWalk
    >>> ekf = ModelEKF(RandomWalk(q=0.1), Bearing([[0.0, 0.0]], 0.01, position=(0, 1)))
    >>> ekf.x = np.array([1.0, 1.0])
    >>> ekf.predict()
    >>> ekf.update(0.7)
    >>> ekf.x.round(2)
    array([1.08, 0.92])
    """

    def __init__(self, motion: MotionModel, measurement: MeasurementModel, dt: float = 1.0) -> None:
        super().__init__(motion.dim_x, measurement.dim_z)
        self.motion, self.measurement, self.dt = motion, measurement, dt
        self.x = np.zeros(motion.dim_x)
        self.F, self.Q, self.R = motion.F(self.x, dt), motion.Q(dt), measurement.R

    def predict_x(self, u: Any = 0) -> None:
        """Move the mean by `f`, and leave its Jacobian in `F` for the covariance."""
        self.F = self.motion.F(self.x, self.dt)
        self.x = self.motion.f(self.x, self.dt) + np.dot(self.B, u)

    def update(self, z: Any, *args: Any, **kwargs: Any) -> None:
        """Correct by a measurement; filterpy's further arguments are taken as there."""
        if not args:
            kwargs.setdefault("HJacobian", self.measurement.H)
            kwargs.setdefault("Hx", self.measurement.h)
            kwargs.setdefault("residual", self.measurement.residual)
        super().update(z, *args, **kwargs)
