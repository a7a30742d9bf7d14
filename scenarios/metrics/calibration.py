"""Reliability of stated probabilities of existence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float, Int
from arrivals.validation import count, real


@dataclass(frozen=True, eq=False)
class ReliabilityTable:
    """Stated probabilities by bins, those without any left out.

    Attributes
    ----------
    count : ndarray of int, shape (n_bins,)
        Statements in each bin.
    stated, observed : ndarray, shape (n_bins,)
        Mean stated probability, and share that is true.
    """

    count: Int
    stated: Float
    observed: Float


@dataclass(frozen=True, eq=False)
class Reliability:
    """Reliability of stated probabilities.

    Parameters
    ----------
    ece : float
        Expected calibration error: mean distance of stated and observed shares over the bins,
        weighted by the statements in each.
    brier : float
        Mean squared error of the statements.
    log_score : float
        Mean negative log likelihood, nats.
    table : ReliabilityTable
        Statements, stated and observed shares by bins.

    Examples
    --------
    >>> reliability([0.8, 0.8, 0.8, 0.8], [True, True, True, False]).table.observed
    array([0.75])
    """

    ece: float
    brier: float
    log_score: float
    table: ReliabilityTable


def reliability(existence: ArrayLike, hit: ArrayLike, bins: int = 10) -> Reliability:
    """Compare stated probabilities with what is true.

    Parameters
    ----------
    existence : array_like, shape (n,)
        Stated probabilities, in [0, 1].
    hit : array_like of bool, shape (n,)
        What is true of each: a source is there.
    bins : int
        Bins of equal width over [0, 1].

    Returns
    -------
    Reliability
        NaN without statements.

    Raises
    ------
    ValueError
        If the shapes differ, or a probability lies outside [0, 1] or is NaN.

    References
    ----------
    Guo, Pleiss, Sun and Weinberger, ICML 2017, (3), for the expected calibration error; Brier,
    Monthly Weather Review 78(1), 1950.

    Examples
    --------
    >>> result = reliability([0.9, 0.9, 0.9, 0.1], [True, True, False, False])
    >>> round(result.ece, 3), round(result.brier, 2), result.table.count
    (0.2, 0.21, array([1, 3]))
    """
    p, y = real("existence", existence), np.asarray(hit)
    count("bins", bins)
    if p.ndim != 1 or p.shape != y.shape:
        raise ValueError(f"existence and hit must have one shape (n,); got {p.shape}, {y.shape}")
    if not ((p >= 0) & (p <= 1)).all():
        raise ValueError(f"existence must lie in [0, 1]; got {p[~((p >= 0) & (p <= 1))][:3]}")
    if not np.isin(y, (0, 1)).all():
        raise ValueError(f"hit must hold True or False; got {y[~np.isin(y, (0, 1))][:3]}")
    if not p.size:
        empty = np.zeros(0)
        return Reliability(
            np.nan, np.nan, np.nan, ReliabilityTable(empty.astype(int), empty, empty)
        )
    from sklearn.calibration import calibration_curve
    from sklearn.metrics import brier_score_loss, log_loss

    observed, stated = calibration_curve(y, p, n_bins=bins)
    edges = np.linspace(0.0, 1.0, bins + 1)
    number = np.bincount(np.searchsorted(edges[1:-1], p), minlength=bins)  # bins as sklearn's
    number = number[number > 0]
    return Reliability(
        ece=float(number @ np.abs(stated - observed) / len(p)),
        brier=float(brier_score_loss(y.astype(int), p, pos_label=1)),
        log_score=float(log_loss(y.astype(int), p, labels=[0, 1])),
        table=ReliabilityTable(number, stated, observed),
    )
