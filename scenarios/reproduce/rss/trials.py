"""Many trials of sources at rest, and what each method makes of them."""

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
    Marginals,
    Prior,
    marginals,
)
from arrivals.trackers.rss.inference.map_search import Method, maximum
from arrivals.trackers.rss.inference.variational import (
    VariationalIterate,
    VariationalSettings,
    solve,
)
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior
from arrivals.trackers.rss.model_order.model_selection import grown, refined
from arrivals.typing import Float
from arrivals.validation import one_of


class Draws(NamedTuple):
    """Trials with sensors, powers and starts of their own: one problem with a batch axis.

    Parameters
    ----------
    problem : Problem
        Its prior's mean is where searches start.
    u, theta : ndarray, shape (n_runs, n_sources), (n_runs, n_sources, 2)
        The truth.
    """

    problem: JointPosterior
    u: Float
    theta: Float


class Answers(NamedTuple):
    """What a method found, and the processor time it took, s a trial.

    Parameters
    ----------
    u, theta : ndarray, shape (n_runs, n_sources), (n_runs, n_sources, 2)
    seconds : float
    solution : Solution or None
        More of it, from the variational methods.
    """

    u: Float
    theta: Float
    seconds: float
    solution: VariationalIterate | None = None


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
    field: PropagationModel = model.field._replace(sensors=sensors)
    noise = sample_log_envelope(scenario.n_snapshots, (runs, M), rng)
    xi = field.levels(u, theta).log_sigma + noise
    prior = Prior(
        np.full((runs, K), scenario.mu0),
        np.full((runs, K), 1 / scenario.v0),
        scenario.starts(theta, rng),
        np.tile(np.eye(2) / scenario.prior_std**2, (runs, K, 1, 1)),
    )
    return Draws(JointPosterior(field, xi, np.tile(1 / model.variance, (runs, 1)), prior), u, theta)


def one_of_batch(problem: JointPosterior, b: int) -> JointPosterior:
    """Return one of a batch of problems, without a batch axis."""
    return JointPosterior(problem.field.take(b), problem.xi[b], problem.W[b], problem.prior.take(b))


CYCLING: dict[str, VariationalSettings] = {
    "vb_literal": VariationalSettings(sweep="jacobi", refresh="literal", tol_u=0.0, tol_theta=1e-6),
    "vb_jacobi": VariationalSettings(
        sweep="jacobi", damping=0.5, guard=False, tol_u=0.0, tol_theta=1e-6
    ),
    "vb_undamped": VariationalSettings(sweep="jacobi", guard=False, tol_u=0.0, tol_theta=1e-6),
    "vb": VariationalSettings(),
}


def answers(trials: Draws, method: str, cycles: int | None = None) -> Answers:
    """Return what a method finds in every trial.

    Parameters
    ----------
    trials : Draws
    method : str
        "vb", as `RSSVB` has it; "vb_literal", Algorithm 1; "vb_jacobi", damped by a half;
        "vb_undamped"; "lm", "bfgs", the joint maximum; "started", data-driven start, then the
        maximum without the trial's location prior.
    cycles : int, optional
        In place of the variational methods' 30.
    """
    one_of("method", method, tuple(METHODS))
    started = time.process_time()
    found = METHODS[method](trials.problem, cycles)
    return found._replace(seconds=(time.process_time() - started) / len(trials.u))


def _cycled(name: str, problem: JointPosterior, cycles: int | None) -> Answers:
    how = CYCLING[name]
    if cycles is not None:
        how = VariationalSettings(**vars(how) | {"max_cycles": cycles})
    found = solve(problem, problem.prior.mu, problem.prior.theta, how)
    return Answers(found.u, found.theta, 0.0, found)


def _searched(name: Method, problem: JointPosterior, cycles: int | None) -> Answers:
    each = []
    for b in range(len(problem.xi)):
        one = one_of_batch(problem, b)
        each.append(maximum(one, one.prior.mu, one.prior.theta, name))
    return Answers(np.array([m.u for m in each]), np.array([m.theta for m in each]), 0.0)


def _started(problem: JointPosterior, cycles: int | None) -> Answers:
    each = []
    for b in range(len(problem.xi)):
        one = one_of_batch(problem, b)
        mu, w = float(one.prior.mu[0]), float(one.prior.w[0])
        new = NewSourcePrior.among(one.field.sensors, mu, 1 / w)
        K = len(one.prior.mu)
        each.append(refined(grown(one.field, one.xi, one.W, new, K)[K], new))
    return Answers(np.array([fit.u for fit in each]), np.array([fit.theta for fit in each]), 0.0)


METHODS: dict[str, Callable[[JointPosterior, int | None], Answers]] = {
    **{name: partial(_cycled, name) for name in CYCLING},
    "lm": partial(_searched, "lm"),
    "bfgs": partial(_searched, "bfgs"),
    "started": _started,
}


def bounds(trials: Draws) -> Marginals:
    """Return the Cramér-Rao bounds of every trial, at the truth."""
    found = trials.problem.field.levels(trials.u, trials.theta)
    return marginals(trials.problem.information(found, with_prior=False))
