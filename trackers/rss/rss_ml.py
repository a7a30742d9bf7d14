"""Positions of several sources from signal strength, by the joint maximum."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.decibels import NEPER_PER_DB
from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.registry import register
from arrivals.trackers.rss.base import RSSTracker
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, marginals
from arrivals.trackers.rss.inference.map_search import Maximum, Method, maximum
from arrivals.trackers.rss.inference.solution import Solution, laplace
from arrivals.typing import Float
from arrivals.validation import one_of, positive


@register("rss_ml")
class RSSML(RSSTracker):
    """Several sources by their signal strength: the joint maximum.

    Parameters
    ----------
    motion, measurement, x0, P0, mu0, v0, q_u, n_sources, max_sources, births, confirm
        As in `RSSVB`.
    area_std, grid_step, correlation_time
        As in `RSSVB`.
    method : {"lm", "bfgs"}
        Levenberg and Marquardt's search or Broyden, Fletcher, Goldfarb and Shanno's, scipy's
        both, with analytic slopes.
    prior : bool
        Whether the predicted belief counts: the paper calls the maximum of the joint posterior
        ML. Without, it is where the search starts, and no more; a source that the readings do
        not hold may run away.
    tolerance : float
        Relative, of step and cost, at which the search ends.

    Raises
    ------
    TypeError, ValueError
        As in `RSSVB`; and at an update without prior, if readings are fewer than unknowns.

    Notes
    -----
    Belief, start, labels and covariances are those of `RSSVB`; `max_sources` and the rest too.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, "Factorized variational approximations for acoustic multi
    source localization", ICASSP 2008, (7) and section 4.

    Examples
    --------
    >>> from arrivals.motion_models import RandomWalk
    >>> rng = np.random.default_rng(0)
    >>> heard = LogNormalRSS(rng.uniform(-60, 60, (40, 2)), log_noise=4.6, position=(0, 1))
    >>> tracker = RSSML(RandomWalk(q=1.0), heard, [[-20.0, 15.0]], 100.0 * np.eye(2))
    >>> tracker.update(heard.draw([9.2], [[-25.0, 10.0]], rng))
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
        mu0: ArrayLike = 80 * NEPER_PER_DB,
        v0: ArrayLike = (3 * NEPER_PER_DB) ** 2,
        q_u: float = (0.3 * NEPER_PER_DB) ** 2,
        n_sources: int | None = None,
        max_sources: int = 8,
        births: bool = False,
        confirm: int = 3,
        area_std: float | None = None,
        grid_step: float | None = None,
        correlation_time: float | None = None,
        method: Method = "lm",
        prior: bool = True,
        tolerance: float = 1e-8,
    ) -> None:
        self.method = one_of("method", method, ("lm", "bfgs"))
        self.prior = bool(prior)
        self.tolerance = positive("tolerance", tolerance)
        super().__init__(
            motion, measurement, x0, P0, mu0=mu0, v0=v0, q_u=q_u, n_sources=n_sources,
            max_sources=max_sources, births=births, confirm=confirm, area_std=area_std,
            grid_step=grid_step, correlation_time=correlation_time,
        )  # fmt: skip

    def solve(self, problem: JointPosterior, u: Float, theta: Float) -> Solution:
        """Search the maxima one by one; then the marginals."""
        start = problem.log_posterior(u, theta)
        each = [self._maximum(problem, u, theta, b) for b in range(len(u))]
        u, theta = np.array([one.u for one in each]), np.array([one.theta for one in each])
        J, log_likelihood = laplace(problem, u, theta)
        if not self.prior:  # what the prior says is no more than what keeps J regular
            J = J - (1 - 1e-9) * problem.prior_precision()
        return Solution(
            u,
            theta,
            marginals(J),
            problem.log_posterior(u, theta),
            start if self.prior else np.full(len(u), -np.inf),
            log_likelihood,
            np.array([one.iterations for one in each]),
            np.array([one.converged for one in each]),
        )

    def _maximum(self, problem: JointPosterior, u: Float, theta: Float, b: int) -> Maximum:
        field = problem.field.take(b)
        one = JointPosterior(field, problem.xi[b], problem.W[b], problem.prior.take(b))
        return maximum(one, u[b], theta[b], self.method, self.prior, self.tolerance)
