"""Batches of trials of sources at rest, and their estimates by each method."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.envelope import sample_log_envelope
from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
from arrivals.scenarios.simulations.signal_strength import FixedSources, in_disc
from arrivals.trackers.rss.inference.joint_posterior import (
    JointPosterior,
    Prior,
    VariationalPosterior,
    marginals,
)
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.inference.solution import Marginals
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior
from arrivals.trackers.rss.model_order.model_selection import (
    forward_selection,
    local_search,
    no_source,
)
from arrivals.trackers.rss.rss_vb import variational_posterior
from arrivals.trackers.rss.settings import MAPSolver, Method, VariationalSolver
from arrivals.typing import Float
from arrivals.validation import one_of


class Draws(NamedTuple):
    """Trials with their own sensors, powers and starting points: one problem with a batch axis.

    Parameters
    ----------
    problem : JointPosterior
        Its prior mean is the starting point.
    u, theta : ndarray, shape (n_runs, n_sources), (n_runs, n_sources, 2)
        True log amplitudes, Np, and positions, m.
    """

    problem: JointPosterior
    u: Float
    theta: Float

    def first(self, n: int) -> Draws:
        """Return the first trials."""
        return Draws(self.problem.select(slice(n)), self.u[:n], self.theta[:n])


class TrialEstimates(NamedTuple):
    """Estimates of a batch of trials, and their processor time.

    Parameters
    ----------
    u, theta : ndarray, shape (n_runs, n_sources), (n_runs, n_sources, 2)
        Log amplitudes, Np, and positions, m.
    seconds : float
        Processor time of a trial, s.
    posterior : VariationalPosterior or None
        Of the variational methods.
    """

    u: Float
    theta: Float
    seconds: float
    posterior: VariationalPosterior | None = None


def draws(scenario: FixedSources, runs: int, seed: int) -> Draws:
    """Draw trials of a scenario, all at once.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> draws(create("rss_table1_k3"), runs=4, seed=0).problem.xi.shape
    (4, 100)
    """
    rng = np.random.default_rng(seed)
    M, K = scenario.n_sensors, scenario.n_sources
    sensors = in_disc(rng, (runs, M), scenario.disc)
    u = scenario.mu0 + np.sqrt(scenario.v0) * rng.standard_normal((runs, K))
    theta = np.tile(scenario.positions(rng)[0], (runs, 1, 1))
    model = scenario.measurement(sensors[0])
    propagation: PropagationModel = model.propagation._replace(sensors=sensors)
    noise = sample_log_envelope(scenario.n_snapshots, (runs, M), rng)
    xi = propagation.levels(u, theta).log_sigma + noise
    prior = Prior(
        np.full((runs, K), scenario.mu0),
        np.full((runs, K), 1 / scenario.v0),
        scenario.starts(theta, rng),
        np.tile(np.eye(2) / scenario.prior_std**2, (runs, K, 1, 1)),
    )
    W = np.tile(1 / model.variance, (runs, 1))
    return Draws(JointPosterior(propagation, xi, W, prior), u, theta)


SOLVERS: dict[str, VariationalSolver] = {
    "vb_literal": VariationalSolver.as_printed(),
    "vb_jacobi": VariationalSolver(
        sweep="jacobi", damping=0.5, line_search=False, tol_u=0.0, tol_theta=1e-6
    ),
    "vb_undamped": VariationalSolver(
        sweep="jacobi", damping=1.0, line_search=False, tol_u=0.0, tol_theta=1e-6
    ),
    "vb": VariationalSolver(),
}


def estimates(trials: Draws, method: str, max_iterations: int | None = None) -> TrialEstimates:
    """Estimate amplitudes and positions of every trial by one method.

    Parameters
    ----------
    trials : Draws
    method : str
        "vb", as in `RSSVB`; "vb_literal", Algorithm 1; "vb_jacobi", with half of each step;
        "vb_undamped"; "lm", "bfgs", the joint maximum; "started", a data-driven start, then the
        maximum without the location prior of the trial.
    max_iterations : int, optional
        In place of the 30 of the variational methods.
    """
    one_of("method", method, tuple(METHODS))
    started = time.process_time()
    result = METHODS[method](trials.problem, max_iterations)
    return result._replace(seconds=(time.process_time() - started) / len(trials.u))


def _variational(name: str, problem: JointPosterior, max_iterations: int | None) -> TrialEstimates:
    solver = SOLVERS[name]
    if max_iterations is not None:
        solver = solver.replace(max_iterations=max_iterations)
    q = variational_posterior(problem, problem.prior.mu, problem.prior.theta, solver)
    return TrialEstimates(q.u, q.theta, 0.0, q)


def _maxima(name: Method, problem: JointPosterior, max_iterations: int | None) -> TrialEstimates:
    each = []
    for b in range(len(problem.xi)):
        one = problem.select(b)
        each.append(maximize(one, one.prior.mu, one.prior.theta, MAPSolver(method=name)))
    return TrialEstimates(np.array([m.u for m in each]), np.array([m.theta for m in each]), 0.0)


def _detected(problem: JointPosterior, max_iterations: int | None) -> TrialEstimates:
    each = []
    for b in range(len(problem.xi)):
        one = problem.select(b)
        mu, w, K = float(one.prior.mu[0]), float(one.prior.w[0]), len(one.prior.mu)
        new = NewSourcePrior.among(one.propagation.sensors, mu, 1 / w)
        candidates = forward_selection(no_source(one.propagation, one.xi, one.W), new, K)
        each.append(local_search(candidates[K], new, same_number=True))
    return TrialEstimates(np.array([c.u for c in each]), np.array([c.theta for c in each]), 0.0)


METHODS: dict[str, Callable[[JointPosterior, int | None], TrialEstimates]] = {
    **{name: partial(_variational, name) for name in SOLVERS},
    "lm": partial(_maxima, "lm"),
    "bfgs": partial(_maxima, "bfgs"),
    "started": _detected,
}


def bounds(trials: Draws) -> Marginals:
    """Return the Cramér-Rao bounds of every trial, at the truth."""
    levels = trials.problem.propagation.levels(trials.u, trials.theta)
    return marginals(trials.problem.information(levels, with_prior=False))
