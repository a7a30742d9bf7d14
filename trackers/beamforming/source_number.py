"""Number of sources by information criteria on the eigenvalues of a covariance.

Equation numbers are those of Wax and Kailath, "Detection of signals by information theoretic
criteria", IEEE Trans. ASSP 33(2), 1985.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float, Int
from arrivals.validation import one_of, positive, real

Criterion: TypeAlias = Literal["aic", "mdl"]
MIN_RELATIVE_EIGENVALUE = 1e-12  # smaller eigenvalues are clipped to this part of the largest


def aic(eigenvalues: ArrayLike, n_snapshots: float) -> Float:
    """Return Akaike's criterion for 0, 1, ... sources; the minimum is best.

    Parameters
    ----------
    eigenvalues : array_like, shape (..., n_sensors)
        Of the mean covariance, in any order.
    n_snapshots : float
        Number of snapshots of the mean. With fewer than n_sensors the smallest eigenvalues are
        zero for any data, and only the n_snapshots largest are used.

    Returns
    -------
    ndarray, shape (..., n_sensors)
        For 0 to n_sensors - 1 sources; infinite for n_snapshots sources and more.

    Raises
    ------
    ValueError
        If eigenvalues or snapshots are missing, or an eigenvalue is not finite.

    References
    ----------
    Wax and Kailath, (16).

    Examples
    --------
    >>> aic([21.2359, 2.1717, 1.4279, 1.0979, 1.0544, 0.9432, 0.7324], 100).argmin()
    np.int64(2)
    """
    misfit, n_free = _misfit(eigenvalues, n_snapshots)
    return np.asarray(2 * misfit + 2 * n_free)  # (16)


def mdl(eigenvalues: ArrayLike, n_snapshots: float) -> Float:
    """Return Rissanen's criterion, the minimum description length, for 0, 1, ... sources.

    Parameters
    ----------
    eigenvalues : array_like, shape (..., n_sensors)
        As in `aic`.
    n_snapshots : float
        As in `aic`; unlike `aic`, the estimated number is consistent as n_snapshots grows.

    Returns
    -------
    ndarray, shape (..., n_sensors)
        For 0 to n_sensors - 1 sources; infinite for n_snapshots sources and more.

    Raises
    ------
    ValueError
        As in `aic`.

    References
    ----------
    Wax and Kailath, (17); their example.

    Examples
    --------
    >>> mdl([21.2359, 2.1717, 1.4279, 1.0979, 1.0544, 0.9432, 0.7324], 100).round(1)
    array([590.4,  67.2,  66.9,  80.7,  95.5, 105.2, 110.5])
    """
    misfit, n_free = _misfit(eigenvalues, n_snapshots)
    return np.asarray(misfit + n_free / 2 * np.log(n_snapshots))  # (17)


def number_of_sources(
    eigenvalues: ArrayLike,
    n_snapshots: float,
    criterion: Criterion = "mdl",
    *,
    joint: bool = False,
) -> Int:
    """Return the number of sources that minimizes a criterion.

    Parameters
    ----------
    eigenvalues : array_like, shape (..., n_sensors)
        As in `aic`.
    n_snapshots : float
        As in `aic`.
    criterion : {"mdl", "aic"}
        The criterion.
    joint : bool
        Minimize the sum of the criterion over the axis before the last: one number for
        independent covariances, those of frequency bins.

    Returns
    -------
    ndarray of int, shape (...)
        Number of sources.

    Examples
    --------
    >>> number_of_sources([[9.0, 1.1, 0.9], [1.1, 1.0, 0.9]], 50)
    array([1, 0])
    """
    one_of("criterion", criterion, ("aic", "mdl"))
    values = {"aic": aic, "mdl": mdl}[criterion](eigenvalues, n_snapshots)
    values = values.sum(axis=-2) if joint else values
    return np.asarray(values.argmin(axis=-1))


def _misfit(eigenvalues: ArrayLike, n_snapshots: float) -> tuple[Float, Float]:
    """Return the negative log-likelihood and the number of free parameters for k sources."""
    n = positive("n_snapshots", n_snapshots)
    values = real("eigenvalues", eigenvalues)
    if values.ndim == 0 or values.shape[-1] == 0 or not np.isfinite(values).all():
        raise ValueError(f"eigenvalues must be finite, at least one; got {eigenvalues!r}")
    p = values.shape[-1]
    used = max(1, min(p, int(n)))
    values = -np.sort(-values, axis=-1)[..., :used]
    floor = np.maximum(MIN_RELATIVE_EIGENVALUE * values[..., :1], np.finfo(float).tiny)
    values = np.maximum(values, floor)
    k = np.arange(used)
    arithmetic = _tails(values) / (used - k)
    geometric = _tails(np.log(values)) / (used - k)
    misfit = n * (used - k) * (np.log(arithmetic) - geometric)
    beyond = np.full((*values.shape[:-1], p - used), np.inf)
    return np.concatenate([misfit, beyond], axis=-1), np.arange(p) * (2 * p - np.arange(p))


def _tails(values: Float) -> Float:
    """Return the sums of each value and all later ones."""
    return np.asarray(values[..., ::-1].cumsum(axis=-1)[..., ::-1])
