"""Covariances of directions in the tangent plane of the sphere."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models.arrays.sphere import azimuth_elevation
from arrivals.measurement_models.manifolds.manifold import UNIFORM_STD_OF_CIRCLE
from arrivals.measurement_models.manifolds.points import matrices
from arrivals.typing import Float


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
    C = turn @ matrices(covariance) @ turn.swapaxes(1, 2)
    std = np.sqrt(np.maximum(C[:, 1, 1], 0.0)) / np.maximum(level, 1e-12)
    std = np.minimum(std, UNIFORM_STD_OF_CIRCLE)
    return {"doa": azimuth, "std": std, "elevation": elevation, "covariance": C}
