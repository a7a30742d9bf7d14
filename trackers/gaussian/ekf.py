"""Extended Kalman filter."""

from __future__ import annotations

from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.linearization import Linearization, at_each
from arrivals.trackers.registry import register
from arrivals.typing import Float


@register("ekf")
class EKF(GaussianFilter):
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

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return f(x) and its Jacobian."""
        return Linearization(self.held_motion.f(x, dt), at_each(self.held_motion.F, x, dt))

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return h(x) and its Jacobian."""
        return Linearization(self.held_measurement.h(x), at_each(self.held_measurement.H, x))
