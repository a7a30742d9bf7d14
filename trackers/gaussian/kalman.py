"""The Kalman filter."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.linalg import apply
from arrivals.trackers.gaussian.linearization import Linearization
from arrivals.trackers.gaussian.smoothing import GaussianFilter
from arrivals.trackers.registry import register
from arrivals.typing import Float

Slope = Callable[[Float], Float]


@register("kalman")
class Kalman(GaussianFilter):
    """The Kalman filter, for models that are matrices.

    Parameters
    ----------
    motion : MotionModel
        Linear; one with a `control` matrix uses the control input.
    measurement : MeasurementModel
        Linear.
    x : array_like, shape (n,) or (n, 1)
        Mean.
    P : array_like, shape (n, n)
        Covariance.

    Raises
    ------
    TypeError
        If a model is not linear.

    Notes
    -----
    Everything else is that of `GaussianFilter`. Results equal those of
    `filterpy.kalman.KalmanFilter`.

    References
    ----------
    Särkkä, *Bayesian Filtering and Smoothing*, 2013, theorem 4.2.

    Examples
    --------
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> from arrivals.motion_models import ConstantVelocity
    >>> position = LinearMeasurement([[1.0, 0.0]], [[1.0]])
    >>> tracker = Kalman(ConstantVelocity(q=0.3, n_dims=1), position, x=[0.0, 1.0], P=np.eye(2))
    >>> run = tracker.run([1.1, None, 2.9])
    >>> run.x[:, 0].round(2)
    array([1.07, 2.1 , 2.93])
    """

    def __init__(
        self, motion: MotionModel, measurement: MeasurementModel, x: ArrayLike, P: ArrayLike
    ) -> None:
        super().__init__(motion, measurement, x, P)
        check_linear(motion, measurement)

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return F x and F."""
        F = self.motion.F(_first(x), dt)
        return Linearization(apply(F, x), F)

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return H x and H."""
        H = self.measurement.H(_first(x))
        return Linearization(apply(H, x), H)


def check_linear(motion: MotionModel, measurement: MeasurementModel, dt: float = 1.0) -> None:
    """Raise a TypeError that names the model that is not linear, if one is not."""
    f, F = partial(motion.f, dt=dt), partial(motion.F, dt=dt)
    _linear("motion", motion, f, F, motion.dim_x)
    _linear("measurement", measurement, measurement.h, measurement.H, motion.dim_x)


def _first(x: Float) -> Float:
    """Return one state of a batch: the matrices are the same at all of them."""
    return x if x.ndim == 1 else _first(x[0])


def _linear(name: str, model: object, function: Slope, jacobian: Slope, n: int) -> None:
    """Check at a few states in general position that a function is its Jacobian times the state."""
    states = 10 * np.cos(np.arange(3 * n, dtype=np.float64).reshape(3, n))
    if not np.allclose(function(states), states @ jacobian(states[0]).T, rtol=1e-9, atol=1e-9):
        raise TypeError(f"{name} must be linear; got {model!r}: use ekf or ukf")
