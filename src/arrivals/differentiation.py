"""Functions of a vector: numerical derivatives, values over leading axes."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from arrivals.typing import Float
from arrivals.validation import real

RELATIVE_STEP = np.finfo(np.float64).eps ** (1 / 3)  # least error of central differences


def function(name: str, value: Any) -> Any:
    """Return a function, checked.

    Examples
    --------
    >>> function("h", np.eye(2))
    Traceback (most recent call last):
    TypeError: h must be a function; got ndarray
    """
    if not callable(value):
        raise TypeError(f"{name} must be a function; got {type(value).__name__}")
    return value


def numerical_jacobian(
    f: Callable[[Float], Float],
    x: Float,
    subtract: Callable[[Float, Float], Float] = np.subtract,
) -> Float:
    """Return the Jacobian (m, n) of a function (..., n) -> (..., m) at x by central differences.

    Parameters
    ----------
    f : callable
        Called once, with the 2n states x ± hᵢ eᵢ, (2, n, n); hᵢ = ε^(1/3) max(1, abs(xᵢ)).
    x : ndarray, shape (n,)
        Where the Jacobian is taken.
    subtract : callable
        Difference of two values of the function; one that wraps for angles.

    Returns
    -------
    ndarray, shape (m, n)

    Examples
    --------
    >>> numerical_jacobian(lambda x: x[..., :1] * x, np.array([2.0, 3.0])).round(6)
    array([[4., 0.],
           [3., 2.]])
    """
    steps = np.diag(RELATIVE_STEP * np.maximum(1.0, np.abs(x)))
    above, below = x + steps, x - steps
    ahead, behind = f(np.stack([above, below]))
    width = (above - below).diagonal()  # as rounded
    return np.asarray((subtract(ahead, behind) / width[:, None]).T)


def over_leading_axes(name: str, f: Callable[[Float], Any], x: Float, m: int) -> Float:
    """Return the values (..., m) of a function of one state at states (..., n).

    Examples
    --------
    >>> over_leading_axes("h(x)", lambda x: x[0] * x[1], np.array([[1.0, 2.0], [3.0, 4.0]]), 1)
    array([[ 2.],
           [12.]])
    """
    if x.ndim == 0:
        raise ValueError("x must have shape (..., n); got a number")
    states = x.reshape(math.prod(x.shape[:-1]), x.shape[-1])
    values = np.empty((len(states), m))
    for row, each in zip(values, states, strict=True):
        value = np.ravel(real(name, f(each)))
        if value.shape != (m,):
            raise ValueError(f"{name} must have shape ({m},); got {value.shape}")
        row[:] = value
    return values.reshape(*x.shape[:-1], m)
