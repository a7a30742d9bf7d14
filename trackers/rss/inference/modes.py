"""Covariances that contain the other maxima of the posterior near a solution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from arrivals.trackers.gaussian.linalg import inverse_2x2
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.inference.solution import Marginals, Solution
from arrivals.typing import Float

SAME = 1.0  # m: largest distance of each source between two solutions of one maximum

Solve = Callable[[JointPosterior, Float, Float], Solution]


def mixture_marginals(problem: JointPosterior, solution: Solution, solve: Solve) -> Marginals:
    """Return variances and covariances about a solution, over the maxima found from the prior.

    Each source in turn starts at the four sigma points of its prior, the others at their means.

    Parameters
    ----------
    problem : JointPosterior
        With one batch axis.
    solution : Solution
        The one that is reported, itself among the maxima.
    solve : callable
        The method, for a batch of problems, with the covariances of single maxima.
    """
    starts = sigma_points(problem.prior)
    B, S = starts.shape[:2]
    rows = np.repeat(np.arange(B), S)
    found = solve(
        problem.select(rows), problem.prior.mu[rows], starts.reshape(-1, *starts.shape[2:])
    )

    def joined(one: Float, others: Float) -> Float:
        return np.concatenate([one[:, None], others.reshape(B, S, *one.shape[1:])], axis=1)

    u, theta = joined(solution.u, found.u), joined(solution.theta, found.theta)
    v = joined(solution.marginals.v, found.marginals.v)
    Sigma = joined(solution.marginals.Sigma, found.marginals.Sigma)
    log_evidence = joined(solution.log_likelihood, found.log_likelihood)
    finite = np.isfinite(theta).all(axis=(-2, -1)) & np.isfinite(log_evidence)
    finite[:, 0] = True
    theta = np.where(finite[..., None, None], theta, solution.theta[:, None])
    u = np.where(finite[..., None], u, solution.u[:, None])
    log_evidence = np.where(finite, log_evidence, -np.inf)
    distance = np.linalg.norm(theta[:, :, None] - theta[:, None], axis=-1).max(axis=-1)
    copies = ((distance < SAME) & finite[:, None]).sum(axis=-1)
    # w_s = p(ξ | s) / copies of s
    w = np.exp(log_evidence - log_evidence.max(axis=1, keepdims=True)) / np.maximum(copies, 1)
    w /= w.sum(axis=1, keepdims=True)
    du, d = u - solution.u[:, None], theta - solution.theta[:, None]
    # v = Σ w (v_s + (u_s - u)²), Σ = Σ w (Σ_s + (θ_s - θ)(θ_s - θ)')
    v = np.einsum("bs,bsk->bk", w, v + du**2)
    return Marginals(v, np.einsum("bs,bskij->bkij", w, Sigma + d[..., :, None] * d[..., None, :]))


def sigma_points(prior: Prior) -> Float:
    """Return starting points, (n_batch, 4 n_sources, n_sources, 2): θ₀ ± √2 L of one source each.

    Examples
    --------
    >>> zero, precision = np.zeros((1, 1)), 2 * np.eye(2)[None, None]
    >>> sigma_points(Prior(zero, zero + 1, zero[..., None] + [0.0, 0.0], precision))[0, :, 0]
    array([[ 1.,  0.],
           [-1.,  0.],
           [ 0.,  1.],
           [ 0., -1.]])
    """
    B, K, _ = prior.theta.shape
    L = np.linalg.cholesky(inverse_2x2(prior.P))  # Σ₀ = L L'
    steps = np.sqrt(2) * np.swapaxes(L, -1, -2)[:, :, :, None] * np.array([1.0, -1.0])[:, None]
    points = np.tile(prior.theta[:, None, None], (1, K, 4, 1, 1))
    each = np.arange(K)
    points[:, each, :, each] += np.moveaxis(steps.reshape(B, K, 4, 2), 1, 0)
    return points.reshape(B, 4 * K, K, 2)
