"""Extended Kalman filter."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.filterpy_names.function_updates import (
    has_functions,
    predict_update,
    predict_x,
    update_by_functions,
)
from arrivals.trackers.gaussian.filterpy_names.queries import FadingMemory, Queries
from arrivals.trackers.gaussian.linearization import Linearization, at_each
from arrivals.trackers.registry import register
from arrivals.typing import Float


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

    Notes
    -----
    Attributes and methods are those of `GaussianFilter`.

    References
    ----------
    Särkkä, *Bayesian Filtering and Smoothing*, 2013, algorithm 5.4.

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
        if (arguments or named) and has_functions(arguments, named):
            update_by_functions(self, z, *arguments, **named)
        else:
            super().update(z, *arguments, **named)

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return f(x) and its Jacobian."""
        return Linearization(self.held_motion.f(x, dt), at_each(self.held_motion.F, x, dt))

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return h(x) and its Jacobian."""
        return Linearization(self.held_measurement.h(x), at_each(self.held_measurement.H, x))
