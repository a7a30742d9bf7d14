"""Argument checks with uniform messages: "<argument> must be <wanted>; got <value>"."""

import operator
from collections.abc import Iterable, Mapping, Set
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.messages import shown, similar, with_article
from arrivals.typing import Float

T = TypeVar("T")
LARGEST, SMALLEST = 1e140, 1e-140  # magnitudes whose squares are finite and not zero
LONGEST_STEP = 1e30  # its cube times any parameter is finite
MOST = 10**9  # of anything that is counted


def number(name: str, value: Any) -> float:
    """Return a real number as a float.

    Examples
    --------
    >>> number("kappa", "many")
    Traceback (most recent call last):
    TypeError: kappa must be a number; got 'many'
    """
    of_numpy = isinstance(value, np.generic) and value.dtype.kind in "iuf"
    if of_numpy or (isinstance(value, float | int) and not isinstance(value, bool)):
        try:
            return float(value)
        except OverflowError:
            raise ValueError(f"{name} must be at most {LARGEST}; got a larger number") from None
    raise TypeError(f"{name} must be a number; got {shown(value)}")


def positive(name: str, value: Any) -> float:
    """Return a finite number above zero.

    Examples
    --------
    >>> positive("kappa", -1)
    Traceback (most recent call last):
    ValueError: kappa must be finite and positive; got -1
    """
    size = number(name, value)
    if not 0 < size < np.inf:
        raise ValueError(f"{name} must be finite and positive; got {value}")
    if not SMALLEST < size < LARGEST:
        raise ValueError(f"{name} must be from {SMALLEST} to {LARGEST}; got {value}")
    return size


def not_negative(name: str, value: Any) -> float:
    """Return a finite number that is zero or positive.

    Examples
    --------
    >>> not_negative("q", -0.5)
    Traceback (most recent call last):
    ValueError: q must be finite and not negative; got -0.5
    """
    size = number(name, value)
    if not 0 <= size < np.inf:
        raise ValueError(f"{name} must be finite and not negative; got {value}")
    if not size < LARGEST:
        raise ValueError(f"{name} must be at most {LARGEST}; got {value}")
    return size if size > 0 or np.copysign(1.0, size) > 0 else 0.0  # no -0.0


def time_step(dt: Any) -> float:
    """Return the length of a step, a finite number that is zero or positive.

    Examples
    --------
    >>> time_step(float("nan"))
    Traceback (most recent call last):
    ValueError: dt must be finite and not negative; got nan
    """
    if type(dt) is float and 0.0 <= dt < LONGEST_STEP:
        return dt + 0.0  # the usual case; no -0.0
    step = not_negative("dt", dt)
    if not step < LONGEST_STEP:
        raise ValueError(f"dt must be at most {LONGEST_STEP}; got {dt}")
    return step


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
        wanted = "None or 0 for a method without a control input"
        raise ValueError(f"u must be {wanted}; got {shown(u)}")


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


def count(name: str, value: Any, minimum: int = 1, maximum: int = MOST) -> int:
    """Return a whole number from `minimum` to `maximum`.

    Examples
    --------
    >>> count("n_sensors", 2.5)
    Traceback (most recent call last):
    TypeError: n_sensors must be a whole number; got 2.5
    """
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        whole = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number; got {shown(value)}") from None
    if whole < minimum:
        raise ValueError(f"{name} must be at least {minimum}; got {shown(value)}")
    if whole > maximum:
        raise ValueError(f"{name} must be at most {maximum}; got {shown(value)}")
    return whole


def one_of(name: str, value: T, choices: tuple[T, ...]) -> T:
    """Return a value that is one of `choices`.

    Examples
    --------
    >>> one_of("reference", "last", ("start", "middle"))
    Traceback (most recent call last):
    ValueError: reference must be one of 'start', 'middle'; got 'last'
    """
    plain = value is None or isinstance(value, str | int | float | np.bool_)
    if not plain or value not in choices:
        got = f"{shown(value)}{similar(value, choices)}"
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}; got {got}")
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
        raise TypeError(f"{name} must be {expected}; got {shown(value)}, {given}")
    return value


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
    if type(value) is np.ndarray and value.dtype == np.float64:
        return value  # the usual case
    array = _array(name, value)
    if array.dtype.kind == "c":
        cure = "stack real and imaginary parts, [Re; Im]"
        raise TypeError(f"{name} must hold real numbers; got {array.dtype}: {cure}")
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name} must hold real numbers; got {array.dtype}")
    with np.errstate(over="ignore"):
        return array.astype(np.float64, copy=False)


def _array(name: str, value: Any) -> NDArray[Any]:
    """Return a value as an array, if it is rectangular and nothing in it is masked."""
    if np.ma.is_masked(value):
        raise ValueError(f"{name} must not be masked; got {shown(value)}")
    try:
        return np.asarray(value)
    except Exception:  # of numpy, or of the value's own __array__
        raise ValueError(f"{name} must have rows of one length; got {shown(value)}") from None


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


def items(name: str, value: Any) -> tuple[Any, ...]:
    """Return the items of a sequence.

    Examples
    --------
    >>> items("angles", [0, 2])
    (0, 2)
    >>> items("angles", 2)
    Traceback (most recent call last):
    TypeError: angles must be a sequence; got 2
    """
    is_sequence = isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping | Set)
    if not is_sequence or getattr(value, "ndim", 1) == 0:
        raise TypeError(f"{name} must be a sequence; got {shown(value)}")
    return tuple(value)


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
    if not (np.abs(matrix) < LARGEST).all():
        raise ValueError(f"{name} must be finite and at most {LARGEST}; got {shown(matrix)}")
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
    if (
        matrix.size
        and (matrix == matrix.T).all()
        and matrix.diagonal().max() < LARGEST
        and _has_factor(matrix)
    ):
        return matrix  # the usual case, three times faster than the general one
    size = np.abs(matrix).max(initial=0.0)
    if not size < LARGEST:
        raise ValueError(f"{name} must be finite and at most {LARGEST}; got {shown(matrix)}")
    if np.abs(matrix - matrix.T).max(initial=0.0) > 1e-9 * size:
        raise ValueError(f"{name} must be symmetric; got {shown(matrix)}")
    if np.linalg.eigvalsh(matrix).min(initial=0.0) < -1e-9 * size:
        raise ValueError(f"{name} must have no negative eigenvalue; got {shown(matrix)}")
    return matrix


def _has_factor(matrix: Float) -> bool:
    try:
        return bool(np.isfinite(np.linalg.cholesky(matrix)).all())
    except np.linalg.LinAlgError:
        return False
