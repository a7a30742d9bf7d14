"""Checks of the arguments of Gaussian filters."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from inspect import get_annotations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurements import LARGEST, numbers, real_numbers, rows
from arrivals.motion_models.base import MotionModel
from arrivals.typing import Bool, Float
from arrivals.validation import covariance, instance, real, shaped

PerStep = Sequence[Any] | Float | None

LARGEST_ENTRY = 1e80  # of matrices; products with two of them and a covariance are finite


def check_models(motion: Any, measurement: Any) -> tuple[MotionModel, MeasurementModel]:
    """Return a motion model, and the measurement model for the entries of its state.

    Raises
    ------
    TypeError
        If one is not a model, or the measurement reads an entry that the state lacks.

    Examples
    --------
    >>> check_models("walk", None)
    Traceback (most recent call last):
    TypeError: motion must be a MotionModel; got 'walk', a str
    """
    motion = instance("motion", motion, MotionModel)  # type: ignore[type-abstract]  # no call
    measurement = instance("measurement", measurement, MeasurementModel)  # type: ignore[type-abstract]
    return motion, measurement.for_state(motion.state_names)


@cache
def overrides(kind: type, base: type, name: str) -> bool:
    """Return True if a class, or one between it and its base, defines a member of the base.

    Cached, so that a step of a filter need not call a member that has its default.

    Examples
    --------
    >>> from arrivals.motion_models import RandomWalk, VonMisesWalk
    >>> [overrides(kind, MotionModel, "angles") for kind in (RandomWalk, VonMisesWalk)]
    [False, True]
    """
    between = kind.__mro__[: kind.__mro__.index(base)]
    return any(name in vars(each) or name in get_annotations(each) for each in between)


def has_own_steps(tracker: object, mark: str) -> bool:
    """Return True if a tracker's class itself has a mark, and `predict` and `update` are its own.

    The mark stands in the body of classes whose steps may be done as one block: a subclass that
    replaces a step does not have it.

    Examples
    --------
    >>> class Block:
    ...     block_steps = True
    >>> class Other(Block):
    ...     def update(self, z): ...
    >>> [has_own_steps(kind(), "block_steps") for kind in (Block, Other)]
    [True, False]
    """
    return mark in vars(type(tracker)) and vars(tracker).keys().isdisjoint(("predict", "update"))


def belief_arrays(x: ArrayLike, P: ArrayLike, n: int) -> tuple[Float, Float]:
    """Return a mean (n,) and a covariance (n, n) of an assigned belief.

    Examples
    --------
    >>> belief_arrays([1.0], [[1.0]], 2)
    Traceback (most recent call last):
    ValueError: x must have shape (2,) or (2, 1); got (1,)
    """
    mean = real("x", x)
    if mean.shape not in ((n,), (n, 1)):
        raise ValueError(f"x must have shape ({n},) or ({n}, 1); got {mean.shape}")
    if not (np.abs(mean) < LARGEST).all():
        raise ValueError(f"x must be finite and below {LARGEST:g}; got {mean.ravel().tolist()}")
    return mean.reshape(n), covariance_matrix("P", P, n)


def check_finite(x: Float, P: Float) -> None:
    """Raise a ValueError if a belief overflows, before it replaces the present one.

    Examples
    --------
    >>> check_finite(np.zeros(1), np.array([[np.inf]]))
    Traceback (most recent call last):
    ValueError: belief must stay finite; got an overflow: x, P, F, Q, R or dt has grown too far
    """
    if not ((np.abs(P) < LARGEST).all() and (np.abs(x) < LARGEST).all()):
        cause = "x, P, F, Q, R or dt has grown too far"
        raise ValueError(f"belief must stay finite; got an overflow: {cause}")


def measurement_vector(z: ArrayLike | None, m: int) -> Float:
    """Return a measurement as (m,), a copy; one missing number means that all are missing.

    Examples
    --------
    >>> measurement_vector(None, 2), measurement_vector([[1], [None]], 2)
    (array([nan, nan]), array([ 1., nan]))
    """
    array = numbers("z", z)
    if array.dtype.kind == "c":
        cure = "stack the parts by composite(z)"
        raise TypeError(f"z must hold real numbers; got {array.dtype}: {cure}")
    if array.ndim == 0 and np.isnan(array):
        return np.full(m, np.nan)
    if array.size != m or array.ndim > 2 or max(array.shape, default=1) != m:
        raise ValueError(f"z must have shape ({m},) or ({m}, 1); got {array.shape}")
    return np.array(array.reshape(m))


def missing_mask(z: Float) -> Bool | None:
    """Return where measurements (..., m) are missing, or None if nowhere.

    Examples
    --------
    >>> missing_mask(np.array([1.0, np.nan])), missing_mask(np.ones(2))
    (array([False,  True]), None)
    """
    missing = np.isnan(z)
    return missing if missing.any() else None


def measurement_and_mask(z: ArrayLike | None, m: int) -> tuple[Float, Bool | None]:
    """Return a measurement as (m,), NaN where missing, and where it is missing, None if nowhere.

    Examples
    --------
    >>> measurement_and_mask(None, 2)
    (array([nan, nan]), array([ True,  True]))
    """
    vector = measurement_vector(z, m)
    return vector, missing_mask(vector)


def covariance_matrix(name: str, value: ArrayLike, n: int) -> Float:
    """Return a covariance (n, n): the value, or the value times the unit matrix if it is a number.

    Examples
    --------
    >>> covariance_matrix("R", 2.0, 2)
    array([[2., 0.],
           [0., 2.]])
    """
    if is_number(value):
        value = finite_matrix(name, value) * np.eye(n)
    matrix = covariance(name, value, n)
    if not (np.abs(matrix) < LARGEST).all():
        raise ValueError(f"{name} must be below {LARGEST:g}; got {matrix.tolist()}")
    return matrix


def finite_matrix(name: str, value: ArrayLike, *shape: int) -> Float:
    """Return a matrix of the given shape, with finite numbers.

    Examples
    --------
    >>> finite_matrix("F", [[np.inf]], 1, 1)
    Traceback (most recent call last):
    ValueError: F must be finite and below 1e+80; got [[inf]]
    """
    matrix = shaped(name, value, *shape)
    if not (np.abs(matrix) < LARGEST_ENTRY).all():
        raise ValueError(
            f"{name} must be finite and below {LARGEST_ENTRY:g}; got {matrix.tolist()}"
        )
    return matrix


def matrix_with_columns(name: str, value: ArrayLike, n: int) -> Float:
    """Return a matrix with n columns and finite numbers.

    Examples
    --------
    >>> matrix_with_columns("H", [1.0, 2.0], 2)
    Traceback (most recent call last):
    ValueError: H must have shape (m, 2); got (2,)
    """
    matrix = real(name, value)
    if matrix.ndim != 2 or matrix.shape[1] != n:
        raise ValueError(f"{name} must have shape (m, {n}); got {matrix.shape}")
    return finite_matrix(name, matrix, *matrix.shape)


def is_number(value: Any) -> bool:
    """Return True of a number, also as an array without axes.

    Examples
    --------
    >>> is_number(2.0), is_number(np.array(2.0)), is_number([2.0])
    (True, True, False)
    """
    return np.isscalar(value) or getattr(value, "shape", None) == ()


def control_matrix(B: ArrayLike | None, n: int) -> Float | None:
    """Return a control matrix (n, dim_u); None for none or 0, one column of a vector.

    Examples
    --------
    >>> control_matrix([0.5, 1.0], 2)
    array([[0.5],
           [1. ]])
    """
    if B is None or (is_number(B) and not np.any(B)):
        return None
    matrix = real("B", B)
    if matrix.shape == (n,):
        matrix = matrix[:, None]
    if matrix.ndim != 2 or len(matrix) != n:
        raise ValueError(f"B must have shape ({n}, dim_u); got {matrix.shape}")
    return finite_matrix("B", matrix, *matrix.shape)


def control_input(u: ArrayLike | None) -> Float | None:
    """Return a control input as (dim_u,), or None if there is none or all of it is zero.

    Examples
    --------
    >>> control_input(0), control_input([[2.0]])
    (None, array([2.]))
    >>> control_input(np.nan)
    Traceback (most recent call last):
    ValueError: u must be finite; got [nan]
    """
    if u is None:
        return None
    values = real_numbers("u", u).ravel()
    if np.isnan(values).any():
        raise ValueError(f"u must be finite; got {np.ravel(np.ma.getdata(u)).tolist()}")
    return values if values.any() else None


def control_effect(u: Float, B: Float | None) -> Float:
    """Return B u of a control input (dim_u,) that is not zero.

    Examples
    --------
    >>> control_effect(np.array([2.0]), np.array([[0.5], [1.0]]))
    array([1., 2.])
    """
    if B is None:
        cure = "take LinearMotion(..., control=B)"
        raise ValueError(f"motion must have a control matrix where u is not zero; got none: {cure}")
    if u.shape != (B.shape[1],):
        raise ValueError(f"u must have shape ({B.shape[1]},); got {u.shape}")
    return np.asarray(B @ u)


def per_step_values(name: str, values: PerStep, n_steps: int) -> Sequence[Any] | Float:
    """Return one value for each step, None where values is None.

    Examples
    --------
    >>> per_step_values("Fs", [1, 2], 3)
    Traceback (most recent call last):
    ValueError: Fs must have one entry for each of 3 steps; got 2
    """
    if values is None:
        return [None] * n_steps
    values = list(rows(name, values))
    if len(values) != n_steps:
        raise ValueError(
            f"{name} must have one entry for each of {n_steps} steps; got {len(values)}"
        )
    return values
