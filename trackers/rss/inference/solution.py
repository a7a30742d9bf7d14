"""What a method finds in readings of signal strength, and how it is passed on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.trackers.rss.inference.goodness_of_fit import Quality
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Marginals, marginals
from arrivals.trackers.rss.model_order.model_selection import Candidate
from arrivals.typing import Bool, Float, Int


class WeightedReadings(NamedTuple):
    """Readings ξ, the weights to use, and the weights 1/r, (n_batch, n_sensors)."""

    xi: Float
    W: Float
    full: Float


class Solution(NamedTuple):
    """What a method finds for a batch of problems.

    Parameters
    ----------
    u, theta : ndarray, shape (n_batch, n_sources), (n_batch, n_sources, 2)
    marginals : Marginals
    log_posterior, start : ndarray, shape (n_batch,)
        L of the solution and of the point that the search started from.
    log_likelihood : ndarray, shape (n_batch,)
        Laplace's approximation to the density of the readings.
    iterations : ndarray of int, shape (n_batch,)
    converged : ndarray of bool, shape (n_batch,)
    """

    u: Float
    theta: Float
    marginals: Marginals
    log_posterior: Float
    start: Float
    log_likelihood: Float
    iterations: Int
    converged: Bool


class Status(NamedTuple):
    """What an estimate says of its own making."""

    converged: bool = True
    iterations: int = 0
    fit: float = np.nan
    poor_fit: bool = False
    diverged: bool = False

    @classmethod
    def of(cls, found: Solution, judged: Quality, b: int) -> Status:
        """Return that of one of a batch."""
        return cls(
            bool(found.converged[b]), int(found.iterations[b]), float(judged.fit[b]),
            bool(judged.poor_fit[b]), bool(judged.diverged[b]),
        )  # fmt: skip


def laplace(problem: JointPosterior, u: Float, theta: Float) -> tuple[Float, Float]:
    """Return J at solutions, and Laplace's log density of the readings, by batch.

    A solution that is not finite is replaced by its prior's mean: it will not be used.
    """
    sound = np.asarray(np.isfinite(u).all(axis=-1) & np.isfinite(theta).all(axis=(-2, -1)))
    u = np.where(sound[:, None], u, problem.prior.mu)
    theta = np.where(sound[:, None, None], theta, problem.prior.theta)
    found = problem.field.levels(u, theta)
    J = problem.information(found)
    normal = np.log(problem.prior.w).sum(-1) + np.linalg.slogdet(problem.prior.P)[1].sum(-1)
    W = np.where(problem.W > 0, problem.W / (2 * np.pi), 1.0)
    density = np.log(W).sum(axis=-1) + normal - np.linalg.slogdet(J)[1]
    return J, problem.log_posterior(u, theta, found) + 0.5 * density


def found_of(fit: Candidate) -> Solution:
    """Return a fit as what a method found, with one batch axis."""
    K = len(fit.u)
    problem, one = fit.problem, np.ones(1)
    J = problem.information(fit.levels)
    blocks = marginals(J) if K else Marginals(np.zeros(0), np.zeros((0, 2, 2)))
    L = one * problem.log_posterior(fit.u, fit.theta, fit.levels)
    return Solution(
        fit.u[None], fit.theta[None], Marginals(blocks.v[None], blocks.Sigma[None]), L, L,
        one * fit.log_likelihood, np.zeros(1, dtype=np.int64), one.astype(np.bool_),
    )  # fmt: skip


def in_batch(problem: JointPosterior) -> JointPosterior:
    """Return a problem as a batch of one."""
    return problem._replace(xi=problem.xi[None], W=problem.W[None], prior=problem.prior.take(None))
