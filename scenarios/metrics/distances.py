"""Distances between true and estimated points: Euclidean, on a circle, and along great circles."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.sphere import great_circle, unit_vectors
from arrivals.typing import Float
from arrivals.validation import LARGEST, one_of, positive, real

Distance: TypeAlias = Literal["euclidean", "great_circle"]


def points(name: str, value: ArrayLike) -> Float:
    """Return the rows without NaN of points (n, dim), of angles (n,) as (n, 1)."""
    if _are_plain(value):
        return value  # type: ignore[return-value]
    given = real(name, value)
    if given.ndim not in (1, 2):
        raise ValueError(f"{name} must have shape (n,) or (n, dim); got {given.shape}")
    if np.any(np.abs(given) >= LARGEST):
        raise ValueError(f"{name} must be finite, or NaN for absent points; got an infinite value")
    given = given[:, None] if given.ndim == 1 else given
    return np.asarray(given[~np.any(np.isnan(given), axis=1)])


def _are_plain(given: ArrayLike) -> bool:
    """Return True for an array of finite points, the usual case."""
    if type(given) is not np.ndarray or given.ndim != 2 or given.dtype != np.float64:
        return False
    flat = given.ravel()
    return bool(np.dot(flat, flat) < LARGEST)  # of the squares; false for NaN


def distances(
    truth: ArrayLike, estimate: ArrayLike, period: float | None, distance: Distance = "euclidean"
) -> Float:
    """Return distances of all pairs, (n_true, n_estimates).

    Parameters
    ----------
    truth, estimate : array_like, shape (n,) or (n, dim)
        Points; rows with a NaN are left out.
    period : float or None
        Period of angles, whose differences are wrapped; of a great circle the full turn.
    distance : {"euclidean", "great_circle"}
        Great circles are between points (n, 2) of azimuth and elevation.

    Examples
    --------
    >>> distances([[0.0, 60.0]], [[180.0, 60.0], [0.0, -30.0]], 360.0, "great_circle").round(9)
    array([[60., 90.]])
    """
    t, f = points("truth", truth), points("estimate", estimate)
    on_sphere = one_of("distance", distance, ("euclidean", "great_circle")) == "great_circle"
    if on_sphere:
        full_turn(period)
    if t.shape[1] != f.shape[1]:
        if t.size and f.size:
            sizes = f"{t.shape[1]} and {f.shape[1]}"
            raise ValueError(f"truth and estimate must have the same dimension; got {sizes}")
        return np.zeros((len(t), len(f)))
    if on_sphere:
        error = tangent_errors(t[:, None], f, period)
        return np.asarray(np.linalg.norm(error, axis=-1))
    # (dim, n_true, n_estimates), in this order in memory
    difference = np.subtract(t.T[:, :, None], f.T[:, None], order="C")
    if period is not None:
        difference = np.abs(difference) % positive("period", period)
        difference = np.minimum(difference, period - difference)
    difference *= difference
    return np.asarray(np.sqrt(difference.sum(axis=0)))


def assigned(d: Float, c: float, p: float) -> Float:
    """Return distances of the pairs with the smallest sum of min(d, c)^p."""
    from scipy.optimize import linear_sum_assignment

    cost = np.minimum(d, c)
    return np.asarray(d[linear_sum_assignment(cost if p == 1 else cost**p)])


def full_turn(period: float | None) -> float:
    """Return the full turn of great circles, in the unit of the points."""
    if period is None:
        raise ValueError("period must be the full turn, 360 or 2π, of great circles; got None")
    return positive("period", period)


def tangent_errors(truth: Float, estimate: Float, period: float | None) -> Float:
    """Return errors in the tangent plane at the estimate; their norm is the great-circle distance.

    Parameters
    ----------
    truth, estimate : ndarray, shape (..., 2)
        Azimuths and elevations; NaN for absent points.
    period : float or None
        Full turn, in the unit of the points.

    Returns
    -------
    ndarray, shape (..., 2)
        Estimate minus truth: elevation, and azimuth along its circle, as in the covariance of a
        `SphereEstimate`.

    Raises
    ------
    ValueError
        If points are not pairs, or an elevation is beyond a quarter of a turn.

    Examples
    --------
    >>> tangent_errors(np.array([10.0, 60.0]), np.array([10.2, 60.3]), 360.0).round(4)
    array([0.2998, 0.1   ])
    """
    unit = 2 * np.pi / full_turn(period)
    for name, values in (("truth", truth), ("estimate", estimate)):
        if values.shape[-1] != 2:
            got = values.shape[-1]
            raise ValueError(f"{name} must have azimuth and elevation, (..., 2); got (..., {got})")
        if np.any(np.abs(values[..., 1]) * unit > np.pi / 2 * (1 + 1e-9)):
            raise ValueError(f"{name} must have elevations within ±{np.pi / 2 / unit:g}: the first "
                             "column is the azimuth, the second the elevation")  # fmt: skip
    u = unit_vectors(*np.moveaxis(truth * unit, -1, 0))
    azimuth, elevation = np.moveaxis(estimate * unit, -1, 0)
    up = unit_vectors(azimuth, elevation + np.pi / 2)
    along = unit_vectors(azimuth + np.pi / 2, 0.0)
    offset = -np.stack([np.sum(u * up, axis=-1), np.sum(u * along, axis=-1)], axis=-1)
    length = np.linalg.norm(offset, axis=-1, keepdims=True)
    # the sine of the distance; the opposite point is in any direction
    offset = np.where(length == 0, [1.0, 0.0], offset / np.where(length == 0, 1.0, length))
    angle = great_circle(u, unit_vectors(azimuth, elevation))
    return np.asarray(offset * angle[..., None] / unit)
