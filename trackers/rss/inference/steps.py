"""Steps of the variational iterations: their fraction, line search, end and storage."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.rss.inference.joint_posterior import (
    ExpansionPoint,
    JointPosterior,
    Prior,
    VariationalPosterior,
)
from arrivals.trackers.rss.settings import VariationalSolver
from arrivals.typing import Bool, Float, Int

ROUNDING = 1e-12  # relative decrease of L that counts as none
MIN_STEP_FRACTION = 2.0**-6  # of an iteration's step; it is taken even if L decreases


def step_fraction(solver: VariationalSolver, n_sources: int) -> float:
    """Return the fraction of an iteration's step to take.

    Examples
    --------
    >>> step_fraction(VariationalSolver(sweep="jacobi"), n_sources=20)
    0.25
    """
    if solver.damping is not None:
        return solver.damping
    return 1.0 if solver.sweep == "gauss-seidel" else 0.5 if n_sources < 20 else 0.25


def damped(before: Float, after: Float, damping: float) -> Float:
    """Return the point at the fraction `damping` of a step."""
    return after if damping == 1 else before + damping * (after - before)


def take_step(
    problem: JointPosterior, point: ExpansionPoint, factors: Prior, line_search: bool
) -> ExpansionPoint:
    """Return the point at the factors' means; a step that decreases L is halved."""
    s = np.ones(len(point.u))
    du, dtheta = factors.mu - point.u, factors.theta - point.theta
    while True:
        u, theta = point.u + s[:, None] * du, point.theta + s[:, None, None] * dtheta
        trial = ExpansionPoint.at(problem, u, theta)
        L = point.log_posterior
        lower = (L - ROUNDING * np.abs(L) > trial.log_posterior) & (s > MIN_STEP_FRACTION)
        if not line_search or not lower.any():
            return trial
        s = np.where(lower, s / 2, s)


def has_converged(before: ExpansionPoint, after: ExpansionPoint, solver: VariationalSolver) -> Bool:
    """Return True where a step is shorter than the tolerances, or not finite."""
    du = np.abs(after.u - before.u).max(axis=-1, initial=0.0)
    dtheta = np.abs(after.theta - before.theta).max(axis=(-2, -1), initial=0.0)
    short = (du < solver.tol_u) & (dtheta < solver.tol_theta)
    return np.asarray(short | ~np.isfinite(du + dtheta))


def store_rows(
    q: VariationalPosterior,
    rows: Int,
    point: ExpansionPoint,
    factors: Prior,
    prior: Prior,
    iteration: int,
    converged: Bool,
) -> None:
    """Store the factors of some rows of the batch after an iteration."""
    q.u[rows], q.theta[rows], q.log_posterior[rows] = point.u, point.theta, point.log_posterior
    q.w[rows], q.P[rows] = factors.w, factors.P
    q.iterations[rows] = iteration
    q.converged[rows] = converged & np.isfinite(point.log_posterior)
    for stored, part in zip(q.prior, prior, strict=True):
        stored[rows] = part
