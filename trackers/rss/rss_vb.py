"""Positions of several sources from signal strength, by factorized variational Bayes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.linalg import inverse_2x2
from arrivals.trackers.registry import register
from arrivals.trackers.rss.base import RSSTracker
from arrivals.trackers.rss.belief import SourceBeliefs
from arrivals.trackers.rss.detection import detect_sources, keep_settling
from arrivals.trackers.rss.inference.factors import update_amplitudes, update_positions
from arrivals.trackers.rss.inference.joint_posterior import (
    ExpansionPoint,
    JointPosterior,
    Prior,
    VariationalPosterior,
    marginals,
)
from arrivals.trackers.rss.inference.modes import mixture_marginals
from arrivals.trackers.rss.inference.solution import Marginals, Solution, WeightedReadings
from arrivals.trackers.rss.inference.steps import (
    damped,
    has_converged,
    step_fraction,
    store_rows,
    take_step,
)
from arrivals.trackers.rss.sensor_subset import of_best_sensors
from arrivals.trackers.rss.settings import AmplitudePrior, BirthDeath, GridSearch, VariationalSolver
from arrivals.typing import Float
from arrivals.validation import instance


@register("rss_vb")
class RSSVB(RSSTracker):
    """Track several sources by their signal strength with factorized variational Bayes.

    Parameters
    ----------
    motion : MotionModel
        Motion of one source; its state contains the position at `measurement.position`.
    measurement : LogNormalRSS
        Model of the readings. Its parameters for the amplitudes and the number of sources are not
        used: the log amplitudes u are kept beside the state.
    x0 : array_like, shape (n_sources, n), optional
        Initial states. If None, sources are detected in the first readings.
    P0 : array_like, shape (n, n) or (n_sources, n, n), optional
        Initial covariance of a state. For sources still to be detected only its part without the
        position is used, such as that of velocities; it may be None if there is no other part.
    n_sources : int, optional
        Number of sources to detect where `x0` is None; selected by the evidence if None.
    amplitude : AmplitudePrior
        Prior and drift of the log amplitudes.
    births : BirthDeath or bool, optional
        Settings for sources that appear and disappear; True for the default settings, None or
        False for a constant number of sources.
    search : GridSearch
        Search for sources of unknown number or positions.
    solver : VariationalSolver
        Order, step and end of the iterations.
    correlation_time : float, optional
        Correlation time τ of the shadowing: readings have the weight min(1, Δt/τ); weight 1 if
        None.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong type or value. Invalid readings leave the belief unchanged.

    Warns
    -----
    UserWarning
        If there are fewer readings than unknowns, a source starts on a sensor, or the readings
        do not support the requested number of sources.

    Notes
    -----
    The belief is `x`, `P` as in `RSSTracker`. Shapes: readings (n_sensors,). Units: m, Np.
    With the prior kept fixed, the fixed points are those of the joint maximum (`RSSML`). The
    covariances are those of one maximum. A wide prior of several sources has others: with three
    sources 30 m apart and a prior of 20 m, of the positions within 10 m the 68 and 95 % ellipses
    contained 41 and 63 % (NEES 15), those of `covariance="modes"` 79 and 96 % (NEES 1.1). Sources
    that move as assumed, 90 m apart: 66 and 93 %. `existence` is 1 where the number of sources
    does not change: it is given, or taken for certain once detected.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, "Factorized variational approximations for acoustic multi
    source localization", ICASSP 2008, Algorithm 1.

    Examples
    --------
    >>> from arrivals.motion_models import RandomWalk
    >>> rng = np.random.default_rng(0)
    >>> rss = LogNormalRSS(rng.uniform(-60, 60, (40, 2)), log_noise=4.6, position=(0, 1))
    >>> truth = np.array([[-25.0, 10.0], [30.0, -5.0]])
    >>> tracker = RSSVB(RandomWalk(q=1.0), rss, truth + 5.0, 100.0 * np.eye(2))
    >>> tracker.predict()
    >>> tracker.update(rss.draw([9.2, 9.0], truth, rng))
    >>> bool(np.abs(tracker.estimate.position - truth).max() < 2)
    True
    """

    def __init__(
        self,
        motion: MotionModel,
        measurement: LogNormalRSS,
        x0: ArrayLike | None = None,
        P0: ArrayLike | None = None,
        *,
        n_sources: int | None = None,
        amplitude: AmplitudePrior = AmplitudePrior(),
        births: BirthDeath | bool | None = None,
        search: GridSearch = GridSearch(),
        solver: VariationalSolver = VariationalSolver(),
        correlation_time: float | None = None,
    ) -> None:
        self.solver = instance("solver", solver, VariationalSolver)
        super().__init__(
            motion, measurement, x0, P0, n_sources=n_sources, amplitude=amplitude, births=births,
            search=search, correlation_time=correlation_time,
        )  # fmt: skip

    def update(self, z: ArrayLike | None) -> None:
        """Update the belief by one set of readings: Algorithm 1 of the paper.

        Parameters
        ----------
        z : array_like, shape (n_sensors,), or None
            Readings, Np; NaN where a sensor is missing, None if all are.
        """
        # ξ and W = 1/r   (2), (3)
        readings = self.observe(z)
        if readings is None:
            self.record_missed()
            return
        sources = self.source_beliefs().select(None)
        if self.births or sources.u.size == 0:
            detect_sources(self, readings)
            return
        # L(u, θ)   (7)
        problem = self.joint_posterior(sources, readings)
        # q(u_j) = N(μ_j, v_j), q(θ_j) = N(θ_j, Σ_j)   (8)-(14)
        solution = self.solve(problem, problem.prior.mu, problem.prior.theta)
        updated, diagnostics = self.update_sources(sources, readings, problem, solution)
        self.store(updated.select(0), solution, diagnostics)
        keep_settling(self, readings)

    def joint_posterior(self, sources: SourceBeliefs, readings: WeightedReadings) -> JointPosterior:
        """Return the joint posterior (7), without the sensors that the solver does not use."""
        problem = super().joint_posterior(sources, readings)
        n = self.solver.sensors_used
        return problem if n is None else of_best_sensors(problem, n, self.solver.sensor_choice)

    def solve(self, problem: JointPosterior, u: Float, theta: Float) -> Solution:
        """Fit the factors of a batch of problems from starting points; return their moments.

        Parameters
        ----------
        problem : JointPosterior
            With one batch axis.
        u, theta : ndarray, shape (n_batch, n_sources), (n_batch, n_sources, 2)
            Starting points.

        Returns
        -------
        Solution
        """
        solution = self.solve_once(problem, u, theta)
        if self.solver.covariance == "modes" and u.size:
            moments = mixture_marginals(problem, solution, self.solve_once)
            solution = solution._replace(marginals=moments)
        return solution

    def solve_once(self, problem: JointPosterior, u: Float, theta: Float) -> Solution:
        """Return the solutions of `solve` with the covariances of single maxima."""
        q = variational_posterior(problem, u, theta, self.solver)
        J, log_likelihood = problem._replace(prior=q.prior).laplace(q.u, q.theta)
        if self.solver.covariance == "factor":
            moments = Marginals(1 / q.w, inverse_2x2(q.P))
        else:
            moments = marginals(J)
        return Solution(
            q.u, q.theta, moments, q.log_posterior, q.initial, log_likelihood, q.iterations,
            q.converged,
        )  # fmt: skip


def variational_posterior(
    problem: JointPosterior, u: Float, theta: Float, solver: VariationalSolver
) -> VariationalPosterior:
    """Fit the factors of the posterior: Algorithm 1 of the paper.

    The prior stays fixed, each factor uses the newest means of the others, and a step that
    decreases the joint posterior is halved, unless `solver` chooses the published form.

    Parameters
    ----------
    problem : JointPosterior
        With one batch axis; each row ends by itself.
    u, theta : ndarray, shape (n_batch, n_sources), (n_batch, n_sources, 2)
        Starting point ū, θ̄.
    solver : VariationalSolver

    Returns
    -------
    VariationalPosterior

    Examples
    --------
    >>> from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
    >>> sensors = np.array([[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]])
    >>> u, theta = np.array([[9.0]]), np.array([[[20.0, 30.0]]])
    >>> prior = Prior(u, np.full((1, 1), 8.0), theta + 5.0, np.eye(2)[None, None] / 400)
    >>> xi = PropagationModel(sensors).levels(u, theta).log_sigma
    >>> problem = JointPosterior(PropagationModel(sensors), xi, np.full((1, 4), 200.0), prior)
    >>> q = variational_posterior(problem, u, theta + 5.0, VariationalSolver())
    >>> q.theta.round(0), bool(q.converged[0])
    (array([[[20., 30.]]]), True)
    """
    sequential, literal = solver.sweep == "gauss-seidel", solver.refresh == "literal"
    line_search = solver.line_search and not literal
    damping = step_fraction(solver, u.shape[-1])
    point = ExpansionPoint.at(problem, u, theta)  # (8), (9)
    q = VariationalPosterior.before(point)
    rows = np.arange(len(u))
    for iteration in range(1, solver.max_iterations + 1):
        # q(u_j) = N(μ_j, v_j)   (10), (11)
        u, w, r = update_amplitudes(problem, point, sequential)
        # q(θ_j) = N(θ_j, Σ_j)   (12)-(14)
        theta, P = update_positions(
            problem, point, r, sequential, solver.newton_steps, 0.02 * solver.tol_theta
        )
        factors = Prior(damped(point.u, u, damping), w, damped(point.theta, theta, damping), P)
        before, point = point, take_step(problem, point, factors, line_search)
        converged = has_converged(before, point, solver)
        store_rows(q, rows, point, factors, problem.prior, iteration, converged)
        if literal:  # the posterior is the prior of the next iteration
            problem = problem._replace(prior=factors)
        if converged.all():
            break
        if converged.any():
            active = ~converged
            rows, problem, point = rows[active], problem.select(active), point.select(active)
    return q
