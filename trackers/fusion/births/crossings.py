"""Positions from bearings of several stations: least-squares intersection."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float
from arrivals.validation import real

MIN_SQUARED_RANGE = 1e-6  # m²; nearer to a station the slopes of its azimuth are limited
MIN_DETERMINANT = 1e-14  # of the squared trace of a 2 x 2 information; below, it is singular


def crossing(
    positions: ArrayLike,
    azimuth: ArrayLike,
    variance: ArrayLike,
    *,
    n_steps: int = 4,
    position_variance: ArrayLike = 0.0,
) -> tuple[Float, Float, Float]:
    """Return the positions at which bearings cross, their covariance, and the residuals.

    Gauss-Newton from the point of least squared distance from the lines.

    Parameters
    ----------
    positions : array_like, shape (..., n, 2)
        Of the stations, m.
    azimuth : array_like, shape (..., n)
        Bearings on the map, rad, anticlockwise from the x axis.
    variance : array_like, shape (..., n)
        Their variances, rad²; infinite where a station does not belong to the set.
    n_steps : int
        Gauss-Newton steps, at least one.
    position_variance : array_like, shape (..., n)
        Variance of each coordinate of a station, m²; adds itself over r² to that of its bearing.

    Returns
    -------
    x : ndarray, shape (..., 2)
        Positions, m; NaN where the bearings are parallel or fewer than two.
    covariance : ndarray, shape (..., 2, 2)
        Inverse information at the last step, m².
    residual : ndarray, shape (..., n)
        Bearing minus azimuth of x, rad, in [-π, π]; of stations that are no members, too.

    Examples
    --------
    >>> stations = [[0.0, 0.0], [10.0, 0.0], [0.0, 5.0]]
    >>> x, C, residual = crossing(stations, np.deg2rad([45, 135, 90]), [1e-4, 1e-4, np.inf])
    >>> x.round(6), np.sqrt(C.diagonal()).round(3), np.rad2deg(residual).round(6)
    (array([5., 5.]), array([0.071, 0.071]), array([ 0.,  0., 90.]))
    """
    positions, azimuth = real("positions", positions), real("azimuth", azimuth)
    variance, spread = real("variance", variance), real("position_variance", position_variance)
    px, py = positions[..., 0], positions[..., 1]
    c, s = np.cos(azimuth), np.sin(azimuth)
    with np.errstate(all="ignore"):
        # min Σ (n'(x - s))² / R,  n = (-sin b, cos b)
        w = 1 / variance
        x, y, covariance = _solved(w, -s, c, c * py - s * px)
        for _ in range(n_steps):
            dx, dy = x[..., None] - px, y[..., None] - py
            square = np.maximum(dx * dx + dy * dy, MIN_SQUARED_RANGE)
            w = 1 / (variance + spread / square)
            e = np.arctan2(s * dx - c * dy, c * dx + s * dy)
            # x = x + C Σ H' e / R,  H = (-d_y, d_x) / d²
            step_x, step_y, covariance = _solved(w, -dy / square, dx / square, e)
            x, y = x + step_x, y + step_y
        dx, dy = x[..., None] - px, y[..., None] - py
        e = np.arctan2(s * dx - c * dy, c * dx + s * dy)
    return np.stack([x, y], axis=-1), covariance, e


def _solved(w: Float, a: Float, b: Float, e: Float) -> tuple[Float, Float, Float]:
    """Return C Σ w (a, b) e and C = (Σ w (a, b)'(a, b))⁻¹; NaN where that is singular."""
    wa, wb = w * a, w * b
    xx, xy, yy = (wa * a).sum(axis=-1), (wa * b).sum(axis=-1), (wb * b).sum(axis=-1)
    ge, gn = (wa * e).sum(axis=-1), (wb * e).sum(axis=-1)
    det = xx * yy - xy * xy
    det = np.where(det > MIN_DETERMINANT * (xx + yy) ** 2, det, np.nan)
    C = np.stack([yy, -xy, -xy, xx], axis=-1).reshape(*det.shape, 2, 2) / det[..., None, None]
    return (yy * ge - xy * gn) / det, (xx * gn - xy * ge) / det, C
