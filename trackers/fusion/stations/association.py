"""Association of detections with tracks by loopy belief propagation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.typing import Float
from arrivals.validation import LARGEST, real


def associate(odds: ArrayLike, *, n_sweeps: int = 30, tol: float = 1e-4) -> tuple[Float, Float]:
    """Return probabilities that tracks caused detections, each at most one of the other.

    Parameters
    ----------
    odds : array_like, shape (..., n_tracks, n_detections)
        Likelihood of "detection j is of track i" relative to that of "i is not detected, and j is
        clutter".
    n_sweeps : int
        Sweeps at most.
    tol : float
        Change of the messages at which a problem ends; each of a batch by itself.

    Returns
    -------
    probabilities : ndarray, shape (..., n_tracks, n_detections)
        Rows and columns sum to at most one.
    log_evidence : ndarray, shape (...)
        Bethe approximation of the logarithm of Σ Π odds over all associations.

    Raises
    ------
    ValueError
        If an odds is negative, not finite or above 1e140, or there are fewer than two axes.

    Notes
    -----
    Exact if there is one track or one detection. Otherwise the evidence is a lower bound.

    References
    ----------
    Williams and Lau, "Approximate evaluation of marginal association probabilities with belief
    propagation", IEEE Trans. Aerosp. Electron. Syst. 50(4), 2014.

    Examples
    --------
    >>> probabilities, log_evidence = associate([[4.0, 1.0], [0.0, 0.0]])
    >>> probabilities.round(3), float(log_evidence.round(3))
    (array([[0.667, 0.167],
           [0.   , 0.   ]]), 1.792)
    """
    odds = real("odds", odds)
    if odds.ndim < 2:
        raise ValueError(f"odds must have shape (..., n_tracks, n_detections); got {odds.shape}")
    if not ((odds >= 0) & (odds < LARGEST)).all():
        raise ValueError(f"odds must lie in [0, {LARGEST}]; got {shown(odds)}")
    if odds.size == 0:
        return np.zeros(odds.shape), np.zeros(odds.shape[:-2])
    n = _messages(odds, n_sweeps, tol)
    p = odds * n
    mu = odds / (1 + p @ _others(odds.shape[-1]))
    row = p.sum(axis=-1)
    # ln Z = Σ_i ln(1 + Σ_j p) + Σ_j ln(1 + Σ_i mu) - Σ_ij ln(1 + n mu)
    log_evidence = np.log1p(row).sum(axis=-1) + np.log1p(mu.sum(axis=-2)).sum(axis=-1)
    log_evidence = log_evidence - np.log1p(n * mu).sum(axis=(-2, -1))
    # β = p / (1 + Σ_j p); columns sum to one at most where the sweeps have converged
    beta = p / (1 + row[..., None])
    return beta / np.maximum(beta.sum(axis=-2, keepdims=True), 1.0), np.asarray(log_evidence)


def _messages(odds: Float, n_sweeps: int, tol: float) -> Float:
    """Return the messages of detections to tracks, (..., n_tracks, n_detections)."""
    others_i, others_j = (_others(size) for size in odds.shape[-2:])
    n = np.ones(odds.shape)
    is_batch = odds.ndim > 2
    running = np.ones((*odds.shape[:-2], 1, 1), dtype=np.bool_)
    for _ in range(n_sweeps):
        # mu = odds / (1 + Σ_l≠j p),  p = odds n;   n = 1 / (1 + Σ_k≠i mu)
        mu = odds / (1 + (odds * n) @ others_j)
        new = 1 / (1 + others_i @ mu)
        change = np.abs(new - n).max(axis=(-2, -1), keepdims=is_batch)
        n = np.where(running, new, n) if is_batch else new
        running = running & (change >= tol)
        if not running.any():
            break
    return n


def _others(size: int) -> Float:
    """Return the matrix of sums over all others, free of the cancellation of a difference."""
    return np.asarray(1.0 - np.eye(size))
