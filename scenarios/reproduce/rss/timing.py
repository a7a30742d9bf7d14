"""Processor time of one iteration: a VB cycle, and the searches for the joint maximum."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from arrivals.scenarios.reproduce.rss.trials import SOLVERS, Draws, draws
from arrivals.scenarios.simulations.signal_strength import Table1K7
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.rss_vb import variational_posterior
from arrivals.trackers.rss.settings import MAPSolver
from arrivals.typing import Float

NUMBERS = (1, 5, 50)  # of sources
N_SENSORS = 400
CYCLES = 4
CYCLE, SEARCH, DIFFERENCES = "VB cycle", "ML iteration", "ML iteration, gradient by differences"
Times = dict[tuple[str, int], Float]  # by method and number of sources, one for each repeat, ms


def iteration_times(repeats: int, numbers: tuple[int, ...] = NUMBERS) -> Times:
    """Return the processor times of one iteration of each method, ms.

    Parameters
    ----------
    repeats : int
    numbers : tuple of int
        Numbers of sources.

    Returns
    -------
    dict
        By `SEARCH` (Levenberg-Marquardt), `DIFFERENCES` (BFGS without analytic gradient), and
        `CYCLE` followed by the name of a method in `SOLVERS`; and number of sources.

    Examples
    --------
    >>> sorted(iteration_times(1, numbers=(1,)))[-1]
    ('VB cycle vb_literal', 1)
    """
    times: Times = {}
    for K in numbers:
        work = _work(draws(replace(Table1K7(), n_sources=K, n_sensors=N_SENSORS), 1, 0))
        for name in work:
            times[name, K] = np.zeros(repeats)
        for repeat in range(repeats):
            for name, (function, n) in work.items():
                times[name, K][repeat] = _ms(function) / n
    return times


def _work(trial: Draws) -> dict[str, tuple[Callable[[], object], int]]:
    """Return functions and their numbers of iterations."""
    problem, one = trial.problem, trial.problem.select(0)
    start = problem.prior.mu, problem.prior.theta
    search = MAPSolver(tolerance=1e-3)
    n = maximize(one, one.prior.mu, one.prior.theta, search).iterations
    work: dict[str, tuple[Callable[[], object], int]] = {
        SEARCH: (lambda: maximize(one, one.prior.mu, one.prior.theta, search), n),
        DIFFERENCES: (lambda: search_by_differences(one, CYCLES), CYCLES),
    }
    for name in ("vb", "vb_literal"):
        solver = SOLVERS[name].replace(max_iterations=CYCLES, tol_u=0.0, tol_theta=1e-6)
        work[f"{CYCLE} {name}"] = (
            lambda solver=solver: variational_posterior(problem, *start, solver),  # type: ignore[misc]
            CYCLES,
        )
    return work


def search_by_differences(problem: JointPosterior, iterations: int) -> bool:
    """Return whether iterations of BFGS with gradients by differences raise the posterior.

    Parameters
    ----------
    problem : JointPosterior
        Its prior mean is the start.
    iterations : int
    """
    from scipy.optimize import minimize

    K = len(problem.prior.mu)
    scale = np.concatenate([np.ones(K), np.full(2 * K, 10.0)])

    def cost(x: Float) -> float:
        u, theta = scale[:K] * x[:K], (scale[K:] * x[K:]).reshape(K, 2)
        return -float(problem.log_posterior(u, theta))

    x = np.concatenate([problem.prior.mu, problem.prior.theta.ravel()]) / scale
    return bool(minimize(cost, x, method="BFGS", options={"maxiter": iterations}).fun < cost(x))


def _ms(function: Callable[[], object]) -> float:
    started = time.process_time()
    function()
    return 1e3 * (time.process_time() - started)
