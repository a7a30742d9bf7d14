"""Fields of estimates of points: directions on the sphere, and directions with ranges."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models.arrays.sphere import azimuth_elevation
from arrivals.measurement_models.manifolds.manifold import UNIFORM_STD_OF_CIRCLE
from arrivals.measurement_models.manifolds.points import line_direction
from arrivals.symmetric import full
from arrivals.typing import Float

MIN_DEVIATIONS = 3.0  # of 1/R from zero, for a range


def tangent_estimate(n: Float, axes: Float, inverse: Float, covariance: Float) -> dict[str, Float]:
    """Return the fields of an estimate of directions with covariances.

    Parameters
    ----------
    n : ndarray, shape (3, L)
        Unit vectors to the sources.
    axes : ndarray, shape (2, 3, L)
        Orthonormal tangents.
    inverse : ndarray, shape (2, 2, L)
        Change along the tangents, rad, with each unknown.
    covariance : ndarray, shape (3, L)
        Upper triangles of the covariances of the unknowns.

    Returns
    -------
    dict of str to ndarray
        doa and std (azimuth), elevation, and covariance (L, 2, 2), rad², of elevation and of
        azimuth times cos(elevation).

    Examples
    --------
    >>> n, axes = np.array([[1.0], [0.0], [0.0]]), np.eye(3)[1:, :, None]
    >>> fields = tangent_estimate(n, axes, np.eye(2)[..., None], np.array([[4.0], [0.0], [1.0]]))
    >>> fields["covariance"].round(3), float(fields["std"][0].round(3))
    (array([[[1., 0.],
            [0., 4.]]]), 1.814)
    """
    azimuth, elevation = azimuth_elevation(n.T)
    c, s, level = np.cos(azimuth), np.sin(azimuth), np.cos(elevation)
    rise = np.sin(elevation)
    own = np.stack([[-rise * c, -rise * s, level], [-s, c, 0 * c]])  # of elevation and azimuth
    turn = np.einsum("iml,jml->lij", own, axes) @ np.moveaxis(inverse, 2, 0)
    C = turn @ np.moveaxis(full(covariance), 2, 0) @ turn.swapaxes(1, 2)
    std = np.sqrt(np.maximum(C[:, 1, 1], 0.0)) / np.maximum(level, 1e-12)
    std = np.minimum(std, UNIFORM_STD_OF_CIRCLE)
    return {"doa": azimuth, "std": std, "elevation": elevation, "covariance": C}


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
