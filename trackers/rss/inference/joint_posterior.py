"""Joint posterior of log amplitudes and positions, given readings of signal strength."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import (
    Levels,
    Offsets,
    PropagationModel,
    slopes,
)
from arrivals.trackers.gaussian.linalg import symmetric
from arrivals.trackers.rss.inference.solution import Diagnostics, Marginals, Solution
from arrivals.typing import Bool, Float, Int

POOR_FIT = 1e-3  # goodness of fit below which a solution is flagged
DIVERGED_FIT = 1e-6  # goodness of fit below which a solution counts as diverged
MAX_PRIOR_DISTANCE = 5.0  # of a position from its prior mean, in prior standard deviations


class Prior(NamedTuple):
    """Independent Gaussian priors of the sources; leading axes are batch axes.

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

    def select(self, rows: Any) -> Prior:
        """Return the priors at some rows of the first axis."""
        return Prior(*(part[rows] for part in self))

    def square(self, u: Float, theta: Float) -> Float:
        """Return Σ (u - μ)²/v + Σ (θ - θ₀)ᵀ Σ⁻¹ (θ - θ₀), (...,)."""
        step = theta - self.theta
        square_theta = (self.P * step[..., :, None] * step[..., None, :]).sum(axis=(-3, -2, -1))
        return np.asarray((self.w * (u - self.mu) ** 2).sum(axis=-1) + square_theta)


class JointPosterior(NamedTuple):
    """Readings, their propagation model and the priors of the sources; leading axes are batch axes.

    Parameters
    ----------
    propagation : PropagationModel
        Sensors, loss exponent and noise.
    xi : ndarray, shape (..., n_sensors)
        Readings ξ, Np; any finite number where missing.
    W : ndarray, shape (..., n_sensors)
        Weights of the readings, 1/r, Np⁻²; 0 where missing.
    prior : Prior
    """

    propagation: PropagationModel
    xi: Float
    W: Float
    prior: Prior

    def select(self, rows: Any) -> JointPosterior:
        """Return the problems at some rows of the batch axis; None adds one of length one."""
        return JointPosterior(
            self.propagation.select(rows), self.xi[rows], self.W[rows], self.prior.select(rows)
        )

    def at_valid_sensors(self) -> JointPosterior:
        """Return the problem without the sensors of weight 0, without a batch axis."""
        valid = self.W > 0
        if valid.all():
            return self
        return self._replace(
            propagation=self.propagation.at_sensors(valid), xi=self.xi[valid], W=self.W[valid]
        )

    def misfit(self, levels: Levels) -> Float:
        """Return q = Σ W (ξ - log σ_y)², (...,)."""
        r = self.xi - levels.log_sigma
        return np.asarray((self.W * r * r).sum(axis=-1))

    def log_posterior(self, u: Float, theta: Float, levels: Levels | None = None) -> Float:
        """Return L, the joint log posterior without its constant, (...,).

        Parameters
        ----------
        u : ndarray, shape (..., n_sources)
            Log amplitudes, Np.
        theta : ndarray, shape (..., n_sources, 2)
            Positions, m.
        levels : Levels, optional
            Levels of `u` and `theta`; computed if None.

        Returns
        -------
        ndarray, shape (...,)

        References
        ----------
        Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (7).

        Examples
        --------
        A source at its prior mean, and a reading one standard deviation off:

        >>> one, zero = np.ones((1, 1)), np.zeros((1, 1))
        >>> prior = Prior(zero, one, np.array([[[1.0, 0.0]]]), np.eye(2)[None, None])
        >>> problem = JointPosterior(PropagationModel(np.zeros((1, 2))), one, one, prior)
        >>> problem.log_posterior(prior.mu, prior.theta)
        array([-0.5])
        """
        levels = self.propagation.levels(u, theta) if levels is None else levels
        # L = -½ Σ W (ξ - log σ_y)² - ½ Σ (u - μ)²/v - ½ Σ (θ - θ₀)' Σ⁻¹ (θ - θ₀)   (7)
        return -0.5 * (self.misfit(levels) + self.prior.square(u, theta))

    def gradient(self, u: Float, theta: Float) -> Float:
        """Return the gradient of L, (..., 3 n_sources): u₁..u_K, x₁, y₁, .. x_K, y_K."""
        levels = self.propagation.levels(u, theta)
        G = slopes(levels, self.propagation.alpha)
        of_data = ((self.W * (self.xi - levels.log_sigma))[..., None, :] @ G)[..., 0, :]
        step = (self.prior.P @ (theta - self.prior.theta)[..., None])[..., 0]
        of_prior = [self.prior.w * (u - self.prior.mu), step.reshape(*step.shape[:-2], -1)]
        return np.asarray(of_data - np.concatenate(of_prior, axis=-1))

    def information(self, levels: Levels, with_prior: bool = True) -> Float:
        """Return J = Σ W g gᵀ plus the prior precisions, (..., 3 n_sources, 3 n_sources).

        Without the prior and at the true parameters it is the Fisher information, also that of
        the exact Chi model.
        """
        G = slopes(levels, self.propagation.alpha)
        J = np.swapaxes(G, -1, -2) @ (self.W[..., None] * G)
        if with_prior:
            J = J + self.prior_precision()
        return symmetric(np.asarray(J))

    def prior_precision(self) -> Float:
        """Return the prior precisions as one matrix, (..., 3 n_sources, 3 n_sources)."""
        *lead, K = self.prior.w.shape
        J = np.zeros((*lead, 3 * K, 3 * K))
        each = np.arange(K)
        J[..., each, each] = self.prior.w
        for a in (0, 1):
            for b in (0, 1):
                J[..., K + 2 * each + a, K + 2 * each + b] = self.prior.P[..., a, b]
        return J

    def laplace(self, u: Float, theta: Float) -> tuple[Float, Float]:
        """Return J at solutions, and Laplace's approximation to log p(ξ), one a batch row.

        A solution that is not finite is replaced by its prior mean: it is not used.
        """
        finite = np.asarray(np.isfinite(u).all(axis=-1) & np.isfinite(theta).all(axis=(-2, -1)))
        u = np.where(finite[:, None], u, self.prior.mu)
        theta = np.where(finite[:, None, None], theta, self.prior.theta)
        levels = self.propagation.levels(u, theta)
        J = self.information(levels)
        normal = np.log(self.prior.w).sum(-1) + np.linalg.slogdet(self.prior.P)[1].sum(-1)
        W = np.where(self.W > 0, self.W / (2 * np.pi), 1.0)
        # log p(ξ) = L + ½ Σ log(W/2π) + ½ log|prior precision| - ½ log|J|
        density = np.log(W).sum(axis=-1) + normal - np.linalg.slogdet(J)[1]
        return J, self.log_posterior(u, theta, levels) + 0.5 * density

    def diagnose(self, solution: Solution) -> Diagnostics:
        """Return convergence, goodness of fit and flags of a batch of solutions."""
        from scipy.special import chdtrc

        theta, L, initial = solution.theta, solution.log_posterior, solution.initial
        degrees: Int = (self.W > 0).sum(axis=-1) - 3 * theta.shape[-2]
        with np.errstate(over="ignore", invalid="ignore"):
            # q = Σ W (ξ - log σ_y)² ~ χ² of M - 3K degrees of freedom
            q = self.misfit(self.propagation.levels(solution.u, theta))
            fit = np.where(degrees > 0, chdtrc(np.maximum(degrees, 1), q), np.nan)
            P = self.prior.P
            variance = np.trace(P, axis1=-2, axis2=-1) / np.linalg.det(P)  # tr Σ₀
            distance_2 = np.square(theta - self.prior.theta).sum(axis=-1)
            distant = (distance_2 > MAX_PRIOR_DISTANCE**2 * variance).any(axis=-1)
            lower = L - initial < -1e-9 * np.abs(initial)
        finite = np.isfinite(theta).all(axis=(-2, -1)) & np.isfinite(L)
        diverged = ~finite | distant | lower | (fit < DIVERGED_FIT)
        return Diagnostics(solution.converged, solution.iterations, fit, fit < POOR_FIT, diverged)


class ExpansionPoint(NamedTuple):
    """Point of the expansion (8)-(9), with one batch axis.

    Parameters
    ----------
    u, theta : ndarray, shape (n_batch, n_sources), (n_batch, n_sources, 2)
        Log amplitudes ū, Np, and positions θ̄, m.
    levels : Levels
        log σ_y and responsibilities λ there.
    log_posterior : ndarray, shape (n_batch,)
        L there.
    """

    u: Float
    theta: Float
    levels: Levels
    log_posterior: Float

    @classmethod
    def at(cls, problem: JointPosterior, u: Float, theta: Float) -> ExpansionPoint:
        """Return the expansion of a problem at log amplitudes and positions."""
        levels = problem.propagation.levels(u, theta)
        return cls(u, theta, levels, problem.log_posterior(u, theta, levels))

    def select(self, rows: Any) -> ExpansionPoint:
        """Return the point at some rows of the batch axis."""
        log_sigma, responsibilities, (dx, dy, square, floor) = self.levels
        levels = Levels(
            log_sigma[rows],
            responsibilities[rows],
            Offsets(dx[rows], dy[rows], square[rows], floor),
        )
        return ExpansionPoint(self.u[rows], self.theta[rows], levels, self.log_posterior[rows])


class VariationalPosterior(NamedTuple):
    """Factors N(u, 1/w) and N(θ, P⁻¹) at the end of the iterations; leading axis: batch.

    Parameters
    ----------
    u, w : ndarray, shape (n_batch, n_sources)
        Means, Np, and precisions, Np⁻², of the log amplitudes.
    theta : ndarray, shape (n_batch, n_sources, 2)
        Modes of the positions, m.
    P : ndarray, shape (n_batch, n_sources, 2, 2)
        Precisions of the positions, m⁻².
    log_posterior, initial : ndarray, shape (n_batch,)
        L at the end and at the starting point.
    iterations : ndarray of int, shape (n_batch,)
    converged : ndarray of bool, shape (n_batch,)
    prior : Prior
        Prior of the last iteration: the given one unless it was refreshed.
    """

    u: Float
    w: Float
    theta: Float
    P: Float
    log_posterior: Float
    initial: Float
    iterations: Int
    converged: Bool
    prior: Prior

    @classmethod
    def before(cls, point: ExpansionPoint) -> VariationalPosterior:
        """Return the factors before the first iteration, to be filled by rows."""
        u, theta, n = point.u, point.theta, len(point.u)
        w, P = np.ones_like(u), np.tile(np.eye(2), (*u.shape, 1, 1))
        prior = Prior(u.copy(), w.copy(), theta.copy(), P.copy())
        return cls(
            u.copy(), w, theta.copy(), P, np.zeros(n), point.log_posterior,
            np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_), prior,
        )  # fmt: skip


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
    C = np.linalg.inv(J * scale[..., :, None] * scale[..., None, :])  # unit diagonal: Np beside m
    C = C * scale[..., :, None] * scale[..., None, :]
    each = np.arange(n // 3)
    first = n // 3 + 2 * each
    rows = np.stack([first, first + 1], axis=-1)
    Sigma = C[..., rows[:, :, None], rows[:, None, :]]
    return Marginals(C[..., each, each], symmetric(Sigma))
