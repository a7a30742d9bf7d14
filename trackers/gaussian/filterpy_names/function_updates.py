"""Updates by functions that are passed at each call, as in filterpy's extended Kalman filter."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.trackers.gaussian.arguments import matrix_with_columns
from arrivals.trackers.gaussian.equations import update_gaussian
from arrivals.typing import Float
from arrivals.validation import real

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.ekf import EKF

NAMES = {"HJacobian", "Hx", "args", "hx_args", "residual"}


def has_functions(arguments: tuple[Any, ...], named: dict[str, Any]) -> bool:
    """Return True if the arguments of an update after z are filterpy's.

    Examples
    --------
    >>> has_functions((np.diag, np.sum), {}), has_functions((2.0,), {}), has_functions((), {})
    (True, False, False)
    """
    return any(callable(each) for each in arguments) or not NAMES.isdisjoint(named)


def update_by_functions(
    tracker: EKF,
    z: ArrayLike | None,
    HJacobian: Callable[..., Any],
    Hx: Callable[..., Any],
    R: ArrayLike | None = None,
    args: Any = (),
    hx_args: Any = (),
    residual: Callable[[Any, Any], Any] = np.subtract,
) -> None:
    """Update an extended Kalman filter by a measurement function and its Jacobian.

    Parameters
    ----------
    tracker : EKF
    z : array_like, shape (m,) or (m, 1), or float
        None or NaN where it is missing.
    HJacobian : callable
        HJacobian(x, *args), the Jacobian (m, n) at the state.
    Hx : callable
        Hx(x, *hx_args), the measurement expected of the state.
    R : float or array_like, shape (m, m), optional
        Noise; that of the measurement model if None.
    args, hx_args : tuple
        Further arguments of the functions.
    residual : callable
        residual(z, z_pred), the difference of two measurements.
    """
    for name, function in (("HJacobian", HJacobian), ("Hx", Hx)):
        if not callable(function):
            raise TypeError(f"{name} must be a function; got {shown(function)}")
    x, P = tracker.belief()
    args, hx_args = (each if isinstance(each, tuple) else (each,) for each in (args, hx_args))
    state = np.array(tracker.x, dtype=np.float64)
    H = matrix_with_columns("HJacobian(x)", HJacobian(state.copy(), *args), len(x))
    measured = tracker.check_measurement(z, R, H)
    if measured is None:
        tracker.record_missed()
        return
    values, missing, R = measured
    expected = np.atleast_1d(real("Hx(x)", Hx(state.copy(), *hx_args)))
    if expected.size != len(H):
        raise ValueError(f"Hx(x) must have {len(H)} numbers, the rows of H; got {expected.size}")
    given = values.reshape(expected.shape)
    if missing is not None:
        given = np.where(np.isnan(given), expected, given)
    y = real("residual(z, z_pred)", residual(given, expected)).reshape(len(H))
    tracker.record_update(values, update_gaussian(x, P, y, H, R, missing, tracker.inv))


def predict_update(
    self: EKF,
    z: ArrayLike | None,
    HJacobian: Callable[..., Any],
    Hx: Callable[..., Any],
    args: Any = (),
    hx_args: Any = (),
    u: ArrayLike | None = None,
) -> None:
    """Predict, and update by functions; the Jacobian is that before the prediction, as in filterpy.

    Parameters
    ----------
    z, HJacobian, Hx, args, hx_args
        As in `update`.
    u : array_like, optional
        Control input.
    """
    arguments = args if isinstance(args, tuple) else (args,)
    H: Float = HJacobian(np.array(self.x, dtype=np.float64), *arguments)
    before = dict(vars(self))
    try:
        self.predict(u)
        update_by_functions(self, z, lambda x: H, Hx, hx_args=hx_args)
    except Exception:
        vars(self).update(before)
        raise


def predict_x(self: EKF, u: ArrayLike | None = None) -> None:
    """Predict the mean alone: x = f(x) + B u.

    Parameters
    ----------
    u : array_like, optional
        Control input.
    """
    x, P = self.belief()
    self.set_belief(self.add_control(self.held_motion.f(x), u, None), P)
