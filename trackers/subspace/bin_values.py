"""Quantities that are a number for one bin, and an array for several."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.typing import Bool, Complex


def where_bins(bins: Bool | None, new: Any, old: Any) -> Any:
    """Return new values of some of the bins, (n_bins,), or of all if None.

    Examples
    --------
    >>> where_bins(np.array([True, False]), np.ones((2, 3)), np.zeros((2, 3)))
    array([[1., 1., 1.],
           [0., 0., 0.]])
    """
    if bins is None:
        return new
    return np.where(bins.reshape(-1, *[1] * (np.ndim(new) - 1)), new, old)


def power_of(y: Complex) -> Any:
    """Return ‖y‖² of a snapshot (n,), a float, or of those of bins (n_bins, n).

    Examples
    --------
    >>> power_of(np.array([3.0, 4j]))
    25.0
    """
    return float(np.vdot(y, y).real) if y.ndim == 1 else (y.real**2 + y.imag**2).sum(axis=-1)


def larger(a: Any, b: Any) -> Any:
    """Return the larger of two numbers, or of the values of each bin.

    Examples
    --------
    >>> larger(1.0, 2.0), larger(np.array([1.0, 3.0]), 2.0)
    (2.0, array([2., 3.]))
    """
    return max(a, b) if isinstance(a, float) else np.maximum(a, b)


def column(x: Any) -> Any:
    """Return a number, or those of the bins as a column.

    Examples
    --------
    >>> column(np.array([1.0, 3.0])).shape
    (2, 1)
    """
    return x if isinstance(x, float) else x[..., None]


def is_zero(x: Any) -> bool:
    """Return True if a number, or that of each bin, is zero.

    Examples
    --------
    >>> is_zero(0.0), is_zero(np.array([0.0, 1.0]))
    (True, False)
    """
    return x == 0 if isinstance(x, float) else not x.any()
