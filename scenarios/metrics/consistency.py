"""Consistency of stated standard deviations and covariances with the errors: NEES, coverage."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float
from arrivals.validation import LARGEST, number, real


def circular_nees(error: ArrayLike, std: ArrayLike) -> float:
    """Average the squared errors on the circle, normalised by their expected values.

    2 (1 - cos e) / 2 (1 - exp(-σ²/2)): chords in place of arcs, which stay bounded for large
    errors and wide densities. 1 if the deviations are right, larger if they are too small.

    Parameters
    ----------
    error : array_like, shape (n,)
        rad.
    std : array_like, shape (n,)
        Circular standard deviations √(-2 ln R), rad, as trackers state them.

    Returns
    -------
    float
        Normalised mean square; NaN without errors.

    Raises
    ------
    ValueError
        If a deviation of an error is not positive or NaN.

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
    """Return the fraction of errors within the normal interval of a level about the estimate.

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

    half = (1 + _level(level)) / 2
    e, s = _stated(error, std)
    e = (e + np.pi) % (2 * np.pi) - np.pi
    return float(np.mean(np.abs(e) <= ndtri(half) * s)) if e.size else np.nan


def position_nees(error: ArrayLike, covariance: ArrayLike) -> float:
    """Average eᵀ P⁻¹ e over errors and their dimensions: 1 if the covariances are right.

    Parameters
    ----------
    error : array_like, shape (n, dim)
        m, or rad in the tangent plane of directions on the sphere.
    covariance : array_like, shape (n, dim, dim)
        As stated, m² or rad².

    Returns
    -------
    float
        NaN for no errors.

    Raises
    ------
    ValueError
        If a covariance of an error is not positive definite.

    References
    ----------
    Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
    (5.4.2-1).

    Examples
    --------
    >>> position_nees([[3.0, 4.0]], [[[9.0, 0.0], [0.0, 4.0]]])
    2.5
    """
    squares, dim = _mahalanobis(error, covariance)
    return float(squares.mean() / dim) if squares.size else np.nan


def position_coverage(error: ArrayLike, covariance: ArrayLike, level: float = 0.95) -> float:
    """Return the fraction of errors within the normal ellipse of a level about the estimate.

    Parameters
    ----------
    error, covariance : array_like, shapes (n, dim), (n, dim, dim)
        As in `position_nees`.
    level : float
        In (0, 1).

    Raises
    ------
    ValueError
        As `position_nees`; if the level is out of range.

    Examples
    --------
    >>> position_coverage([[1.0, 0.0], [0.0, 3.0]], [[[1.0, 0.0], [0.0, 1.0]]] * 2)
    0.5
    """
    from scipy.special import chdtri

    squares, dim = _mahalanobis(error, covariance)
    return float((squares <= chdtri(dim, 1 - _level(level))).mean()) if squares.size else np.nan


def _mahalanobis(error: ArrayLike, covariance: ArrayLike) -> tuple[Float, int]:
    """Return eᵀ P⁻¹ e (n,), and the dimension."""
    e, P = real("error", error), real("covariance", covariance)
    if e.ndim != 2 or P.shape != (*e.shape, e.shape[-1]):
        raise ValueError(
            "error and covariance must have shapes (n, dim) and (n, dim, dim); "
            f"got {e.shape} and {P.shape}"
        )
    if not (np.abs(P) < LARGEST).all() or not (np.linalg.eigvalsh(P) > 1 / LARGEST).all():
        raise ValueError("covariance must be positive definite for every error")
    _finite(e)
    return np.einsum("ni,ni->n", e, np.linalg.solve(P, e[..., None])[..., 0]), e.shape[1]


def _level(level: float) -> float:
    if not 0 < number("level", level) < 1:
        raise ValueError(f"level must lie in (0, 1); got {level}")
    return level


def _stated(error: ArrayLike, std: ArrayLike) -> tuple[Float, Float]:
    e, s = real("error", error), real("std", std)
    if e.shape != s.shape:
        raise ValueError(f"error and std must have the same shape; got {e.shape} and {s.shape}")
    if not (s > 1 / LARGEST).all():
        raise ValueError("std must be positive for every error")
    _finite(e)
    return e, np.minimum(s, 1e3)  # as good as uniform


def _finite(error: Float) -> None:
    if not (np.abs(error) < LARGEST).all():
        raise ValueError("error must be finite; got NaN, or an infinite one: leave it out")
