"""State vector and covariance of reported directions: slots of equal size, padded."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.estimates import DirectionEstimate
from arrivals.typing import Bool, Float, Int

EMPTY: dict[type[DirectionEstimate], DirectionEstimate] = {}  # frozen, of arrays of length zero


def padded(values: Float | Int | Bool, n: int, filler: float) -> Float:
    """Return the first n values as floats, padded to length n.

    Parameters
    ----------
    values : ndarray, shape (n_values, ...)
        Values.
    n : int
        Length of the result.
    filler : float
        Padding value.

    Returns
    -------
    ndarray, shape (n, ...)
        Padded values.

    Examples
    --------
    >>> padded(np.array([1.0, 2.0]), 4, np.nan)
    array([ 1.,  2., nan, nan])
    """
    full = np.empty((n, *values.shape[1:]))
    full[: len(values)], full[len(values) :] = values[:n], filler
    return full


def state_of(estimate: DirectionEstimate, n_slots: int) -> tuple[Float, Float]:
    """Return the unknowns of n_slots sources and their covariance, of one block a source.

    Parameters
    ----------
    estimate : DirectionEstimate
        Sources, each with d unknowns.
    n_slots : int
        Number of blocks.

    Returns
    -------
    x : ndarray, shape (n_slots * d,)
        Unknowns; NaN in unused slots.
    P : ndarray, shape (n_slots * d, n_slots * d)
        Covariance; 0 where it is unknown.

    Examples
    --------
    >>> state_of(DirectionEstimate.empty(), 2)
    (array([nan, nan]), array([[0., 0.],
           [0., 0.]]))
    """
    values, covariance = estimate.unknowns()
    n, d = n_slots, values.shape[1]
    blocks, known = np.zeros((n, d, n, d)), ~np.isnan(covariance[:n])
    if known.any():
        index = np.arange(len(known))
        blocks[index, :, index] = np.where(known, covariance[:n], 0.0)
    return padded(values.ravel(), n * d, np.nan), blocks.reshape(n * d, n * d)


def no_direction(kind: type[DirectionEstimate]) -> DirectionEstimate:
    """Return the estimate of a step without a detected source, cached.

    Examples
    --------
    >>> no_direction(DirectionEstimate).n_found
    0
    """
    if kind not in EMPTY:
        EMPTY[kind] = kind.empty()
    return EMPTY[kind]
