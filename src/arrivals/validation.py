"""Argument checks with uniform messages: "<argument> must be <wanted>; got <value>"."""

import operator
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float

T = TypeVar("T")


def number(name: str, value: Any) -> float:
    """Return a real number as a float.

    Examples
    --------
    >>> number("kappa", "many")
    Traceback (most recent call last):
    TypeError: kappa must be a number; got 'many'
    """
    if isinstance(value, bool | str | bytes) or not np.isscalar(value) or not np.isrealobj(value):
        raise TypeError(f"{name} must be a number; got {value!r}")
    try:
        return float(value)  # type: ignore[arg-type]  # any scalar with __float__
    except OverflowError:
        raise ValueError(f"{name} must be at most 1.8e308; got a larger whole number") from None
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number; got {value!r}") from None


def positive(name: str, value: Any) -> float:
    """Return a finite number above zero.

    Examples
    --------
    >>> positive("kappa", -1)
    Traceback (most recent call last):
    ValueError: kappa must be finite and positive; got -1
    """
    if not 0 < number(name, value) < np.inf:
        raise ValueError(f"{name} must be finite and positive; got {value}")
    return float(value)


def not_negative(name: str, value: Any) -> float:
    """Return a finite number that is zero or positive.

    Examples
    --------
    >>> not_negative("q", -0.5)
    Traceback (most recent call last):
    ValueError: q must be finite and not negative; got -0.5
    """
    if not 0 <= number(name, value) < np.inf:
        raise ValueError(f"{name} must be finite and not negative; got {value}")
    return float(value)


def time_step(dt: Any) -> float:
    """Return the length of a step, a finite number that is zero or positive.

    Examples
    --------
    >>> time_step(float("nan"))
    Traceback (most recent call last):
    ValueError: dt must be finite and not negative; got nan
    """
    if type(dt) is float and 0.0 <= dt < np.inf:
        return dt  # the usual case
    return not_negative("dt", dt)


def no_control(u: ArrayLike | None) -> None:
    """Refuse a control input that is not zero, for methods without one.

    Examples
    --------
    >>> no_control(None), no_control(0)
    (None, None)
    >>> no_control(0.5)
    Traceback (most recent call last):
    ValueError: u must be None or 0 for a method without a control input; got 0.5
    """
    if u is not None and np.any(real("u", u)):
        raise ValueError(f"u must be None or 0 for a method without a control input; got {u}")


def probability(name: str, value: Any) -> float:
    """Return a number in the interval [0, 1].

    Examples
    --------
    >>> probability("p_activate", 1.5)
    Traceback (most recent call last):
    ValueError: p_activate must lie in [0, 1]; got 1.5
    """
    if not 0 <= number(name, value) <= 1:
        raise ValueError(f"{name} must lie in [0, 1]; got {value}")
    return float(value)


def count(name: str, value: Any, minimum: int = 1) -> int:
    """Return a whole number that is at least `minimum`.

    Examples
    --------
    >>> count("n_sensors", 2.5)
    Traceback (most recent call last):
    TypeError: n_sensors must be a whole number; got 2.5
    """
    try:
        whole = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number; got {value!r}") from None
    if isinstance(value, bool):
        raise TypeError(f"{name} must be a whole number; got {value!r}")
    if whole < minimum:
        raise ValueError(f"{name} must be at least {minimum}; got {value}")
    return whole


def one_of(name: str, value: T, choices: tuple[T, ...]) -> T:
    """Return a value that is one of `choices`.

    Examples
    --------
    >>> one_of("reference", "last", ("first", "middle"))
    Traceback (most recent call last):
    ValueError: reference must be one of 'first', 'middle'; got 'last'
    """
    if value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}; got {value!r}")
    return value


def instance(name: str, value: Any, kind: type[T]) -> T:
    """Return a value that is an instance of a class.

    Examples
    --------
    >>> instance("motion", 3, str)
    Traceback (most recent call last):
    TypeError: motion must be a str; got 3, an int
    """
    if not isinstance(value, kind):
        expected, given = with_article(kind.__name__), with_article(type(value).__name__)
        raise TypeError(f"{name} must be {expected}; got {value!r}, {given}")
    return value


def with_article(noun: str) -> str:
    """Return a noun with its indefinite article.

    Examples
    --------
    >>> with_article("animal"), with_article("tracker")
    ('an animal', 'a tracker')
    """
    return f"an {noun}" if noun[0].lower() in "aeiou" else f"a {noun}"


def shaped(name: str, value: ArrayLike, *shape: int) -> Float:
    """Return real numbers as an array of the given shape.

    Examples
    --------
    >>> shaped("z", [1, 2, 3], 2)
    Traceback (most recent call last):
    ValueError: z must have shape (2,); got (3,)
    """
    array = real(name, value)
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}; got {array.shape}")
    return array


def real(name: str, value: ArrayLike) -> Float:
    """Return real numbers as an array of floats.

    Examples
    --------
    >>> real("x", [1 + 2j])
    Traceback (most recent call last):
    TypeError: x must hold real numbers; got complex128: stack real and imaginary parts, [Re; Im]
    """
    array = np.asarray(value)
    if array.dtype.kind == "c":
        cure = "stack real and imaginary parts, [Re; Im]"
        raise TypeError(f"{name} must hold real numbers; got {array.dtype}: {cure}")
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name} must hold real numbers; got {array.dtype}")
    return array.astype(np.float64, copy=False)


def state(x: ArrayLike, dim_x: int) -> Float:
    """Return states (..., dim_x) as floats.

    Examples
    --------
    >>> state([[1.0], [2.0]], 2)
    Traceback (most recent call last):
    ValueError: states must have shape (..., 2); got the column (2, 1): pass x.ravel()
    """
    array = real("x", x)
    if array.ndim == 0 or array.shape[-1] != dim_x:
        column = array.shape == (dim_x, 1)
        got = f"the column {array.shape}: pass x.ravel()" if column else f"{array.shape}"
        raise ValueError(f"states must have shape (..., {dim_x}); got {got}")
    return array


def entry_names(name: str, value: Sequence[str], n: int) -> tuple[str, ...]:
    """Return the names of n entries, all different, or ().

    Examples
    --------
    >>> entry_names("names", ["x", "vx"], 3)
    Traceback (most recent call last):
    ValueError: names must be 3 different strings, one of each entry; got ['x', 'vx']
    """
    names = tuple(value)
    strings = not isinstance(value, str) and all(isinstance(each, str) for each in names)
    if names and not (strings and len(set(names)) == len(names) == n):
        raise ValueError(f"{name} must be {n} different strings, one of each entry; got {value!r}")
    return names


def constant(name: str, value: ArrayLike) -> Float:
    """Return a finite matrix as a read-only copy.

    Examples
    --------
    >>> constant("matrix", [1.0, 2.0])
    Traceback (most recent call last):
    ValueError: matrix must be a matrix; got shape (2,)
    """
    matrix = np.array(real(name, value))
    if matrix.ndim != 2 or matrix.size == 0:
        raise ValueError(f"{name} must be a matrix; got shape {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} must be finite; got {matrix.tolist()}")
    matrix.setflags(write=False)
    return matrix


def covariance(name: str, value: ArrayLike, n: int) -> Float:
    """Return a finite, symmetric, positive semidefinite (n, n) matrix, up to rounding.

    Examples
    --------
    >>> covariance("P", [[1.0, 2.0], [2.0, 1.0]], 2)
    Traceback (most recent call last):
    ValueError: P must have no negative eigenvalue; got [[1.0, 2.0], [2.0, 1.0]]
    """
    matrix = shaped(name, value, n, n)
    if (matrix == matrix.T).all() and _has_factor(matrix):
        return matrix  # the usual case, three times faster than the general one
    size = np.abs(matrix).max()
    if not size < np.inf:
        raise ValueError(f"{name} must be finite; got {matrix.tolist()}")
    if np.abs(matrix - matrix.T).max() > 1e-9 * size:
        raise ValueError(f"{name} must be symmetric; got {matrix.tolist()}")
    if np.linalg.eigvalsh(matrix)[0] < -1e-9 * size:
        raise ValueError(f"{name} must have no negative eigenvalue; got {matrix.tolist()}")
    return matrix


def _has_factor(matrix: Float) -> bool:
    try:
        return bool(np.isfinite(np.linalg.cholesky(matrix)).all())
    except np.linalg.LinAlgError:
        return False
