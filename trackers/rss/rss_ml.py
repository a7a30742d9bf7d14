"""Positions of several sources from signal strength, by the joint maximum."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.registry import register
from arrivals.trackers.rss.base import RSSTracker
from arrivals.trackers.rss.detection import detect_sources, keep_settling
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, marginals
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.inference.solution import Solution
from arrivals.trackers.rss.settings import AmplitudePrior, BirthDeath, GridSearch, MAPSolver
from arrivals.typing import Float
from arrivals.validation import instance


@register("rss_ml")
class RSSML(RSSTracker):
    """Track several sources by their signal strength with the joint maximum.

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
    solver : MAPSolver
        Optimizer, and whether the prior is part of the cost.
    correlation_time : float, optional
        Correlation time τ of the shadowing: readings have the weight min(1, Δt/τ); weight 1 if
        None.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong type or value; at an update without the prior, if there are
        fewer readings than unknowns.

    Warns
    -----
    UserWarning
        If there are fewer readings than unknowns, a source starts on a sensor, or the readings
        do not support the requested number of sources.

    Notes
    -----
    Belief, detection, labels and covariances are those of `RSSVB` with `covariance="joint"`, and
    as far off where the posterior has several maxima.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, "Factorized variational approximations for acoustic multi
    source localization", ICASSP 2008, (7) and section 4.

    Examples
    --------
    >>> from arrivals.motion_models import RandomWalk
    >>> rng = np.random.default_rng(0)
    >>> rss = LogNormalRSS(rng.uniform(-60, 60, (40, 2)), log_noise=4.6, position=(0, 1))
    >>> tracker = RSSML(RandomWalk(q=1.0), rss, [[-20.0, 15.0]], 100.0 * np.eye(2))
    >>> tracker.update(rss.draw([9.2], [[-25.0, 10.0]], rng))
    >>> tracker.estimate.position.round(0)
    array([[-25.,  10.]])
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
        solver: MAPSolver = MAPSolver(),
        correlation_time: float | None = None,
    ) -> None:
        self.solver = instance("solver", solver, MAPSolver)
        super().__init__(
            motion, measurement, x0, P0, n_sources=n_sources, amplitude=amplitude, births=births,
            search=search, correlation_time=correlation_time,
        )  # fmt: skip

    def update(self, z: ArrayLike | None) -> None:
        """Update the belief by one set of readings: the maximum of (7).

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
        # argmax L(u, θ)   (section 4)
        solution = self.solve(problem, problem.prior.mu, problem.prior.theta)
        updated, diagnostics = self.update_sources(sources, readings, problem, solution)
        self.store(updated.select(0), solution, diagnostics)
        keep_settling(self, readings)

    def solve(self, problem: JointPosterior, u: Float, theta: Float) -> Solution:
        """Maximize a batch of problems one by one; return the maxima and their marginals.

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
        initial = problem.log_posterior(u, theta)
        maxima = [maximize(problem.select(b), u[b], theta[b], self.solver) for b in range(len(u))]
        u, theta = np.array([one.u for one in maxima]), np.array([one.theta for one in maxima])
        J, log_likelihood = problem.laplace(u, theta)
        if not self.solver.prior:  # a small part of the prior keeps J regular
            J = J - (1 - 1e-9) * problem.prior_precision()
            initial = np.full(len(u), -np.inf)
        return Solution(
            u,
            theta,
            marginals(J),
            problem.log_posterior(u, theta),
            initial,
            log_likelihood,
            np.array([one.iterations for one in maxima]),
            np.array([one.converged for one in maxima]),
        )
