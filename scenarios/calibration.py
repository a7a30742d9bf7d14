"""Whether stated standard deviations are those of the errors."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.checks import real
from arrivals.typing import Float


def circular_nees(error: ArrayLike, std: ArrayLike) -> float:
    """Average the errors on the circle, squared, over what the stated deviations make expected.

    2 (1 - cos e) / 2 (1 - exp(-σ²/2)): chords in place of arcs, so that neither a large error nor
    a wide density leaves the circle. 1 if the deviations are right, larger if they are too small.

    Parameters
    ----------
    error : array_like, shape (n,)
        rad.
    std : array_like, shape (n,)
        Circular standard deviations √(-2 ln R), rad, as trackers state them.

    Returns
    -------
    float
        NaN for no errors.

    Raises
    ------
    ValueError
        If a deviation is not positive, or is NaN where there is an error.

    References
    ----------
    Mardia and Jupp, *Directional Statistics*, 2000, (2.3.12); Bar-Shalom, Li, Kirubarajan,
    *Estimation with Applications to Tracking and Navigation*, 2001, sec. 5.4.2, for the straight
    line.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> round(circular_nees(rng.normal(0, 0.02, 10_000), np.full(10_000, 0.02)), 1)
    1.0
    """
    e, s = _stated(error, std)
    return (
        float(np.mean(4 * np.sin(e / 2) ** 2 / (-2 * np.expm1(-(s**2) / 2)))) if e.size else np.nan
    )


def coverage(error: ArrayLike, std: ArrayLike, level: float = 0.95) -> float:
    """Return the share of errors within the normal interval of a level about the estimate.

    Parameters
    ----------
    error, std : array_like, shape (n,)
        rad.
    level : float
        In (0, 1).

    Returns
    -------
    float
        NaN for no errors.

    Raises
    ------
    ValueError
        As `circular_nees`; if the level is out of range.

    Examples
    --------
    >>> coverage([0.1, -0.1, 0.3], [0.1, 0.1, 0.1], level=0.95)
    0.6666666666666666
    """
    from scipy.special import ndtri

    if not 0 < level < 1:
        raise ValueError(f"level must lie in (0, 1); got {level}")
    e, s = _stated(error, std)
    e = (e + np.pi) % (2 * np.pi) - np.pi
    return float(np.mean(np.abs(e) <= ndtri((1 + level) / 2) * s)) if e.size else np.nan


def _stated(error: ArrayLike, std: ArrayLike) -> tuple[Float, Float]:
    e, s = real("error", error), real("std", std)
    if e.shape != s.shape:
        raise ValueError(f"error and std must have the same shape; got {e.shape} and {s.shape}")
    if not (s > 0).all():
        raise ValueError("std must be positive wherever there is an error")
    return e, s
