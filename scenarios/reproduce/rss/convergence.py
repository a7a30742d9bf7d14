"""Where the iterations end: few against many cycles, jumps, local maxima, and their detection."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models import db_to_neper
from arrivals.scenarios.reproduce.rss.published_values import FEW_ITERATIONS, VB_ITERATIONS
from arrivals.scenarios.reproduce.rss.trials import SOLVERS, Draws, TrialEstimates
from arrivals.trackers.rss.inference.joint_posterior import POOR_FIT
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.rss_vb import variational_posterior
from arrivals.trackers.rss.settings import VariationalSolver
from arrivals.typing import Bool, Float

SAME_PLACE, SAME_LEVEL = 1.0, 0.5  # m and dB between ends that count as the same
JUMP = 100.0  # m in one cycle
JUMP_CYCLES = 15  # in which jumps are searched
BELOW_MAXIMUM = 3.0  # of the log posterior: a maximum lower than this is a local one


class Ends(NamedTuple):
    """Where trials end after fewer than 10 cycles, and whether that is where 30 cycles end.

    Parameters
    ----------
    few : TrialEstimates
        After 9 cycles.
    settled : ndarray of bool, shape (n_runs,)
        Whether all sources are within 1 m and 0.5 dB of their place after 30 cycles.
    converged : ndarray of bool, shape (n_runs,)
        Whether a cycle up to the 30th changes nothing by more than the tolerances.
    """

    few: TrialEstimates
    settled: Bool
    converged: Bool


def ends(trials: Draws, method: str) -> Ends:
    """Return the ends after few cycles, and whether more cycles change them.

    Parameters
    ----------
    trials : Draws
    method : str
        One of `SOLVERS`.
    """
    solver, problem = SOLVERS[method].replace(tol_u=0.0, tol_theta=1e-6), trials.problem
    start = problem.prior.mu, problem.prior.theta
    few, many = (
        variational_posterior(problem, *start, solver.replace(max_iterations=n))
        for n in (FEW_ITERATIONS, VB_ITERATIONS)
    )
    near = np.linalg.norm(few.theta - many.theta, axis=-1).max(axis=1) < SAME_PLACE
    level = np.abs(few.u - many.u).max(axis=1) < float(db_to_neper(SAME_LEVEL))
    usual = VariationalSolver()
    stopped = variational_posterior(
        problem, *start, solver.replace(tol_u=usual.tol_u, tol_theta=usual.tol_theta)
    )
    finite = np.isfinite(stopped.theta).all(axis=(1, 2))
    return Ends(TrialEstimates(few.u, few.theta, 0.0), near & level, stopped.converged & finite)


def jumped(trials: Draws, method: str) -> Bool:
    """Return in which trials a cycle moves a source by more than 100 m.

    Parameters
    ----------
    trials : Draws
    method : str
        One of `SOLVERS`.
    """
    solver = SOLVERS[method].replace(max_iterations=1)
    problem = trials.problem
    u, theta = problem.prior.mu, problem.prior.theta
    farthest = np.zeros(len(u))
    for _ in range(JUMP_CYCLES):
        with np.errstate(over="ignore", invalid="ignore"):
            after = variational_posterior(problem, u, theta, solver)
            step = np.linalg.norm(after.theta - theta, axis=-1).max(axis=1)
        farthest = np.fmax(farthest, np.where(np.isfinite(step), step, np.inf))
        u, theta = after.u, after.theta
        if solver.refresh == "literal":
            problem = problem._replace(prior=problem.prior._replace(
                mu=after.u, w=after.w, theta=after.theta, P=after.P
            ))  # fmt: skip
    return np.asarray(farthest > JUMP)


class LocalMaxima(NamedTuple):
    """Which trials end near a local maximum, and which of them the goodness of fit flags.

    Parameters
    ----------
    stuck, flagged : ndarray of bool, shape (n_runs,)
    """

    stuck: Bool
    flagged: Bool


def local_maxima(trials: Draws, ends: dict[str, TrialEstimates], n: int) -> dict[str, LocalMaxima]:
    """Return which of the first n trials end near a maximum of the joint posterior below the best.

    The best is the highest that is found from the truth and from the ends of all methods.

    Parameters
    ----------
    trials : Draws
    ends : dict of str to TrialEstimates
        By method.
    n : int

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> from arrivals.scenarios.reproduce.rss.trials import draws, estimates
    >>> trials = draws(create("rss_table1_k3"), runs=2, seed=0)
    >>> local_maxima(trials, {"vb": estimates(trials, "vb")}, 2)["vb"].stuck.shape
    (2,)
    """
    height = {name: _maxima(trials, got.u[:n], got.theta[:n]) for name, got in ends.items()}
    best = np.max([_maxima(trials, trials.u[:n], trials.theta[:n]), *height.values()], axis=0)
    return {
        name: LocalMaxima(height[name] < best - BELOW_MAXIMUM, _flagged(trials, got, n))
        for name, got in ends.items()
    }


def _flagged(trials: Draws, ends: TrialEstimates, n: int) -> Bool:
    """Return which trials the goodness of fit flags."""
    from scipy.special import chdtrc

    u, theta = ends.u[:n], ends.theta[:n]
    problem = trials.problem.select(slice(n))
    # q = Σ W (ξ - log σ_y)² ~ χ² of M - 3K degrees of freedom
    with np.errstate(over="ignore", invalid="ignore"):
        q = problem.misfit(problem.propagation.levels(u, theta))
    return np.asarray(~(chdtrc(problem.W.shape[1] - 3 * u.shape[1], q) >= POOR_FIT))


def _maxima(trials: Draws, u: Float, theta: Float) -> Float:
    """Return the log posterior at the maximum that is found from a point, (n_runs,)."""
    values = np.full(len(u), -np.inf)
    for b in range(len(u)):
        if np.isfinite(theta[b]).all():
            one = trials.problem.select(b)
            end = maximize(one, u[b], theta[b])
            values[b] = float(one.log_posterior(end.u, end.theta))
    return values
