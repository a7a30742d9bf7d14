"""Deep comparison of beliefs, estimates and trackers, with messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from arrivals.messages import shown


def difference(a: Any, b: Any, where: str = "value") -> str | None:
    """Return a description of the first difference of two values, or None.

    NaN equals NaN. Arrays, numbers, containers and the attributes of objects are compared.

    Parameters
    ----------
    a, b : object
        Values to compare.
    where : str
        Name of the values in the description.

    Returns
    -------
    str or None
        Path, and both values.

    Examples
    --------
    >>> difference({"x": np.zeros(2)}, {"x": np.ones(2)}, "belief")
    'belief.x: [0. 0.] became [1. 1.]'
    >>> difference([1.0, np.nan], [1.0, np.nan])
    """
    return _difference(a, b, where, set())


def _difference(a: Any, b: Any, where: str, seen: set[tuple[int, int]]) -> str | None:
    if a is b or (id(a), id(b)) in seen:
        return None
    seen.add((id(a), id(b)))
    if type(a) is not type(b):
        return _changed(where, a, b)
    if isinstance(a, np.ndarray) and a.dtype != object:
        same = a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc")
        return None if same else f"{where}: {a} became {b}"
    if isinstance(a, float | complex | np.number):
        return None if a == b or (a != a and b != b) else _changed(where, a, b)
    if isinstance(a, np.random.Generator):
        a, b = a.bit_generator.state, b.bit_generator.state
    parts_a, parts_b = _parts(a), _parts(b)
    if parts_a is None or parts_b is None:
        return None if a == b else _changed(where, a, b)
    if parts_a.keys() != parts_b.keys():
        return f"{where}: {sorted(map(str, parts_a))} became {sorted(map(str, parts_b))}"
    differences = (
        _difference(parts_a[key], parts_b[key], f"{where}.{key}", seen) for key in parts_a
    )
    return next(filter(None, differences), None)


def _changed(where: str, a: Any, b: Any) -> str:
    return f"{where}: {shown(a)} became {shown(b)}"


def _parts(value: Any) -> dict[Any, Any] | None:
    """Return the items of a container or the attributes of an object; None for other values."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, list | tuple | np.ndarray):
        return dict(enumerate(value.ravel() if isinstance(value, np.ndarray) else value))
    if callable(value) or not hasattr(value, "__dict__"):
        return None
    parts: dict[str, Any] = vars(value)
    return parts


def assert_same(a: Any, b: Any, what: str) -> None:
    """Raise an AssertionError that describes the first difference of two values."""
    message = difference(a, b, what)
    if message:
        raise AssertionError(message)


def assert_near(a: dict[str, Any], b: dict[str, Any], what: str) -> None:
    """Raise an AssertionError if arrays differ by more than 1e-9, relative or absolute."""
    assert_same(sorted(a), sorted(b), what)
    for name, array in a.items():
        other = b[name]
        same = array.shape == other.shape and np.allclose(
            array, other, rtol=1e-9, atol=1e-9, equal_nan=array.dtype.kind in "fc"
        )
        require(same, f"{what}.{name}: {array} became {other}")


def require(condition: bool | np.bool_, message: str) -> None:
    """Raise an AssertionError with the message unless a condition holds."""
    if not condition:
        raise AssertionError(message)
