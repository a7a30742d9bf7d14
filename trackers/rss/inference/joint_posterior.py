"""The joint posterior of log amplitudes and positions, given readings of signal strength."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import Levels, PropagationModel, slopes
from arrivals.typing import Float


class Prior(NamedTuple):
    """Independent Gaussian priors of sources; leading axes are those of a batch.

    Parameters
    ----------
    mu, w : ndarray, shape (..., n_sources)
        Means of the log amplitudes, Np, and their precisions 1/v, Np⁻².
    theta : ndarray, shape (..., n_sources, 2)
        Means of the positions, m.
    P : ndarray, shape (..., n_sources, 2, 2)
        Precisions Σ⁻¹ of the positions, m⁻².
    """

    mu: Float
    w: Float
    theta: Float
    P: Float

    def take(self, rows: Any) -> Prior:
        """Return the priors of some of a batch."""
        return Prior(*(part[rows] for part in self))

    def square(self, u: Float, theta: Float) -> Float:
        """Return Σ (u - μ)²/v + Σ (θ - θ₀)ᵀ Σ⁻¹ (θ - θ₀), (...,)."""
        step = theta - self.theta
        far = (self.P * step[..., :, None] * step[..., None, :]).sum(axis=(-3, -2, -1))
        return np.asarray((self.w * (u - self.mu) ** 2).sum(axis=-1) + far)


class JointPosterior(NamedTuple):
    """Readings of a batch, the field they are of, and the priors of the sources.

    Parameters
    ----------
    field : Field
    xi : ndarray, shape (..., n_sensors)
        Readings ξ, Np; anything finite where missing.
    W : ndarray, shape (..., n_sensors)
        Their weights 1/r, Np⁻²; 0 where missing.
    prior : Prior
    """

    field: PropagationModel
    xi: Float
    W: Float
    prior: Prior

    def take(self, rows: Any) -> JointPosterior:
        """Return some of a batch."""
        return JointPosterior(
            self.field.take(rows), self.xi[rows], self.W[rows], self.prior.take(rows)
        )

    def misfit(self, found: Levels) -> Float:
        """Return q = Σ W (ξ - log σ_y)², (...,)."""
        r = self.xi - found.log_sigma
        return np.asarray((self.W * r * r).sum(axis=-1))

    def log_posterior(self, u: Float, theta: Float, found: Levels | None = None) -> Float:
        """Return L, the joint log posterior without its constant, (...,).

        Parameters
        ----------
        u : ndarray, shape (..., n_sources)
        theta : ndarray, shape (..., n_sources, 2)
        found : Levels, optional
            Those of `u` and `theta`, if known.

        References
        ----------
        Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (7).

        Examples
        --------
        One source where its prior expects it, and a reading one standard deviation off:

        >>> one, zero = np.ones((1, 1)), np.zeros((1, 1))
        >>> prior = Prior(zero, one, np.array([[[1.0, 0.0]]]), np.eye(2)[None, None])
        >>> problem = JointPosterior(PropagationModel(np.zeros((1, 2))), one, one, prior)
        >>> problem.log_posterior(prior.mu, prior.theta)
        array([-0.5])
        """
        found = self.field.levels(u, theta) if found is None else found
        return -0.5 * (self.misfit(found) + self.prior.square(u, theta))

    def gradient(self, u: Float, theta: Float) -> Float:
        """Return the gradient of L, (..., 3 n_sources): u₁..u_K, x₁, y₁, .. x_K, y_K."""
        found = self.field.levels(u, theta)
        G = slopes(found, self.field.alpha)
        pull = ((self.W * (self.xi - found.log_sigma))[..., None, :] @ G)[..., 0, :]
        step = (self.prior.P @ (theta - self.prior.theta)[..., None])[..., 0]
        back = [self.prior.w * (u - self.prior.mu), step.reshape(*step.shape[:-2], -1)]
        return np.asarray(pull - np.concatenate(back, axis=-1))

    def information(self, found: Levels, with_prior: bool = True) -> Float:
        """Return J = Σ W g gᵀ, and the priors' precisions, (..., 3 n_sources, 3 n_sources).

        The bound's matrix: at the truth, without the prior, it is Fisher's, of the exact Chi
        model too.
        """
        G = slopes(found, self.field.alpha)
        J = np.swapaxes(G, -1, -2) @ (self.W[..., None] * G)
        if with_prior:
            J = J + self.prior_precision()
        return np.asarray(0.5 * (J + np.swapaxes(J, -1, -2)))

    def prior_precision(self) -> Float:
        """Return the priors' precisions as one matrix, (..., 3 n_sources, 3 n_sources)."""
        *lead, K = self.prior.w.shape
        J = np.zeros((*lead, 3 * K, 3 * K))
        each = np.arange(K)
        J[..., each, each] = self.prior.w
        for a in (0, 1):
            for b in (0, 1):
                J[..., K + 2 * each + a, K + 2 * each + b] = self.prior.P[..., a, b]
        return J


class Marginals(NamedTuple):
    """Variances v (..., n_sources), Np², and covariances Σ (..., n_sources, 2, 2), m²."""

    v: Float
    Sigma: Float


def marginals(J: Float) -> Marginals:
    """Return the diagonal blocks of J⁻¹.

    Parameters
    ----------
    J : ndarray, shape (..., 3 n_sources, 3 n_sources)
        Positive definite, in the order of `JointPosterior.gradient`.

    Examples
    --------
    >>> marginals(np.diag([4.0, 1.0, 2.0])).Sigma
    array([[[1. , 0. ],
            [0. , 0.5]]])
    """
    n = J.shape[-1]
    scale = 1 / np.sqrt(np.maximum(np.diagonal(J, axis1=-2, axis2=-1), np.finfo(float).tiny))
    C = np.linalg.inv(J * scale[..., :, None] * scale[..., None, :])  # of even size: Np beside m
    C = C * scale[..., :, None] * scale[..., None, :]
    each = np.arange(n // 3)
    first = n // 3 + 2 * each
    rows = np.stack([first, first + 1], axis=-1)
    Sigma = C[..., rows[:, :, None], rows[:, None, :]]
    return Marginals(C[..., each, each], 0.5 * (Sigma + np.swapaxes(Sigma, -1, -2)))


def inverse_2x2(A: Float) -> Float:
    """Return A⁻¹ of symmetric matrices (..., 2, 2).

    Examples
    --------
    >>> inverse_2x2(np.array([[2.0, 1.0], [1.0, 1.0]]))
    array([[ 1., -1.],
           [-1.,  2.]])
    """
    a, b, c = A[..., 0, 0], A[..., 0, 1], A[..., 1, 1]
    return symmetric_2x2(c, -b, a) / (a * c - b * b)[..., None, None]


def symmetric_2x2(a: Float, b: Float, c: Float) -> Float:
    """Return matrices [[a, b], [b, c]]."""
    A = np.empty((*np.shape(a), 2, 2))
    A[..., 0, 0], A[..., 0, 1], A[..., 1, 0], A[..., 1, 1] = a, b, b, c
    return A
