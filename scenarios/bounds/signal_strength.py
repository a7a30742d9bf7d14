"""Cramér-Rao bounds on positions and powers from signal strength."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import LogNormalRSS
from arrivals.messages import shown
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior, marginals
from arrivals.typing import Float
from arrivals.validation import LARGEST, SMALLEST, instance, real


class Bound(NamedTuple):
    """Smallest variances of unbiased estimates.

    Parameters
    ----------
    v : ndarray, shape (..., n_sources)
        Variances of log amplitudes, Np².
    Sigma : ndarray, shape (..., n_sources, 2, 2)
        Covariances of positions, m².
    """

    v: Float
    Sigma: Float

    @property
    def position(self) -> Float:
        """Root of the mean squared distance, m, (..., n_sources)."""
        return np.asarray(np.sqrt(np.trace(self.Sigma, axis1=-2, axis2=-1)))

    @property
    def amplitude(self) -> Float:
        """Standard deviation of the log amplitude, Np, (..., n_sources)."""
        return np.asarray(np.sqrt(self.v))


def rss_bound(
    measurement: LogNormalRSS,
    u: ArrayLike,
    theta: ArrayLike,
    *,
    v0: ArrayLike | None = None,
    P0: ArrayLike | None = None,
) -> Bound:
    """Return the Cramér-Rao bound, or the Bayesian one where priors are given.

    J = Σ W g gᵀ, plus the precisions of the priors; the same for the exact Chi statistic as for
    its Gaussian approximation.

    Parameters
    ----------
    measurement : LogNormalRSS
        Sensors and propagation.
    u : array_like, shape (..., n_sources)
        Log amplitudes, Np.
    theta : array_like, shape (..., n_sources, 2)
        Positions, m.
    v0 : float or array_like, shape (n_sources,), optional
        Prior variances of the log amplitudes, Np²; no prior if None.
    P0 : array_like, shape (2, 2) or (n_sources, 2, 2), optional
        Prior covariances of the positions, m²; no prior if None.

    Returns
    -------
    Bound
        Smallest variances of log amplitudes and positions.

    Raises
    ------
    ValueError
        If the readings do not determine all unknowns.

    References
    ----------
    Van Trees, *Detection, Estimation, and Modulation Theory I*, 1968, sec. 2.4.3.

    Examples
    --------
    >>> model = LogNormalRSS([[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]])
    >>> rss_bound(model, [9.2], [[30.0, 30.0]]).position.round(2)
    array([3.])
    """
    instance("measurement", measurement, LogNormalRSS)
    u, theta = _numbers("u", u), _numbers("theta", theta)
    if u.ndim == 0 or theta.shape != (*u.shape, 2):
        shapes = f"{u.shape} and {theta.shape}"
        raise ValueError(f"u and theta must have shapes (..., K) and (..., K, 2); got {shapes}")
    K = u.shape[-1]
    w = (
        np.zeros(u.shape)
        if v0 is None
        else np.broadcast_to(1 / _numbers("v0", v0, u.shape, SMALLEST), u.shape)
    )
    P = np.zeros((2, 2)) if P0 is None else _inverse(_numbers("P0", P0, (*u.shape, 2, 2)))
    prior = Prior(u, np.broadcast_to(w, u.shape), theta, np.broadcast_to(P, (*u.shape, 2, 2)))
    W = np.broadcast_to(1 / measurement.variance, (*u.shape[:-1], measurement.dim_z))
    problem = JointPosterior(measurement.propagation, W, W, prior)
    J = problem.information(measurement.levels(u, theta))
    try:
        return Bound(*marginals(J))
    except np.linalg.LinAlgError:
        raise ValueError(
            f"sensors must determine the {3 * K} unknowns of {K} sources; got "
            f"{measurement.dim_z} readings"
        ) from None


def _numbers(
    name: str, value: ArrayLike, shape: tuple[int, ...] | None = None, least: float = -LARGEST
) -> Float:
    """Return finite numbers that may be broadcast to a shape, each at least `least`."""
    array = real(name, value)
    if not ((array >= least) & (array < LARGEST)).all():
        raise ValueError(f"{name} must be finite{', positive' * (least > 0)}; got {shown(array)}")
    fits = zip(reversed(array.shape), reversed(shape or array.shape), strict=False)
    if shape is not None and (array.ndim > len(shape) or any(n not in (1, m) for n, m in fits)):
        raise ValueError(f"{name} must have a shape that fits {shape}; got {array.shape}")
    return array


def _inverse(P0: Float) -> Float:
    try:
        return np.asarray(np.linalg.inv(P0))
    except np.linalg.LinAlgError:
        raise ValueError(f"P0 must be positive definite; got {shown(P0)}") from None
