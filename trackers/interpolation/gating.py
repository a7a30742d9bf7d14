"""Residuals that are used, and what is learned from their size."""

from __future__ import annotations

import numpy as np

from arrivals.typing import Bool, Float

WIDENING = 1.01  # of the variance of the delay in a missing snapshot
OPENING, CLOSING = 0.025, -0.0025  # relative change of the misfit with all residuals out, and none


def is_used(e: Float, variance: Float, limit: Float | None) -> Bool:
    """Return True for residuals that exist and are not too large.

    Parameters
    ----------
    e, variance : ndarray, shape (..., n)
        Residuals, NaN where there is none, and their expected variances.
    limit : ndarray, shape (..., 1), or None
        Largest square of a residual over its variance.

    Examples
    --------
    >>> is_used(np.array([0.1, np.nan, 5.0]), np.ones(3), np.array([9.0]))
    array([ True, False, False])
    """
    return np.isfinite(e) if limit is None else np.asarray(e * e <= limit * variance)


def gate_limit(
    gate: float | None, misfit: Float, variance: Float, largest_variance: float
) -> Float | None:
    """Return the limit of `is_used`: gate² times the misfit, (..., 1).

    None where the delay is known to `largest_variance` at best, beyond which residuals are not
    linear in it.

    Examples
    --------
    >>> gate_limit(5.0, np.array(2.0), np.array([0.1, 9.0]), largest_variance=1.0)
    array([[50.],
           [inf]])
    """
    if gate is None:
        return None
    known = variance < largest_variance
    if np.ndim(known) == 0:
        return np.array([gate * gate * float(misfit) if known else np.inf])
    return np.where(known, gate * gate * misfit, np.inf)[..., None]


def updated_misfit(misfit: Float, e: Float, used: Bool) -> Float:
    """Return misfits (...) after residuals (..., n), used or not.

    A misfit is 1, and grows while residuals are left out: else a source that jumped would be left
    out for ever.

    Examples
    --------
    >>> updated_misfit(np.array(1.0), np.array([9.0, np.nan]), np.array([False, False]))
    array(1.025)
    """
    if used.all() and (misfit == 1).all():
        return misfit  # the usual case
    n = np.isfinite(e).sum(axis=-1)
    out = 1 - used.sum(axis=-1) / np.maximum(n, 1)
    change = np.where(n > 0, CLOSING + (OPENING - CLOSING) * out, 0.0)
    return np.asarray(np.maximum(misfit * (1 + change), 1.0))


def widened(P: Float, missing: Bool, largest: float) -> Float:
    """Return covariances with a wider delay where the last snapshot was missing, (...).

    Its variance grows up to `largest`.

    Examples
    --------
    >>> widened(np.eye(1), np.array(True), largest=4.0)
    array([[1.01]])
    """
    if not missing.any():
        return P
    room = np.maximum(largest / np.maximum(P[..., 0, 0], np.finfo(float).tiny), 1.0)
    scale = np.ones(P.shape[:-1])
    scale[..., 0] = np.sqrt(np.where(missing, np.minimum(room, WIDENING), 1.0))
    return np.asarray(scale[..., :, None] * P * scale[..., None, :])
