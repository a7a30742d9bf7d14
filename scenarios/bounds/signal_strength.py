"""Cramér-Rao bounds on positions and powers from signal strength."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import LogNormalRSS
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior, marginals
from arrivals.typing import Float
from arrivals.validation import real


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
    u, theta = real("u", u), real("theta", theta)
    K = u.shape[-1]
    w = np.zeros(u.shape) if v0 is None else np.broadcast_to(1 / np.asarray(v0), u.shape)
    P = np.zeros((2, 2)) if P0 is None else np.linalg.inv(real("P0", P0))
    prior = Prior(u, w, theta, np.broadcast_to(P, (*u.shape, 2, 2)))
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
