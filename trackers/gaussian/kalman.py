"""Kalman filter."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.arguments import (
    covariance_matrix,
    finite_matrix,
    matrix_with_columns,
)
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.equations import predict_gaussian, update_gaussian
from arrivals.trackers.gaussian.filterpy_names.kalman_updates import (
    predict_steadystate,
    update_correlated,
    update_sequential,
    update_steadystate,
)
from arrivals.trackers.gaussian.filterpy_names.queries import FadingMemory, Queries
from arrivals.trackers.gaussian.linalg import apply
from arrivals.trackers.gaussian.linearization import Linearization, first
from arrivals.trackers.registry import register
from arrivals.typing import Float
from arrivals.validation import time_step

ArrayFunction = Callable[[Float], Float]


@register("kalman")
class Kalman(FadingMemory, Queries, GaussianFilter):
    """Kalman filter, for linear models.

    Parameters
    ----------
    motion : MotionModel
        Linear motion of the state; one with a `control` matrix uses the control input.
    measurement : MeasurementModel
        Linear measurement of a state of that motion.
    x : array_like, shape (n,) or (n, 1)
        Initial mean.
    P : array_like, shape (n, n)
        Initial covariance.

    Attributes
    ----------
    M : ndarray, shape (n, m)
        Correlation E[w v'] of the noises of motion and measurement, for `update_correlated`.
    alpha : float
        Factor of fading memory: P = alpha² F P F' + Q.

    Raises
    ------
    TypeError
        If a model is not linear.

    Notes
    -----
    Further attributes and methods are those of `GaussianFilter`. Results equal those of
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

    linear_only = linear_steps = True

    def __init__(
        self, motion: MotionModel, measurement: MeasurementModel, x: ArrayLike, P: ArrayLike
    ) -> None:
        super().__init__(motion, measurement, x, P)
        check_linear(motion, measurement)
        self.M = np.zeros((self.dim_x, self.dim_z))

    predict_steadystate = predict_steadystate
    update_steadystate = update_steadystate
    update_sequential = update_sequential
    update_correlated = update_correlated

    def predict(
        self,
        u: ArrayLike | None = None,
        *,
        dt: float = 1.0,
        F: ArrayLike | None = None,
        Q: ArrayLike | None = None,
        B: ArrayLike | None = None,
    ) -> None:
        """Predict mean and covariance; parameters as in `GaussianFilter.predict`."""
        x, P = self.belief()
        n = len(x)
        if type(dt) is not float or dt != self.last_dt:
            dt = time_step(dt)
        F = self.held_motion.F(x, dt) if F is None else finite_matrix("F", F, n, n)
        Q = self.held_motion.Q(dt) if Q is None else covariance_matrix("Q", Q, n)
        # x = F x + B u   (4.20)
        x = self.add_control(F.dot(x), u, B)
        # P = F P F' + Q   (4.20)
        P = predict_gaussian(P, F, Q, self.fading)
        self.record_prediction(x, P, dt)

    def update(
        self, z: ArrayLike | None, R: ArrayLike | None = None, H: ArrayLike | None = None
    ) -> None:
        """Update mean and covariance by a measurement; parameters as in `GaussianFilter.update`."""
        x, P = self.belief()
        replaced = None if H is None else matrix_with_columns("H", H, len(x))
        measured = self.check_measurement(z, R, replaced)
        if measured is None:
            self.record_missed()
            return
        z, missing, R = measured
        H = self.held_measurement.H(x) if replaced is None else replaced
        # y = z - H x   (4.21)
        y = self.innovation(z, H.dot(x), missing, plain=replaced is not None)
        # S = H P H' + R,  K = P H' S^-1,  x = x + K y   (4.21)
        # P = (I - K H) P (I - K H)' + K R K'   (Joseph)
        self.record_update(z, update_gaussian(x, P, y, H, R, missing, self.inv))

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return F x and F."""
        F = self.held_motion.F(first(x), dt)
        return Linearization(apply(F, x), F)

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return H x and H."""
        H = self.held_measurement.H(first(x))
        return Linearization(apply(H, x), H)


def check_linear(motion: MotionModel, measurement: MeasurementModel, dt: float = 1.0) -> None:
    """Raise a TypeError that names the model that is not linear, if one is not.

    A model whose `is_linear` is false is evaluated at a few states.
    """
    n = motion.dim_x
    f, F = partial(motion.f, dt=dt), partial(motion.F, dt=dt)
    if not (motion.is_linear or _is_linear(f, F, n)):
        raise TypeError(f"motion must be linear; got {motion!r}: use ekf or ukf")
    if not (measurement.is_linear or _is_linear(measurement.h, measurement.H, n)):
        raise TypeError(f"measurement must be linear; got {measurement!r}: use ekf or ukf")


def _is_linear(function: ArrayFunction, jacobian: ArrayFunction, n: int) -> bool:
    """Return True if a function is its Jacobian times the state, at states in general position."""
    states = 10 * np.cos(np.arange(3 * n, dtype=np.float64).reshape(3, n))
    return np.allclose(function(states), states @ jacobian(states[0]).T, rtol=1e-9, atol=1e-9)
