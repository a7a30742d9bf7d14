"""Extended Kalman filter."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.filterpy_names.function_updates import (
    has_functions,
    predict_update,
    predict_x,
    update_by_functions,
)
from arrivals.trackers.gaussian.filterpy_names.queries import FadingMemory, Queries
from arrivals.trackers.gaussian.linalg import apply
from arrivals.trackers.gaussian.linearization import Linearization, at_each, first
from arrivals.trackers.registry import register
from arrivals.typing import Float
from arrivals.validation import count


@register("ekf")
class EKF(FadingMemory, Queries, GaussianFilter):
    """Extended Kalman filter: models linearized by their Jacobians at the mean.

    Parameters
    ----------
    motion : MotionModel
        Motion of the state.
    measurement : MeasurementModel
        Measurement of a state of that motion.
    x : array_like, shape (n,) or (n, 1)
        Initial mean.
    P : array_like, shape (n, n)
        Initial covariance.
    iterations : int
        Largest number of linearizations of the measurement in an update, each at the mean of the
        one before: a damped Gauss-Newton search, for measurements that are far from linear over
        the prior. It ends where the mean has settled.

    Notes
    -----
    Attributes and methods are those of `GaussianFilter`.

    References
    ----------
    Särkkä, *Bayesian Filtering and Smoothing*, 2013, algorithm 5.4; Bell and Cathey, "The iterated
    Kalman filter update as a Gauss-Newton method", IEEE TAC 38(2), 1993.

    Examples
    --------
    >>> from arrivals.measurement_models import Bearing
    >>> from arrivals.motion_models import RandomWalk
    >>> bearings = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=1e-4)
    >>> tracker = EKF(RandomWalk(q=0.01), bearings, x=[4.0, 6.0], P=[[1, 0], [0, 1]])
    >>> tracker.predict()
    >>> tracker.update(bearings.h([5.0, 5.0]))
    >>> tracker.x.round(1)
    array([5., 5.])
    """

    def __init__(
        self,
        motion: MotionModel,
        measurement: MeasurementModel,
        x: ArrayLike,
        P: ArrayLike,
        iterations: int = 1,
    ) -> None:
        super().__init__(motion, measurement, x, P)
        self.iterations = count("iterations", iterations)

    predict_update = predict_update
    predict_x = predict_x

    def update(self, z: ArrayLike | None, *arguments: Any, **named: Any) -> None:
        """Update mean and covariance by a measurement.

        Parameters
        ----------
        z : array_like, shape (m,) or (m, 1), or float
            None or NaN where it is missing; the valid entries are used.
        *arguments, **named
            R and H, as in `GaussianFilter.update`; or filterpy's: HJacobian, Hx, R, args, hx_args,
            residual, which replace the measurement model in this update.
        """
        if not (arguments or named):
            super().update(z)  # the usual case
        elif has_functions(arguments, named):
            update_by_functions(self, z, *arguments, **named)
        else:
            super().update(z, *arguments, **named)

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return f(x) and its Jacobian."""
        motion = self.held_motion
        if motion.is_linear and not self.held_angles:
            F = motion.F(first(x), dt)
            return Linearization(apply(F, x), F)
        return Linearization(motion.f(x, dt), at_each(motion.F, x, dt))

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return h(x) and its Jacobian."""
        measurement = self.held_measurement
        if x.ndim == 1:
            return Linearization(*measurement.h_and_H(x))
        return Linearization(measurement.h(x), at_each(measurement.H, x))
