"""Unscented Kalman filter."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.circular import difference, weighted_covariance, wrapped
from arrivals.trackers.gaussian.filterpy_names.attributes import Elsewhere
from arrivals.trackers.gaussian.filterpy_names.queries import Queries
from arrivals.trackers.gaussian.linalg import apply, cholesky
from arrivals.trackers.gaussian.linearization import Linearization
from arrivals.trackers.registry import register
from arrivals.typing import Float
from arrivals.validation import count, number, positive


@lru_cache(maxsize=64)
def merwe_weights(n: int, alpha: float, beta: float, kappa: float) -> tuple[Float, Float, float]:
    """Return weights of mean and covariance of 2n+1 sigma points, and their scale n + λ.

    Examples
    --------
    >>> mean, covariance, scale = merwe_weights(2, alpha=1.0, beta=2.0, kappa=1.0)
    >>> mean.round(3), scale
    (array([0.333, 0.167, 0.167, 0.167, 0.167]), 3.0)
    """
    scale = alpha**2 * (n + kappa)
    mean = np.full(2 * n + 1, 0.5 / scale)
    mean[0] = 1 - n / scale
    covariance = mean.copy()
    covariance[0] += 1 - alpha**2 + beta
    return mean, covariance, scale


@register("ukf")
class UKF(Queries, GaussianFilter):
    """Unscented Kalman filter: models linearized by regression over Merwe's sigma points.

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
    alpha : float
        Distance of the sigma points from the mean, relative to √(n + κ) standard deviations.
    beta : float
        Weight of the mean's sigma point in covariances; 2 is best for Gaussian beliefs.
    kappa : float
        Second scale of the sigma points, above -n.
    iterations : int
        Largest number of regressions of the measurement in an update: a damped Gauss-Newton search
        for the mean with close sigma points, then one regression over the sigma points of the
        belief that it has found (posterior linearization), for measurements that are far from
        linear over the prior.

    Raises
    ------
    ValueError
        If `alpha` is not positive or `kappa` not above -n; otherwise as in `GaussianFilter`.

    Notes
    -----
    Attributes and methods are those of `GaussianFilter`. Every `update` draws sigma points from
    the present belief, also a second one after the same `predict`. Means are taken by differences
    from the middle sigma point, so that angles are averaged on the circle. A sigma-point step is a
    Kalman step in which the regression of the function on the state replaces the matrix, and the
    covariance of its residual is added to the noise.

    References
    ----------
    Wan and van der Merwe, "The unscented Kalman filter", in Haykin (ed.), *Kalman Filtering and
    Neural Networks*, 2001, table 7.3.2; García-Fernández et al., "Posterior linearization filter",
    IEEE TSP 63(20), 2015, for the form.

    Examples
    --------
    >>> from arrivals.measurement_models import Bearing
    >>> from arrivals.motion_models import RandomWalk
    >>> bearings = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=1e-4)
    >>> tracker = UKF(RandomWalk(q=0.01), bearings, x=[4.0, 6.0], P=np.eye(2))
    >>> tracker.predict()
    >>> tracker.update(bearings.h([5.0, 5.0]))
    >>> tracker.x.round(1)
    array([5., 5.])
    """

    alpha: float = 0.5  # of the sigma points
    fx = Elsewhere("assign motion, a FunctionMotion(fx, Q=...)")
    hx = Elsewhere("assign measurement, a FunctionMeasurement(hx, R=...)")
    points_fn = Elsewhere("set alpha, beta and kappa of the sigma points")
    Wm = Wc = Elsewhere("call merwe_weights(dim_x, alpha, beta, kappa)")
    sigmas_f = sigmas_h = Elsewhere("sigma points are drawn in each step from x and P")
    compute_process_sigmas = Elsewhere("call linearize_motion(x, P, dt)")
    cross_variance = Elsewhere("call linearize_measurement(x, P): its jacobian is P_xz' P^-1")
    msqrt = Elsewhere("the square root is the Cholesky factor")
    x_mean = residual_x = state_add = Elsewhere("give the motion model `angles`")
    z_mean = residual_z = Elsewhere("give the measurement model a `residual`")

    def __init__(
        self,
        motion: MotionModel,
        measurement: MeasurementModel,
        x: ArrayLike,
        P: ArrayLike,
        alpha: float = 0.5,
        beta: float = 2.0,
        kappa: float = 0.0,
        iterations: int = 1,
    ) -> None:
        super().__init__(motion, measurement, x, P)
        self.alpha, self.beta = positive("alpha", alpha), number("beta", beta)
        self.kappa = number("kappa", kappa)
        self.sigma_weights()
        self.iterations = count("iterations", iterations)

    def batch_filter(self, zs: Any, *arguments: Any, **named: Any) -> Any:
        """Filter a sequence; arguments by name, as in `GaussianFilter.batch_filter`."""
        _refuse_positional("batch_filter(zs, Rs=..., dts=..., saver=...)", arguments)
        return super().batch_filter(zs, **named)

    def rts_smoother(self, Xs: Any, Ps: Any, *arguments: Any, **named: Any) -> Any:
        """Smooth a sequence; arguments by name, as in `GaussianFilter.rts_smoother`."""
        _refuse_positional("rts_smoother(Xs, Ps, Qs=..., dts=...)", arguments)
        return super().rts_smoother(Xs, Ps, **named)

    def linearize_motion(self, x: Float, P: Float, dt: float) -> Linearization:
        """Return the regression of f over the sigma points."""
        angles = self.held_motion.angles
        motion = self._regression(
            x,
            P,
            lambda points: self.held_motion.f(points, dt),
            lambda a, b: difference(a, b, angles),
        )
        return motion._replace(mean=wrapped(motion.mean, angles))

    def linearize_measurement(self, x: Float, P: Float) -> Linearization:
        """Return the regression of h over the sigma points."""
        return self._regression(x, P, self.held_measurement.h, self.held_measurement.residual)

    def sigma_weights(self) -> tuple[Float, Float, float]:
        """Return weights of mean and covariance of the sigma points, and their scale."""
        alpha, beta = positive("alpha", self.alpha), number("beta", self.beta)
        kappa, n = number("kappa", self.kappa), self.dim_x
        if not -n < kappa < np.inf:
            raise ValueError(f"kappa must be finite and above -{n}; got {kappa}")
        if not -np.inf < beta < np.inf:
            raise ValueError(f"beta must be finite; got {beta}")
        return merwe_weights(n, alpha, beta, kappa)

    def _regression(
        self,
        x: Float,
        P: Float,
        function: Callable[[Float], Float],
        subtract: Callable[[Float, Float], Float],
    ) -> Linearization:
        mean_weights, weights, scale = self.sigma_weights()
        P, L, jittered = cholesky(P)
        # X_i = x + d_i,  d_i = 0, columns of sqrt(scale) L, and their negatives
        steps = _sigma_steps(np.sqrt(scale) * L)
        # Y_i = f(X_i),  y = Σ w_i Y_i, by differences from Y_0
        images = function(x[..., None, :] + steps)
        middle = images[..., :1, :]
        offsets = subtract(images, middle)
        shift = apply(offsets.swapaxes(-1, -2), mean_weights)
        residuals = offsets - shift[..., None, :]
        n = self.dim_x
        plus, minus = residuals[..., 1 : n + 1, :], residuals[..., n + 1 :, :]
        # F = P_xy' P^-1 = (L^-T G)',  G = (Y_i+ - Y_i-) / 2 sqrt(scale): as exact as L, not as P
        slopes = (plus - minus) / (2 * np.sqrt(scale))
        jacobian = np.linalg.solve(L.swapaxes(-1, -2), slopes).swapaxes(-1, -2)
        # P_yy - F P_xy, of the parts of Y that are even in d_i: 0 of linear functions
        even = np.concatenate([residuals[..., :1, :], np.sqrt(0.5) * (plus + minus)], axis=-2)
        extra_noise = weighted_covariance(even, weights[: n + 1])
        return Linearization(
            middle[..., 0, :] + shift, np.asarray(jacobian, np.float64), extra_noise, jittered
        )


def _refuse_positional(call: str, arguments: tuple[Any, ...]) -> None:
    """Refuse arguments by position, whose order in filterpy's unscented filter is another."""
    if arguments:
        raise TypeError(f"arguments must be passed by name, {call}; got {len(arguments)} without")


def _sigma_steps(L: Float) -> Float:
    """Return the differences of the sigma points from the mean, (..., 2n+1, n)."""
    U = L.swapaxes(-1, -2)
    return np.concatenate([np.zeros_like(U[..., :1, :]), U, -U], axis=-2)
