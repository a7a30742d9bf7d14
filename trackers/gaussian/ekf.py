"""The extended Kalman filter."""

from __future__ import annotations

from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.linearization import Linearization, at_each
from arrivals.trackers.registry import register
from arrivals.typing import Float


@register("ekf")
class EKF(GaussianFilter):
    """The extended Kalman filter: the models' tangents at the mean.

    Parameters
    ----------
    motion : MotionModel
    measurement : MeasurementModel
    x : array_like, shape (n,) or (n, 1)
        Mean.
    P : array_like, shape (n, n)
        Covariance.

    Notes
    -----
    Everything else is that of `GaussianFilter`.

    References
    ----------
    Särkkä, *Bayesian Filtering and Smoothing*, 2013, algorithm 5.4.

    Examples
    --------
    >>> from arrivals.measurement_models import Bearing
    >>> from arrivals.motion_models import RandomWalk
    >>> seen = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=1e-4, position=(0, 1))
    >>> tracker = EKF(RandomWalk(q=0.01), seen, x=[4.0, 6.0], P=[[1, 0], [0, 1]])
    >>> tracker.predict()
    >>> tracker.update(seen.h([5.0, 5.0]))
    >>> tracker.x.round(1)
    array([5., 5.])
    """

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return f(x) and its Jacobian."""
        return Linearization(self.motion.f(x, dt), at_each(self.motion.F, x, dt))

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return h(x) and its Jacobian."""
        return Linearization(self.measurement.h(x), at_each(self.measurement.H, x))
