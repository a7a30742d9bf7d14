"""Variational Bayes for signal strength: the cycle repeated until nothing moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import Levels
from arrivals.trackers.rss.inference.factors import Factors, gauss_seidel, jacobi
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.typing import Bool, Float, Int

Sweep = Literal["gauss-seidel", "jacobi"]
Refresh = Literal["point", "literal"]
ROUNDING = 1e-12  # relative, of L
SHORTEST = 2.0**-6  # share of a step, below which it is taken as it is


@dataclass(frozen=True)
class VariationalSettings:
    """How to cycle; the fields are parameters of `RSSVB`, which see there."""

    sweep: Sweep = "gauss-seidel"
    damping: float = 1.0
    refresh: Refresh = "point"
    guard: bool = True
    max_cycles: int = 30
    tol_u: float = 0.01
    tol_theta: float = 0.5
    newton_steps: int = 5


class VariationalIterate(NamedTuple):
    """Where the cycles ended; all with the batch axis in front.

    Parameters
    ----------
    u : ndarray, shape (n_batch, n_sources)
    theta : ndarray, shape (n_batch, n_sources, 2)
    w : ndarray, shape (n_batch, n_sources)
        Precisions of the factors of u.
    P : ndarray, shape (n_batch, n_sources, 2, 2)
        Precisions of the factors of the positions.
    log_posterior, start : ndarray, shape (n_batch,)
        L in the end, and where it started.
    cycles : ndarray of int, shape (n_batch,)
    converged : ndarray of bool, shape (n_batch,)
    prior : Prior
        The prior that the last cycle used: the given one, unless it was refreshed.
    """

    u: Float
    theta: Float
    w: Float
    P: Float
    log_posterior: Float
    start: Float
    cycles: Int
    converged: Bool
    prior: Prior


def solve(
    problem: JointPosterior, u: Float, theta: Float, how: VariationalSettings
) -> VariationalIterate:
    """Cycle through the factors from a starting point.

    Parameters
    ----------
    problem : Problem
        With one batch axis; every entry of the batch stops by itself.
    u, theta : ndarray, shape (n_batch, n_sources), (n_batch, n_sources, 2)
        Starting point ū, θ̄.
    how : Cycling

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, Algorithm 1; with the prior kept fixed, each
    factor seeing the newest of the others, and a test of the step, unless `how` says otherwise.

    Examples
    --------
    >>> from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
    >>> field = PropagationModel(np.array([[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]]))
    >>> u, theta = np.array([[9.0]]), np.array([[[20.0, 30.0]]])
    >>> prior = Prior(u, np.full((1, 1), 8.0), theta + 5.0, np.eye(2)[None, None] / 400)
    >>> xi = field.levels(u, theta).log_sigma
    >>> problem = JointPosterior(field, xi, np.full((1, 4), 200.0), prior)
    >>> found = solve(problem, u, theta + 5.0, VariationalSettings())
    >>> found.theta.round(0), bool(found.converged[0])
    (array([[[20., 30.]]]), True)
    """
    whole = _Whole(u, theta)
    rows = np.arange(len(u))
    found = problem.field.levels(u, theta)
    L = problem.log_posterior(u, theta, found)
    start = L
    for cycle in range(1, how.max_cycles + 1):
        point = _Point(u, theta, found, L)
        factors = _cycle(problem, point, how)
        prior = problem.prior
        point = _moved(problem, point, factors, how)
        still = _still(point, u, theta, how)
        u, theta, found, L = point
        if how.refresh == "literal":
            problem = problem._replace(prior=Prior(factors.u, factors.w, factors.theta, factors.P))
        whole.keep(rows, point, factors, prior, cycle, still)
        if still.all():
            break
        if still.any():
            go = ~still
            rows, problem = rows[go], problem.take(go)
            u, theta, L = u[go], theta[go], L[go]
            found = problem.field.levels(u, theta)
    return whole.solution(start)


class _Point(NamedTuple):
    u: Float
    theta: Float
    found: Levels
    L: Float


def _cycle(problem: JointPosterior, point: _Point, how: VariationalSettings) -> Factors:
    """Return the factors after one cycle, their means a share `damping` of the way there."""
    sweep = gauss_seidel if how.sweep == "gauss-seidel" else jacobi
    u, theta, found, _ = point
    factors = sweep(problem, found, u, theta, how.newton_steps, 0.02 * how.tol_theta)
    if how.damping == 1:
        return factors
    return factors._replace(
        u=u + how.damping * (factors.u - u), theta=theta + how.damping * (factors.theta - theta)
    )


def _moved(
    problem: JointPosterior, point: _Point, factors: Factors, how: VariationalSettings
) -> _Point:
    """Return the point after the cycle's step, halved while L is lower than before."""
    s = np.ones(len(point.u))
    du, dtheta = factors.u - point.u, factors.theta - point.theta
    while True:
        u, theta = point.u + s[:, None] * du, point.theta + s[:, None, None] * dtheta
        found = problem.field.levels(u, theta)
        L = problem.log_posterior(u, theta, found)
        lower = (point.L - ROUNDING * np.abs(point.L) > L) & (s > SHORTEST)
        if not how.guard or how.refresh == "literal" or not lower.any():
            return _Point(u, theta, found, L)
        s = np.where(lower, s / 2, s)


def _still(point: _Point, u: Float, theta: Float, how: VariationalSettings) -> Bool:
    """Tell which of the batch moved less than the tolerances, or are lost."""
    du = np.abs(point.u - u).max(axis=-1, initial=0.0)
    dtheta = np.abs(point.theta - theta).max(axis=(-2, -1), initial=0.0)
    settled = (du < how.tol_u) & (dtheta < how.tol_theta)
    return np.asarray(settled | ~np.isfinite(du + dtheta))


class _Whole:
    """The state of the whole batch, entered as parts of it come to rest."""

    def __init__(self, u: Float, theta: Float) -> None:
        n, K = u.shape
        self.u, self.theta = u.copy(), theta.copy()
        self.w, self.P = np.ones((n, K)), np.tile(np.eye(2), (n, K, 1, 1))
        self.L = np.zeros(n)
        self.cycles = np.zeros(n, dtype=np.int64)
        self.converged = np.zeros(n, dtype=np.bool_)
        self.prior = Prior(u.copy(), self.w.copy(), theta.copy(), self.P.copy())

    def keep(
        self, rows: Int, point: _Point, factors: Factors, prior: Prior, cycle: int, still: Bool
    ) -> None:
        """Enter where some of the batch are after a cycle."""
        self.u[rows], self.theta[rows], self.L[rows] = point.u, point.theta, point.L
        self.w[rows], self.P[rows] = factors.w, factors.P
        self.cycles[rows], self.converged[rows] = cycle, still & np.isfinite(point.L)
        for mine, part in zip(self.prior, prior, strict=True):
            mine[rows] = part

    def solution(self, start: Float) -> VariationalIterate:
        """Return what was entered."""
        return VariationalIterate(
            self.u, self.theta, self.w, self.P, self.L, start, self.cycles, self.converged,
            self.prior,
        )  # fmt: skip
