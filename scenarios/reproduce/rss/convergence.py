"""Where the iterations end: few against many cycles, steps, divergence and local maxima."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models import db_to_neper
from arrivals.scenarios.reproduce.rss.published_values import FEW_ITERATIONS, VB_ITERATIONS
from arrivals.scenarios.reproduce.rss.trials import SOLVERS, Draws, TrialEstimates
from arrivals.trackers.rss.inference.factors import update_amplitudes, update_positions
from arrivals.trackers.rss.inference.joint_posterior import ExpansionPoint
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.rss_vb import variational_posterior
from arrivals.trackers.rss.settings import VariationalSolver
from arrivals.typing import Bool, Float

SAME_PLACE, SAME_LEVEL = 1.0, 0.5  # m and dB between ends that count as the same
JUMP = 100.0  # m in one cycle, or one search for a mode
JUMP_CYCLES = 15  # in which jumps are searched
OUTSIDE = 30.0  # m: estimates farther outside the sensors have diverged
MODE_STEPS = 40  # of Newton, in a search for a mode
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


def longest_steps(trials: Draws, method: str) -> Float:
    """Return the longest way of a source in one cycle of each trial, m; infinite if not finite.

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
    return farthest


def diverged(theta: Float, disc: float) -> Bool:
    """Return in which trials an estimate is more than 30 m outside the sensors, or not finite.

    Parameters
    ----------
    theta : ndarray, shape (n_runs, n_sources, 2)
        Estimated positions, m.
    disc : float
        Radius of the sensors about the origin, m.

    Examples
    --------
    >>> diverged(np.array([[[0.0, 0.0]], [[140.0, 0.0]]]), 100.0)
    array([False,  True])
    """
    return np.asarray(~(np.linalg.norm(theta, axis=-1) <= disc + OUTSIDE).all(axis=1))


def unmoved(trials: Draws, theta: Float) -> Bool:
    """Return in which trials a search moves no source by more than 1 m from its start."""
    way = np.linalg.norm(theta - trials.problem.prior.theta, axis=-1)
    return np.asarray((way < SAME_PLACE).all(axis=1))


class ModeSteps(NamedTuple):
    """The longest way of a source in the first search for modes, m, (n_runs,).

    Parameters
    ----------
    with_prior, without_prior : ndarray, shape (n_runs,)
        By the prior of the positions, and by one of a thousand times its deviation.
    """

    with_prior: Float
    without_prior: Float


def mode_steps(trials: Draws) -> ModeSteps:
    """Return how far the first search for modes (12) moves the sources.

    Parameters
    ----------
    trials : Draws

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> from arrivals.scenarios.reproduce.rss.trials import draws
    >>> mode_steps(draws(create("rss_table1_k3"), runs=2, seed=0)).with_prior.shape
    (2,)
    """
    prior, found = trials.problem.prior, []
    for factor in (1.0, 1e-6):
        problem = trials.problem._replace(prior=prior._replace(P=factor * prior.P))
        point = ExpansionPoint.at(problem, prior.mu, prior.theta)
        _, _, r = update_amplitudes(problem, point, False)
        theta, _ = update_positions(problem, point, r, False, MODE_STEPS, SAME_PLACE / 100)
        found.append(np.linalg.norm(theta - prior.theta, axis=-1).max(axis=1))
    return ModeSteps(*found)


class LocalMaxima(NamedTuple):
    """Which trials end near a local maximum, and how well the estimates fit the readings.

    Parameters
    ----------
    stuck : ndarray of bool, shape (n_runs,)
    misfit : ndarray, shape (n_runs,)
        q = Σ W (ξ - log σ_y)², NaN if not finite.
    """

    stuck: Bool
    misfit: Float


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
        name: LocalMaxima(height[name] < best - BELOW_MAXIMUM, _misfit(trials, got, n))
        for name, got in ends.items()
    }


def _misfit(trials: Draws, ends: TrialEstimates, n: int) -> Float:
    problem = trials.problem.select(slice(n))
    with np.errstate(over="ignore", invalid="ignore"):
        return problem.misfit(problem.propagation.levels(ends.u[:n], ends.theta[:n]))


def _maxima(trials: Draws, u: Float, theta: Float) -> Float:
    """Return the log posterior at the maximum that is found from a point, (n_runs,)."""
    values = np.full(len(u), -np.inf)
    for b in range(len(u)):
        if np.isfinite(theta[b]).all():
            one = trials.problem.select(b)
            end = maximize(one, u[b], theta[b])
            values[b] = float(one.log_posterior(end.u, end.theta))
    return values
