"""Filters of filterpy with the models of this library; filterpy is imported when one is made."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.arguments import check_models
from arrivals.trackers.gaussian.circular import Angles, add, difference, mean
from arrivals.trackers.gaussian.kalman import check_linear
from arrivals.typing import Float
from arrivals.validation import covariance, one_of, positive, shaped

Kind = Literal["kf", "ekf", "ukf", "ckf", "enkf"]


def as_filterpy(
    motion: MotionModel,
    measurement: MeasurementModel,
    kind: Kind = "ukf",
    *,
    x: ArrayLike,
    P: ArrayLike,
    dt: float = 1.0,
    n_members: int = 100,
) -> Any:
    """Return a filter of filterpy that is ready for `predict()` and `update(z)`.

    Parameters
    ----------
    motion : MotionModel
        Motion of the state.
    measurement : MeasurementModel
        Measurement of a state of that motion.
    kind : {"kf", "ekf", "ukf", "ckf", "enkf"}
        `KalmanFilter` (linear models), `ExtendedKalmanFilter`, `UnscentedKalmanFilter`,
        `CubatureKalmanFilter`, `EnsembleKalmanFilter` (which draws from numpy's global generator).
    x : array_like, shape (n,)
        Initial mean.
    P : array_like, shape (n, n)
        Initial covariance.
    dt : float
        Length of a step.
    n_members : int
        Size of the ensemble of "enkf".

    Returns
    -------
    object
        The filter. That of "ekf" is an instance of a subclass that holds the models.

    Raises
    ------
    ValueError, TypeError
        If an argument does not fit, or the models of a "kf" are not linear.

    Warns
    -----
    UserWarning
        If the state has angles, which filterpy averages without wrapping.

    Examples
    --------
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> from arrivals.motion_models import ConstantVelocity
    >>> position = LinearMeasurement([[1.0, 0.0]], [[1.0]])
    >>> kf = as_filterpy(ConstantVelocity(0.1, 1), position, "kf", x=[0.0, 1.0], P=np.eye(2))
    >>> kf.predict()
    >>> kf.update(2.0)
    >>> kf.x.round(2)
    array([1.67, 1.35])
    """
    motion, measurement = check_models(motion, measurement)
    one_of("kind", kind, ("kf", "ekf", "ukf", "ckf", "enkf"))
    x0, P = shaped("x", x, motion.dim_x).copy(), covariance("P", P, motion.dim_x).copy()
    if motion.angles:
        warnings.warn(_angle_warning(kind, motion.angles), UserWarning, stacklevel=2)
    makers: dict[str, Callable[..., Any]] = {
        "kf": _kf, "ekf": _ekf, "ukf": _ukf, "ckf": _ckf, "enkf": partial(_enkf, N=n_members),
    }  # fmt: skip
    filter_ = makers[kind](motion, measurement, x0, P, positive("dt", dt))
    filter_.x, filter_.P, filter_.Q, filter_.R = x0, P, motion.Q(dt), measurement.R
    filter_.x_prior, filter_.x_post, filter_.P_prior, filter_.P_post = +x0, +x0, +P, +P
    return filter_


def _angle_warning(kind: Kind, angles: Angles) -> str:
    others = "" if kind == "ukf" else f", and its {kind} adds and averages them without wrapping"
    return (
        f"entries {angles} of the state are angles: filterpy's IMMEstimator and MMAEFilterBank "
        f"average +-(pi - 0.05) to 0{others}; IMM, EKF and UKF of arrivals.trackers wrap them"
    )


def _kf(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float) -> Any:
    from filterpy.kalman import KalmanFilter

    check_linear(motion, measurement, dt)
    B = getattr(motion, "control", None)
    filter_ = KalmanFilter(motion.dim_x, measurement.dim_z, 0 if B is None else B.shape[1])
    filter_.F, filter_.H, filter_.B = motion.F(x, dt), measurement.H(x), B
    return filter_


def _ekf(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float) -> Any:
    return make_ekf(motion, measurement, dt)


def make_ekf(motion: MotionModel, measurement: MeasurementModel, dt: float) -> Any:
    """Return filterpy's extended Kalman filter with two models.

    Examples
    --------
    >>> from arrivals.measurement_models import Bearing
    >>> from arrivals.motion_models import RandomWalk
    >>> ekf = make_ekf(RandomWalk(q=0.1), Bearing([[0.0, 0.0]], 0.01, position=(0, 1)), 1.0)
    >>> ekf.x = np.array([1.0, 1.0])
    >>> ekf.predict()
    >>> ekf.update(0.7)
    >>> ekf.x.round(2)
    array([1.08, 0.92])
    """
    return _ekf_class()(motion, measurement, dt)


@cache
def _ekf_class() -> Any:
    from filterpy.kalman import ExtendedKalmanFilter

    class ModelEKF(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy has no types
        """filterpy's filter; `predict()` and `update(z)` use the models."""

        def __init__(self, motion: MotionModel, measurement: MeasurementModel, dt: float) -> None:
            super().__init__(motion.dim_x, measurement.dim_z)
            self.motion, self.measurement, self.dt = motion, measurement, dt
            self.x = np.zeros(motion.dim_x)
            self.F, self.Q, self.R = motion.F(self.x, dt), motion.Q(dt), measurement.R

        def predict_x(self, u: Any = 0) -> None:
            """Predict the mean by `f`, and set `F` to its Jacobian for the covariance."""
            self.F = self.motion.F(self.x, self.dt)
            self.x = self.motion.f(self.x, self.dt) + np.dot(self.B, u)

        def update(self, z: Any, *args: Any, **kwargs: Any) -> None:
            """Update by a measurement; further arguments are those of filterpy."""
            if not args:
                kwargs.setdefault("HJacobian", self.measurement.H)
                kwargs.setdefault("Hx", self.measurement.h)
                kwargs.setdefault("residual", self.measurement.residual)
            super().update(z, *args, **kwargs)

        def __reduce__(self) -> tuple[Any, ...]:
            from arrivals.trackers.gaussian.filterpy_adapter import make_ekf  # as pickle finds it

            return make_ekf, (self.motion, self.measurement, self.dt), vars(self)

    return ModelEKF


def _ukf(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float) -> Any:
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    angles, n = motion.angles, motion.dim_x
    on_circle: dict[str, Any] = {"residual_z": measurement.residual}
    if angles:
        on_circle |= {
            "x_mean_fn": partial(mean, angles=angles),
            "residual_x": partial(difference, angles=angles),
            "state_add": partial(add, angles=angles),
        }
    points = MerweScaledSigmaPoints(n, alpha=0.5, beta=2.0, kappa=0.0)
    filter_ = UnscentedKalmanFilter(
        n, measurement.dim_z, dt, measurement.h, motion.f, points,
        z_mean_fn=partial(_measurement_mean, measurement), **on_circle,
    )  # fmt: skip
    filter_.sigmas_f = points.sigma_points(x, P)
    return filter_


def _measurement_mean(measurement: MeasurementModel, points: Float, weights: Float) -> Float:
    """Return the mean of measurements (m, dim_z), by residuals from the first."""
    return np.asarray(points[0] + weights @ measurement.residual(points, points[0]))


def _ckf(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float) -> Any:
    from filterpy.kalman import CubatureKalmanFilter

    return CubatureKalmanFilter(
        motion.dim_x, measurement.dim_z, dt, measurement.h, motion.f,
        residual_z=partial(_column_residual, measurement),
    )  # fmt: skip


def _column_residual(measurement: MeasurementModel, z: Float, z_pred: Float) -> Float:
    """Return the residual as a column, as filterpy's CKF does with x."""
    return measurement.residual(np.ravel(z), np.ravel(z_pred))[:, None]


def _enkf(
    motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float, N: int
) -> Any:
    from filterpy.kalman import EnsembleKalmanFilter

    return EnsembleKalmanFilter(x, P, measurement.dim_z, dt, N, measurement.h, motion.f)
