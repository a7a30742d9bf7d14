"""Positions of several sources from signal strength, by factored variational Bayes."""

from __future__ import annotations

from typing import Literal

from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.decibels import NEPER_PER_DB
from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.registry import register
from arrivals.trackers.rss.base import RSSTracker
from arrivals.trackers.rss.inference.joint_posterior import (
    JointPosterior,
    Marginals,
    inverse_2x2,
    marginals,
)
from arrivals.trackers.rss.inference.solution import Solution, laplace
from arrivals.trackers.rss.inference.variational import (
    Refresh,
    Sweep,
    VariationalIterate,
    VariationalSettings,
    solve,
)
from arrivals.typing import Float
from arrivals.validation import count, not_negative, number, one_of


@register("rss_vb")
class RSSVB(RSSTracker):
    """Several sources by their signal strength: factored variational Bayes.

    Parameters
    ----------
    motion : MotionModel
        Of one source; its state holds the position where `measurement.position` says.
    measurement : LogNormalRSS
        Its entries for amplitudes and number of sources are not used: u is beside the state.
    x0 : array_like, shape (n_sources, n), optional
        States at first. If None, sources are found in the first readings.
    P0 : array_like, shape (n, n) or (n_sources, n, n)
        Their covariance. For sources still to be found only what it says of the rest of the
        state, such as velocities, is used; it may be None if there is no rest.
    mu0, v0 : float or array_like, shape (n_sources,)
        Mean, Np, and variance, Np², of the log amplitudes at first; 80 dB and (3 dB)².
    q_u : float
        Variance that a log amplitude gains per unit of time, Np².
    n_sources : int, optional
        How many are to be found where `x0` is None; the evidence decides if None.
    max_sources : int
        How many there may be where the number is not known.
    births : bool
        Sources may come and go.
    confirm : int
        Steps of clear evidence that make a new source sure, and an old one given up.
    area_std : float, optional
        New sources lie about the sensors' centre with this standard deviation in x and y, m;
        that of the sensors if None.
    grid_step : float, optional
        Of the grid on which new sources are looked for, m; a fifth of `area_std` if None.
    correlation_time : float, optional
        τ: readings repeat themselves for so long, as shadowing does. Each is weighed by
        min(1, Δt/τ).
    sweep : {"gauss-seidel", "jacobi"}
        Each factor sees the newest of the others, or all as they were, as in Algorithm 1.
    damping : float, optional
        Share of a cycle's step that is taken; if None 1, or with "jacobi" 0.5 (0.25 from 20
        sources).
    refresh : {"point", "literal"}
        "literal" is Algorithm 1: prior and expansion point are the same symbols, so that data
        count once per cycle. For comparison only.
    guard : bool
        Halve steps that lower the joint posterior; never with "literal".
    max_cycles : int
    tol_u, tol_theta : float
        Cycles end when log amplitudes, Np, and positions, m, move less.
    newton_steps : int
        At most, for a position and a cycle.
    covariance : {"joint", "factor"}
        Marginals of Laplace's joint Gaussian, or those of the factors, which are too small.

    Raises
    ------
    TypeError, ValueError
        If a part or a number is not what is wanted; readings that do not fit change nothing.

    Warns
    -----
    UserWarning
        If readings are fewer than unknowns, a source starts on a sensor, or the readings do not
        tell as many sources apart as are asked for.

    Notes
    -----
    The belief is x, P as in `RSSTracker`. With the prior kept fixed, fixed points are those of
    the joint maximum (`RSSML`). The factors' covariances are too small: of three sources 30 m apart
    that were all found within 10 m, their 95 % ellipses held 68 %, those of the joint one 84 %.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, "Factorized variational approximations for acoustic multi
    source localization", ICASSP 2008, Algorithm 1.

    Examples
    --------
    >>> import numpy as np
    >>> from arrivals.motion_models import RandomWalk
    >>> rng = np.random.default_rng(0)
    >>> heard = LogNormalRSS(rng.uniform(-60, 60, (40, 2)), log_noise=4.6, position=(0, 1))
    >>> truth = np.array([[-25.0, 10.0], [30.0, -5.0]])
    >>> tracker = RSSVB(RandomWalk(q=1.0), heard, truth + 5.0, 100.0 * np.eye(2))
    >>> tracker.predict()
    >>> tracker.update(heard.draw([9.2, 9.0], truth, rng))
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
        sweep: Sweep = "gauss-seidel",
        damping: float | None = None,
        refresh: Refresh = "point",
        guard: bool = True,
        max_cycles: int = 30,
        tol_u: float = 0.01,
        tol_theta: float = 0.5,
        newton_steps: int = 5,
        covariance: Literal["joint", "factor"] = "joint",
    ) -> None:
        self.sweep = one_of("sweep", sweep, ("gauss-seidel", "jacobi"))
        self.damping = damping
        if damping is not None and not 0 < number("damping", damping) <= 1:
            raise ValueError(f"damping must lie in (0, 1]; got {damping}")
        self.refresh = one_of("refresh", refresh, ("point", "literal"))
        self.guard = bool(guard)
        self.max_cycles = count("max_cycles", max_cycles)
        self.tol_u = not_negative("tol_u", tol_u)
        self.tol_theta = not_negative("tol_theta", tol_theta)
        self.newton_steps = count("newton_steps", newton_steps)
        self.covariance = one_of("covariance", covariance, ("joint", "factor"))
        super().__init__(
            motion, measurement, x0, P0, mu0=mu0, v0=v0, q_u=q_u, n_sources=n_sources,
            max_sources=max_sources, births=births, confirm=confirm, area_std=area_std,
            grid_step=grid_step, correlation_time=correlation_time,
        )  # fmt: skip

    def cycling(self, n_sources: int) -> VariationalSettings:
        """Return how to cycle with that many sources."""
        damping = self.damping
        if damping is None:
            damping = 1.0 if self.sweep == "gauss-seidel" else 0.5 if n_sources < 20 else 0.25
        return VariationalSettings(
            self.sweep, damping, self.refresh, self.guard, self.max_cycles, self.tol_u,
            self.tol_theta, self.newton_steps,
        )  # fmt: skip

    def solve(self, problem: JointPosterior, u: Float, theta: Float) -> Solution:
        """Cycle through the factors from a starting point; then the marginals."""
        solution = solve(problem, u, theta, self.cycling(u.shape[-1]))
        J, log_likelihood = laplace(problem._replace(prior=solution.prior),
                                    solution.u, solution.theta)  # fmt: skip
        return Solution(
            solution.u,
            solution.theta,
            marginals(J) if self.covariance == "joint" else factored(solution),
            solution.log_posterior,
            solution.start,
            log_likelihood,
            solution.cycles,
            solution.converged,
        )


def factored(solution: VariationalIterate) -> Marginals:
    """Return the factors' own variances and covariances."""
    return Marginals(1 / solution.w, inverse_2x2(solution.P))
