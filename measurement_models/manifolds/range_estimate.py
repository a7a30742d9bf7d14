"""Directions and ranges of points on a line, with their deviations."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models.manifolds.points import line_direction
from arrivals.typing import Float

MIN_DEVIATIONS = 3.0  # of 1/R from zero, for a range


def range_estimate(
    sine: Float, unit: float, inverse_range: Float, rates: tuple[Float, Float], covariance: Float
) -> dict[str, Float]:
    """Return the fields of an estimate of directions and ranges.

    Parameters
    ----------
    sine : ndarray, shape (L,)
        sin β.
    unit : float
        Change of sin β with the first unknown.
    inverse_range : ndarray, shape (L,)
        1/R, 1/m.
    rates : tuple of ndarray, shape (L,)
        Change of 1/R with each unknown.
    covariance : ndarray, shape (3, L)
        Upper triangles of the covariances of the unknowns.

    Returns
    -------
    dict of str to ndarray
        doa and std, rad; range and range_std, m, infinite and NaN where 1/R is within three
        standard deviations of zero; covariance (L, 2, 2) of β and 1/R.

    Examples
    --------
    >>> one = np.ones(1)
    >>> fields = range_estimate(0 * one, 1.0, 0.5 * one, (0 * one, one), 1e-4 * np.ones((3, 1)))
    >>> {name: fields[name].round(4).tolist() for name in ("range", "range_std", "std")}
    {'range': [2.0], 'range_std': [0.04], 'std': [0.01]}
    """
    s11, s12, s22 = covariance
    std_of_sine = unit * np.sqrt(s11)
    doa, std = line_direction(sine, std_of_sine)
    by_one, by_two = rates
    slope = unit * std / np.maximum(std_of_sine, 1e-300)  # dβ by the first unknown
    variance = by_one**2 * s11 + 2 * by_one * by_two * s12 + by_two**2 * s22
    cross = slope * (by_one * s11 + by_two * s12)
    C = np.stack([np.stack([std**2, cross]), np.stack([cross, variance])])
    deviation = np.sqrt(np.maximum(variance, 0.0))
    curved = (inverse_range > MIN_DEVIATIONS * deviation) & (inverse_range > 0)
    R = 1 / np.where(curved, inverse_range, 1.0)
    return {
        "doa": doa,
        "std": std,
        "range": np.where(curved, R, np.inf),
        "range_std": np.where(curved, R * R * deviation, np.nan),
        "covariance": np.moveaxis(C, 2, 0),
    }
