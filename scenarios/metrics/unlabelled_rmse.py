"""RMSE of unlabelled angles, a fixed number of them in each step, by the best assignment."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float
from arrivals.validation import LARGEST, positive, real


def best_assignment_rmse(
    truth: ArrayLike, estimate: ArrayLike, period: float | None = None
) -> Float:
    """Compute the RMSE of unlabelled angles, a fixed number of them in each step.

    In each step the estimates are assigned to the true angles so that the sum of squares is
    smallest. Large errors count in full, without a cut-off. For varying numbers see `rmse`.

    Parameters
    ----------
    truth, estimate : array_like, shape (..., n_steps, n_sources)
        True and estimated angles, in any unit; leading axes broadcast.
    period : float, optional
        Period of the angles; differences are wrapped.

    Returns
    -------
    ndarray, shape (...)
        Root mean square over steps and sources.

    Raises
    ------
    ValueError
        If the numbers of steps or sources differ or are zero, or a number is not finite.

    Notes
    -----
    On a line the best assignment is the one in order; on a circle it is one of the n_sources
    that keep the order around it.

    References
    ----------
    Delon, Salomon and Sobolevski, "Fast transport optimization for Monge costs on the circle",
    SIAM J. Appl. Math. 70(7), 2010, sec. 3.

    Examples
    --------
    >>> best_assignment_rmse([[10, 20], [10, 20]], [[21, 10], [11, 20]]).round(3)
    np.float64(0.707)
    """
    t, f = real("truth", truth), real("estimate", estimate)
    if t.ndim < 2 or t.shape[-2:] != f.shape[-2:] or 0 in t.shape[-2:]:
        raise ValueError(
            "truth and estimate must have shape (..., n_steps, n_sources), the same and not empty; "
            f"got {t.shape} and {f.shape}"
        )
    if not ((np.abs(t) < LARGEST).all() and (np.abs(f) < LARGEST).all()):
        raise ValueError("truth and estimate must be finite; got NaN: use rmse for missed sources")
    if period is None:
        return np.asarray(np.sqrt(((np.sort(f) - np.sort(t)) ** 2).mean(axis=(-2, -1))))
    length = positive("period", period)
    t, f = np.sort(t % length), np.sort(f % length)
    shifted = np.stack([np.roll(f, k, axis=-1) for k in range(f.shape[-1])])
    difference = np.abs(shifted - t)
    squares = np.minimum(difference, length - difference) ** 2
    return np.asarray(np.sqrt(squares.mean(axis=-1).min(axis=0).mean(axis=-1)))
