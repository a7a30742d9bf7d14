"""Our models in filterpy's filters, for scripts that stay there."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
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
    """Return a filter of filterpy's that is ready for `predict()` and `update(z)`.

    Parameters
    ----------
    motion : MotionModel
    measurement : MeasurementModel
    kind : {"kf", "ekf", "ukf", "ckf", "enkf"}
        `KalmanFilter` (linear models), `ExtendedKalmanFilter`, `UnscentedKalmanFilter`,
        `CubatureKalmanFilter`, `EnsembleKalmanFilter` (which draws from numpy's global generator).
    x : array_like, shape (n,)
        Mean.
    P : array_like, shape (n, n)
        Covariance.
    dt : float
        Length of a step.
    n_members : int
        Size of the ensemble of `enkf`.

    Returns
    -------
    object
        The filter. The EKF is a subclass that knows its models.

    Raises
    ------
    ValueError, TypeError
        If a part does not fit, or the models of a `kf` are not linear.

    Warns
    -----
    UserWarning
        If the state has angles: what filterpy will do to them, and which tracker of ours does not.

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
    centre, P = shaped("x", x, motion.dim_x).copy(), covariance("P", P, motion.dim_x).copy()
    if motion.angles:
        warnings.warn(_angle_warning(kind, motion.angles), UserWarning, stacklevel=2)
    makers: dict[str, Callable[..., Any]] = {
        "kf": _kf, "ekf": _ekf, "ukf": _ukf, "ckf": _ckf, "enkf": partial(_enkf, N=n_members),
    }  # fmt: skip
    made = makers[kind](motion, measurement, centre, P, positive("dt", dt))
    made.x, made.P, made.Q, made.R = centre, P, motion.Q(dt), measurement.R
    made.x_prior, made.x_post, made.P_prior, made.P_post = +centre, +centre, +P, +P
    return made


def _angle_warning(kind: Kind, angles: Angles) -> str:
    alone = "" if kind == "ukf" else f", and its {kind} adds and averages them without wrapping"
    return (
        f"entries {angles} of the state are angles: filterpy's IMMEstimator and MMAEFilterBank "
        f"average +-(pi - 0.05) to 0{alone}; IMM, EKF and UKF of arrivals.trackers take the circle"
    )


def _kf(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float) -> Any:
    from filterpy.kalman import KalmanFilter

    check_linear(motion, measurement, dt)
    B = getattr(motion, "control", None)
    made = KalmanFilter(motion.dim_x, measurement.dim_z, 0 if B is None else B.shape[1])
    made.F, made.H, made.B = motion.F(x, dt), measurement.H(x), B
    return made


def _ekf(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float) -> Any:
    from arrivals.trackers.gaussian.filterpy_ekf import ModelEKF

    return ModelEKF(motion, measurement, dt)


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
    made = UnscentedKalmanFilter(
        n, measurement.dim_z, dt, measurement.h, motion.f, points,
        z_mean_fn=partial(_measurement_mean, measurement), **on_circle,
    )  # fmt: skip
    made.sigmas_f = points.sigma_points(x, P)
    return made


def _measurement_mean(measurement: MeasurementModel, points: Float, weights: Float) -> Float:
    """Return the mean of measurements (m, dim_z) in the tangent space at the first."""
    return np.asarray(points[0] + weights @ measurement.residual(points, points[0]))


def _ckf(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float) -> Any:
    from filterpy.kalman import CubatureKalmanFilter

    return CubatureKalmanFilter(
        motion.dim_x, measurement.dim_z, dt, measurement.h, motion.f,
        residual_z=partial(_column_residual, measurement),
    )  # fmt: skip


def _column_residual(measurement: MeasurementModel, z: Float, z_pred: Float) -> Float:
    """Return the residual as a column: filterpy's CKF turns x into one."""
    return measurement.residual(np.ravel(z), np.ravel(z_pred))[:, None]


def _enkf(
    motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float, dt: float, N: int
) -> Any:
    from filterpy.kalman import EnsembleKalmanFilter

    return EnsembleKalmanFilter(x, P, measurement.dim_z, dt, N, measurement.h, motion.f)
