"""Unscented Kalman filter with filterpy's constructor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.function import FunctionMeasurement
from arrivals.measurements import rows
from arrivals.motion_models.function import FunctionMotion
from arrivals.trackers.filterpy.dimensions import ConstructedByDimensions
from arrivals.trackers.gaussian.arguments import PerStep, per_step_values
from arrivals.trackers.gaussian.filterpy_names.replaced_models import ReplacedMotion
from arrivals.trackers.gaussian.ukf import UKF
from arrivals.typing import Float
from arrivals.validation import count, positive, real

POINTS = ("MerweScaledSigmaPoints", "JulierSigmaPoints")
CURES = {
    "sqrt_fn": "the square root is the Cholesky factor",
    "x_mean_fn": "take UKF with a motion model that has `angles`",
    "residual_x": "take UKF with a motion model that has `angles`",
    "state_add": "take UKF with a motion model that has `angles`",
    "z_mean_fn": "residual_z is enough, the mean is taken by differences",
    "UT": "the transform is that of the class",
}


class UnscentedKalmanFilter(ConstructedByDimensions, UKF):
    """Unscented Kalman filter that is constructed as `filterpy.kalman.UnscentedKalmanFilter`.

    Parameters
    ----------
    dim_x, dim_z : int
        Numbers of entries of state and measurement.
    dt : float
        Length of a step, unless `predict` is called with another.
    hx : callable
        hx(x), the measurement expected of a state (dim_x,).
    fx : callable
        fx(x, dt), the state after `dt`.
    points : MerweScaledSigmaPoints or JulierSigmaPoints
        Sigma points of filterpy.
    residual_z : callable, optional
        residual_z(z, z_pred), the difference of two measurements.
    **functions
        filterpy's other functions, which must be None.

    Examples
    --------
    >>> from arrivals.trackers.filterpy import MerweScaledSigmaPoints
    >>> points = MerweScaledSigmaPoints(1, alpha=0.5, beta=2.0, kappa=0.0)
    >>> ukf = UnscentedKalmanFilter(1, 1, 1.0, hx=np.square, fx=lambda x, dt: x, points=points)
    >>> ukf.x = np.array([2.0])
    >>> ukf.predict()
    >>> ukf.update(6.25)
    >>> ukf.x.round(2)
    array([2.05])
    """

    plain: ClassVar[type[UKF]] = UKF
    own_step_length = True

    def __init__(
        self,
        dim_x: int,
        dim_z: int,
        dt: float,
        hx: Callable[..., Any],
        fx: Callable[..., Any],
        points: Any,
        residual_z: Callable[[Any, Any], Any] | None = None,
        **functions: Any,
    ) -> None:
        _refuse(functions)
        if type(points).__name__ not in POINTS:
            raise TypeError(f"points must be {' or '.join(POINTS)} of filterpy; got {points!r}")
        n, m = count("dim_x", dim_x), count("dim_z", dim_z)
        self.dt, self._fx, self._hx, self.residual = positive("dt", dt), fx, hx, residual_z
        super().__init__(
            _motion(fx, np.eye(n)),
            FunctionMeasurement(hx, R=np.eye(m), residual=residual_z),
            np.zeros(n),
            np.eye(n),
            alpha=getattr(points, "alpha", 1.0),  # Julier's points are Merwe's with 1 and 0
            beta=getattr(points, "beta", 0.0),
            kappa=points.kappa,
        )

    @property
    def fx(self) -> Callable[..., Any]:
        """Function of the motion, fx(x, dt)."""
        return self._fx

    @fx.setter
    def fx(self, fx: Callable[..., Any]) -> None:
        self.motion, self._fx = _motion(fx, self.Q), fx

    @property
    def hx(self) -> Callable[..., Any]:
        """Function of the measurement, hx(x)."""
        return self._hx

    @hx.setter
    def hx(self, hx: Callable[..., Any]) -> None:
        self.measurement, self._hx = self._measured(hx, self.R), hx

    def predict(  # type: ignore[override]  # filterpy's arguments
        self,
        dt: float | None = None,
        UT: None = None,
        fx: Callable[..., Any] | None = None,
        **fx_args: Any,
    ) -> None:
        """Predict mean and covariance.

        Parameters
        ----------
        dt : float, optional
            Length of the step.
        UT : None
            Another transform is refused.
        fx : callable, optional
            Replaces the motion in this step.
        **fx_args
            Further arguments of fx.
        """
        _refuse({"UT": UT})
        usual = self.motion
        try:
            if fx is not None or fx_args:
                self.hold_motion(_motion(partial(fx or self._fx, **fx_args), self.Q))
            super().predict(dt=self.dt if dt is None else dt)
        finally:
            self.hold_motion(usual)

    def update(  # type: ignore[override]  # filterpy's arguments
        self,
        z: ArrayLike | None,
        R: ArrayLike | None = None,
        UT: None = None,
        hx: Callable[..., Any] | None = None,
        **hx_args: Any,
    ) -> None:
        """Update mean and covariance by a measurement.

        Parameters
        ----------
        z : array_like, shape (m,) or (m, 1), or float
            None or NaN where it is missing; the valid entries are used.
        R : float or array_like, shape (m, m), optional
            Replaces the noise in this update.
        UT : None
            Another transform is refused.
        hx : callable, optional
            Replaces the measurement function in this update.
        **hx_args
            Further arguments of hx.
        """
        _refuse({"UT": UT})
        usual = self.measurement
        try:
            if hx is not None or hx_args:
                self.held_measurement = self._measured(partial(hx or self._hx, **hx_args), self.R)
            super().update(z, R)
        finally:
            self.held_measurement = usual

    def batch_filter(  # type: ignore[override]  # filterpy's arguments and results
        self,
        zs: Sequence[ArrayLike | None] | Float,
        Rs: PerStep = None,
        dts: PerStep = None,
        UT: None = None,
        saver: Any = None,
    ) -> tuple[Float, Float]:
        """Filter a sequence; return means (n_steps, n) and covariances (n_steps, n, n)."""
        _refuse({"UT": UT})
        zs = list(rows("zs", zs))
        Rs = per_step_values("Rs", Rs, len(zs))
        dts = per_step_values("dts", dts, len(zs))
        beliefs, before = [], dict(vars(self))
        try:
            for z, R, dt in zip(zs, Rs, dts, strict=True):
                self.predict(dt)
                self.update(z, R)
                beliefs.append((self.x, self.P))
                if saver is not None:
                    saver.save()
        except Exception:
            vars(self).update(before)
            raise
        n = self.dim_x
        means = np.array([x for x, _ in beliefs]).reshape(len(zs), *np.shape(self.x))
        return means, np.array([P for _, P in beliefs]).reshape(len(zs), n, n)

    def rts_smoother(  # type: ignore[override]  # filterpy's arguments and results
        self,
        Xs: ArrayLike,
        Ps: ArrayLike,
        Qs: PerStep = None,
        dts: PerStep = None,
        UT: None = None,
    ) -> tuple[Float, Float, Float]:
        """Smooth the results of `batch_filter`; return means, covariances and gains."""
        _refuse({"UT": UT})
        n_steps = len(real("Xs", Xs))
        every = [self.dt if dts is None else dts] * n_steps if np.ndim(dts or 0) == 0 else dts
        x, P, K, _ = super().rts_smoother(Xs, Ps, Qs=Qs, dts=every)
        return x, P, K

    def _measured(self, hx: Callable[..., Any], R: Float) -> FunctionMeasurement:
        return FunctionMeasurement(hx, R=R, residual=self.residual)


def _motion(fx: Callable[..., Any], Q: Float) -> ReplacedMotion:
    """Return a motion with noise Q in every step, whatever its length."""
    return ReplacedMotion(FunctionMotion(fx, Q=Q), noise=Q)


def _refuse(functions: dict[str, Any]) -> None:
    for name, value in functions.items():
        if name not in CURES:
            raise TypeError(f"UnscentedKalmanFilter has no argument {name!r}")
        if value is not None:
            raise TypeError(f"{name} must be None; got {value!r}: {CURES[name]}")
