"""Whether a solution explains its readings, and whether it can be believed at all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.trackers.rss.inference.joint_posterior import Prior
from arrivals.typing import Bool, Float

POOR = 1e-3  # probability of so large a misfit, below which a fit is flagged
HOPELESS = 1e-6
FAR = 5.0  # prior deviations from the prior's mean


class Quality(NamedTuple):
    """Goodness of fit and flags, (n_batch,).

    Parameters
    ----------
    fit : ndarray
        Probability of a larger misfit q ~ χ² of M - 3K degrees of freedom; NaN if there are none.
    poor_fit : ndarray of bool
        fit < 1e-3: a wrong basin, or a model that does not hold.
    diverged : ndarray of bool
        Something is not finite, a source is more than 5 √tr Σ₀ from its prior, L is below its
        starting value, or fit < 1e-6.
    """

    fit: Float
    poor_fit: Bool
    diverged: Bool


def quality(
    q: Float, n_readings: Float, prior: Prior, theta: Float, L: Float, start: Float
) -> Quality:
    """Judge solutions.

    Parameters
    ----------
    q : ndarray, shape (n_batch,)
        Σ W r² of the solution.
    n_readings : ndarray, shape (n_batch,)
    prior : Prior
        The one at the beginning.
    theta : ndarray, shape (n_batch, n_sources, 2)
        Positions found.
    L, start : ndarray, shape (n_batch,)
        Log posteriors of solution and starting point.

    Examples
    --------
    >>> one = np.ones((1, 1))
    >>> prior = Prior(one, one, np.zeros((1, 1, 2)), np.eye(2)[None, None])
    >>> judged = quality(np.array([9.0]), 12, prior, np.zeros((1, 1, 2)), one[0], one[0])
    >>> judged.fit.round(2), judged.diverged
    (array([0.44]), array([False]))
    """
    from scipy.special import chdtrc

    degrees = n_readings - 3 * theta.shape[-2]
    with np.errstate(invalid="ignore"):
        fit = np.where(degrees > 0, chdtrc(np.maximum(degrees, 1), q), np.nan)
        variance = np.trace(prior.P, axis1=-2, axis2=-1) / np.linalg.det(prior.P)  # tr Σ₀
        away = np.square(theta - prior.theta).sum(axis=-1) > FAR**2 * variance
        lower = L - start < -1e-9 * np.abs(start)
        finite = np.isfinite(theta).all(axis=(-2, -1)) & np.isfinite(L)
        diverged = ~finite | away.any(axis=-1) | lower | (fit < HOPELESS)
        return Quality(fit, fit < POOR, diverged)
