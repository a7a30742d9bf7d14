"""Directions, elevations and ranges of components, by the kind of their manifold."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.manifolds.manifold import (
    Manifold,
    angle_manifold,
    is_point_manifold,
)
from arrivals.motion_models.bessel import bessel_ratio
from arrivals.symmetric import inverse
from arrivals.trackers.direction_estimates import RangeEstimate, SphereEstimate
from arrivals.trackers.estimates import DirectionEstimate
from arrivals.trackers.svalse.components import ComponentPosterior
from arrivals.typing import Bool, Complex, Float


def estimate_kind(manifold: Manifold) -> type[DirectionEstimate]:
    """Return the class of the estimates of a manifold."""
    if not is_point_manifold(manifold):
        return DirectionEstimate
    n_pairs = manifold.n_unknowns * (manifold.n_unknowns + 1) // 2
    none = manifold.located(np.zeros((manifold.point_size, 0)), np.zeros((n_pairs, 0)))
    if "elevation" in none:
        return SphereEstimate
    return RangeEstimate if "range" in none else DirectionEstimate


def is_direction(manifold: Manifold, theta: Float, spread: Float) -> Bool:
    """Return which components belong, within three standard deviations, to a real direction.

    Parameters
    ----------
    manifold : Manifold
    theta : ndarray, shape (n,) or (n, point_size)
        Angles, rad, or points.
    spread : ndarray, shape (n,) or (n, d(d+1)/2)
        Their standard deviations, or upper triangles of covariances.
    """
    if is_point_manifold(manifold):
        return manifold.exists(theta.T, spread.T)
    doa = angle_manifold("svalse", manifold).to_doa(theta, slack=3 * spread)
    return np.asarray(~np.isnan(doa))


def located(
    manifold: Manifold, theta: Float, spread: Float, curved: Bool | None = None
) -> dict[str, Any]:
    """Return directions and what else an estimate has, as its fields.

    Parameters
    ----------
    manifold, theta, spread
        As in `is_direction`.
    curved : ndarray of bool, shape (n,), optional
        Which are curved waves; the range of the others is infinite.
    """
    if is_point_manifold(manifold):
        fields = manifold.located(theta.T, spread.T)
        if curved is not None and "range" in fields:
            fields["range"] = np.where(curved, fields["range"], np.inf)
            fields["range_std"] = np.where(curved, fields["range_std"], np.nan)
        return fields
    angles = angle_manifold("svalse", manifold)
    return {"doa": angles.to_doa(theta, slack=np.inf), "std": angles.doa_std(theta, spread)}


def amplitudes(manifold: Manifold, w: ArrayLike, theta: Float) -> Complex:
    """Return amplitudes at the origin of coordinates."""
    if is_point_manifold(manifold):
        return manifold.to_amplitude(w, theta.T)
    return angle_manifold("svalse", manifold).to_amplitude(w, theta)


def spread_of(posterior: ComponentPosterior) -> Float:
    """Return standard deviations of angles, or covariances of points, as they are reported."""
    if posterior.covariance is not None:
        return posterior.covariance
    return circular_std(posterior.resultant)


def circular_std(resultant: ArrayLike) -> Float:
    """Return the circular standard deviation √(-2 ln R), rad, of densities of resultant R.

    Examples
    --------
    >>> circular_std([1.0, 0.5]).round(4) + 0
    array([0.    , 1.1774])
    """
    return np.asarray(np.sqrt(-2 * np.log(np.maximum(resultant, 1e-300))))


def existence_of(posterior: ComponentPosterior) -> Float:
    """Return the probabilities of existence of active components, from their log odds."""
    return np.asarray(1 / (1 + np.exp(-np.maximum(posterior.evidence, -700))))


def detected(manifold: Manifold, posterior: ComponentPosterior) -> Bool:
    """Return which components are active and belong, within three std, to a real direction."""
    return posterior.active & is_direction(manifold, posterior.theta, spread_of(posterior))


def prior_spread(kappa: Float) -> Float:
    """Return standard deviations of concentrations (n,), or covariances of precisions (n, q)."""
    if kappa.ndim == 2:
        return inverse(kappa.T).T
    return circular_std(bessel_ratio(kappa))
