"""What a Kalman-type tracker is given from call to call: checked, and in one shape."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.motion_models.base import MotionModel
from arrivals.typing import Bool, Float
from arrivals.validation import covariance, instance, real

PerStep = Sequence[Any] | Float | None


def models(motion: Any, measurement: Any) -> tuple[MotionModel, MeasurementModel]:
    """Return two models, the measurement for the entries that the motion names.

    Raises
    ------
    TypeError
        If one is not a model, or the measurement needs an entry that the state does not have.

    Examples
    --------
    >>> models("walk", None)
    Traceback (most recent call last):
    TypeError: motion must be a MotionModel; got 'walk', a str
    """
    instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # no call
    instance("measurement", measurement, MeasurementModel)  # type: ignore[type-abstract]
    return motion, measurement.for_state(motion.state_names)


def measurement_vector(z: ArrayLike, m: int) -> Float:
    """Return a measurement as (m,), a copy; NaN alone stands for NaN everywhere."""
    array = np.array(z)
    if array.shape == (m,) and array.dtype == np.float64:
        return array  # the usual case
    if array.dtype.kind == "c":
        raise TypeError("z must hold real numbers: stack the parts of complex ones, composite(z)")
    array = real("z", array)
    if array.ndim == 0 and np.isnan(array):
        return np.full(m, np.nan)
    if array.size != m or array.ndim > 2 or max(array.shape, default=1) != m:
        raise ValueError(f"z must have shape ({m},) or ({m}, 1); got {array.shape}")
    return array.reshape(m)


def missing_mask(z: Float | None) -> Bool | None:
    """Return where measurements (..., m) are missing, or None if nowhere."""
    if z is None or np.vdot(z, z) < np.inf:  # NaN fails too; quicker than isfinite
        return None
    if np.isinf(z).any():
        raise ValueError(f"z must be finite, or NaN where missing; got {z.tolist()}")
    missing = np.isnan(z)
    return missing if missing.any() else None


def noise_matrix(R: ArrayLike, m: int) -> Float:
    """Return the noise of m measurements: R, or R times the unit matrix if it is a number.

    Examples
    --------
    >>> noise_matrix(2.0, 2)
    array([[2., 0.],
           [0., 2.]])
    """
    return covariance("R", np.multiply(np.eye(m), R) if np.ndim(R) == 0 else R, m)


def matrix_of(name: str, value: ArrayLike, n: int) -> Float:
    """Return a real matrix with n columns.

    Examples
    --------
    >>> matrix_of("H", [1.0, 2.0], 2)
    Traceback (most recent call last):
    ValueError: H must have shape (m, 2); got (2,)
    """
    matrix = real(name, value)
    if matrix.ndim != 2 or matrix.shape[1] != n:
        raise ValueError(f"{name} must have shape (m, {n}); got {matrix.shape}")
    return matrix


def check_shape(name: str, matrix: Float, shape: tuple[int, ...]) -> None:
    """Raise a ValueError if an array has another shape.

    Examples
    --------
    >>> check_shape("R", np.eye(2), (3, 3))
    Traceback (most recent call last):
    ValueError: R must have shape (3, 3); got (2, 2)
    """
    if matrix.shape != shape:
        raise ValueError(f"{name} must have shape {shape}; got {matrix.shape}")


def per_step_values(name: str, values: PerStep, n_steps: int) -> Sequence[Any] | Float:
    """Return one value a step, None where none are given.

    Examples
    --------
    >>> per_step_values("Fs", [1, 2], 3)
    Traceback (most recent call last):
    ValueError: Fs must have one entry a step, 3; got 2
    """
    if values is None:
        return [None] * n_steps
    if len(values) != n_steps:
        raise ValueError(f"{name} must have one entry a step, {n_steps}; got {len(values)}")
    return values
