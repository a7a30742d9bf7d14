"""Factors of the variational posterior: log amplitudes (10)-(11), positions (12)-(14)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import Offsets
from arrivals.trackers.gaussian.linalg import symmetric_2x2
from arrivals.trackers.rss.inference.joint_posterior import ExpansionPoint, JointPosterior
from arrivals.typing import Bool, Float, Int

MAX_HALVINGS = 12  # of a Newton step that increases φ
MIN_RELATIVE_CURVATURE = 1e-3  # of the Gauss-Newton trace; below it Gauss-Newton replaces Newton


def update_amplitudes(
    problem: JointPosterior, point: ExpansionPoint, sequential: bool
) -> tuple[Float, Float, Float]:
    """Update the factors N(u, 1/w) of the log amplitudes.

    Parameters
    ----------
    problem : JointPosterior
        With one batch axis.
    point : ExpansionPoint
    sequential : bool
        Whether each factor uses the new means of the factors before it.

    Returns
    -------
    u, w : ndarray, shape (n_batch, n_sources)
        Means, Np, and precisions, Np⁻².
    r : ndarray, shape (n_batch, n_sensors)
        Residuals that the factors of the positions start from.
    """
    prior, lam = problem.prior, point.levels.responsibilities
    W_lam = problem.W[:, None] * lam
    r = problem.xi - point.levels.log_sigma
    # 1/v = 1/v₀ + Σ W λ²   (11)
    w = np.asarray(prior.w + dot(W_lam, lam))
    if not sequential:
        # μ = v (μ₀/v₀ + Σ W λ (r + λ ū))   (10)
        u = (prior.w * prior.mu + dot(W_lam, r[:, None] + lam * point.u[..., None])) / w
        return u, w, r
    u = point.u.copy()
    for j in range(u.shape[-1]):
        # μ = v (μ₀/v₀ + Σ W λ (r + λ ū))   (10)
        data = dot(W_lam[:, j], r + lam[:, j] * u[:, j, None])
        mean = (prior.w[:, j] * prior.mu[:, j] + data) / w[:, j]
        r = r - lam[:, j] * (mean - u[:, j])[:, None]
        u[:, j] = mean
    return u, w, r


def update_positions(
    problem: JointPosterior,
    point: ExpansionPoint,
    r: Float,
    sequential: bool,
    newton_steps: int,
    tolerance: float,
) -> tuple[Float, Float]:
    """Update the factors N(θ, P⁻¹) of the positions.

    Parameters
    ----------
    problem : JointPosterior
        With one batch axis.
    point : ExpansionPoint
    r : ndarray, shape (n_batch, n_sensors)
        Residuals.
    sequential : bool
        Whether each factor uses the new modes of the factors before it.
    newton_steps : int
        Largest number of Newton steps for a position.
    tolerance : float
        Length of the Newton step at convergence, m.

    Returns
    -------
    theta : ndarray, shape (n_batch, n_sources, 2)
        Modes of φ (12), m.
    P : ndarray, shape (n_batch, n_sources, 2, 2)
        Hessians of φ there (14), the precisions, m⁻².
    """
    c = 0.5 * problem.propagation.alpha * point.levels.responsibilities
    log_range = point.levels.offsets.log_range
    if not sequential:
        cost = PositionCost.at(problem, c, r[:, None], log_range, slice(None))
        theta, P, _ = minimize(cost, point.theta, newton_steps, tolerance)
        return theta, P
    theta, P = point.theta.copy(), np.empty((*point.theta.shape, 2))
    for j in range(theta.shape[1]):
        one = slice(j, j + 1)
        cost = PositionCost.at(problem, c[:, one], r[:, None], log_range[:, one], one)
        theta[:, one], P[:, one], rho = minimize(cost, theta[:, one], newton_steps, tolerance)
        r = rho[:, 0]
    return theta, P


class CostEvaluation(NamedTuple):
    """Offsets, residuals ρ and cost φ of positions."""

    offsets: Offsets
    rho: Float
    phi: Float


class PositionCost(NamedTuple):
    """Cost of positions: φ(θ) = ½ Σ W ρ² + ½ (θ - θ₀)ᵀ Σ₀⁻¹ (θ - θ₀), ρ = base + c log R(θ).

    Parameters
    ----------
    problem : JointPosterior
    c, half_c : ndarray, shape (n_batch, n, n_sensors)
        ½αλ of some sources, and half of it.
    base : ndarray, shape (n_batch, n, n_sensors)
        r - c log R̄.
    sources : slice
        Those sources.
    """

    problem: JointPosterior
    c: Float
    half_c: Float
    base: Float
    sources: slice

    @classmethod
    def at(
        cls, problem: JointPosterior, c: Float, r: Float, log_range: Float, sources: slice
    ) -> PositionCost:
        """Return the cost by residuals r and log ranges log R̄ at the expansion point."""
        return cls(problem, c, 0.5 * c, r - c * log_range, sources)

    def evaluate(self, theta: Float) -> CostEvaluation:
        """Return offsets, ρ and φ at positions (n_batch, n, 2)."""
        offsets = self.problem.propagation.offsets(theta)
        # ρ = r + ½αλ (log R - log R̄)   (12)
        rho = np.log(offsets.square)
        rho *= self.half_c
        rho += self.base
        step, of_prior = self.prior_gradient(theta)
        W = self.problem.W[:, None]
        # φ = ½ Σ W ρ² + ½ (θ - θ₀)' Σ₀⁻¹ (θ - θ₀)   (12)
        phi = 0.5 * (dot(W * rho, rho) + (step * of_prior).sum(axis=-1))
        return CostEvaluation(offsets, rho, phi)

    def select(self, rows: Int) -> PositionCost:
        """Return the cost at some rows of the batch axis."""
        return PositionCost(
            self.problem.select(rows),
            self.c[rows],
            self.half_c[rows],
            self.base[rows],
            self.sources,
        )

    def prior_gradient(self, theta: Float) -> tuple[Float, Float]:
        """Return θ - θ₀ and Σ₀⁻¹ (θ - θ₀)."""
        step = theta - self.problem.prior.theta[:, self.sources]
        P = self.problem.prior.P[:, self.sources]
        return step, (P * step[..., None, :]).sum(axis=-1)

    def derivatives(self, theta: Float, evaluation: CostEvaluation) -> tuple[Float, Float]:
        """Return gradient (n_batch, n, 2) and a positive Hessian (n_batch, n, 2, 2) of φ.

        Where the Hessian is not clearly positive, it is that of Gauss and Newton.
        """
        W, P0 = self.problem.W[:, None], self.problem.prior.P[:, self.sources]
        offsets, rho = evaluation.offsets, evaluation.rho
        inverse = offsets.inverse
        ex, ey = offsets.dx * inverse, offsets.dy * inverse
        s = W * self.c
        t = s * rho
        s = s * self.c
        _, of_prior = self.prior_gradient(theta)
        # ∇φ = ½α Σ W ρ λ d/R² + Σ₀⁻¹ (θ - θ₀)   (13)
        gradient = np.stack([dot(t, ex), dot(t, ey)], axis=-1) + of_prior
        sx, sy = s * ex, s * ey
        a, b, c = dot(sx, ex), dot(sx, ey), dot(sy, ey)
        tx, ty = t * ex, t * ey
        curvature = dot(t, inverse)
        # ∇²φ = Σ W (¼α²λ² dd'/R⁴ + ½αρλ (I/R² - 2dd'/R⁴)) + Σ₀⁻¹   (14)
        newton = (
            a + curvature - 2 * dot(tx, ex) + P0[..., 0, 0],
            b - 2 * dot(tx, ey) + P0[..., 0, 1],
            c + curvature - 2 * dot(ty, ey) + P0[..., 1, 1],
        )
        gauss_newton = (a + P0[..., 0, 0], b + P0[..., 0, 1], c + P0[..., 1, 1])
        trace = gauss_newton[0] + gauss_newton[2]
        positive = smaller_eigenvalue(*newton) > MIN_RELATIVE_CURVATURE * trace
        return gradient, symmetric_2x2(
            *(np.where(positive, x, y) for x, y in zip(newton, gauss_newton, strict=True))
        )


def minimize(
    cost: PositionCost, theta: Float, steps: int, tolerance: float
) -> tuple[Float, Float, Float]:
    """Return the minimizers of φ by Newton's method, the Hessians and ρ there.

    Each position ends by itself, when its step is shorter than `tolerance`, m.
    """
    evaluation = cost.evaluate(theta)
    active = np.ones(evaluation.phi.shape, dtype=np.bool_)
    for _ in range(steps):
        gradient, H = cost.derivatives(theta, evaluation)
        step = np.where(active[..., None], -solve_2x2(H, gradient), 0.0)
        active = active & (np.hypot(step[..., 0], step[..., 1]) > tolerance)
        theta, evaluation = backtrack(cost, theta, step, evaluation)
        if not active.any():
            break
    _, H = cost.derivatives(theta, evaluation)
    return theta, H, evaluation.rho


def backtrack(
    cost: PositionCost, theta: Float, step: Float, before: CostEvaluation
) -> tuple[Float, CostEvaluation]:
    """Return positions after a step that is halved until φ does not increase, and φ there."""
    shifted = theta + step
    after = cost.evaluate(shifted)
    rows = np.flatnonzero(_increases(after.phi, before.phi, step).any(axis=-1))
    if len(rows) == 0:
        return shifted, after
    part, step = cost.select(rows), step[rows]
    for halving in range(MAX_HALVINGS):
        phi = part.evaluate(theta[rows] + step).phi
        increases = _increases(phi, before.phi[rows], step)
        if not increases.any():
            break
        shorter = 0.0 if halving == MAX_HALVINGS - 1 else 0.5
        step = np.where(increases[..., None], shorter * step, step)
    shifted[rows] = theta[rows] + step
    return shifted, cost.evaluate(shifted)


def _increases(phi: Float, before: Float, step: Float) -> Bool:
    higher = ~(phi <= before + 1e-12 * np.abs(before))
    return np.asarray(higher & step.any(axis=-1))


def dot(a: Float, b: Float) -> Float:
    """Return Σ a b over the last axis.

    Examples
    --------
    >>> dot(np.ones((2, 3)), np.arange(3.0))
    array([3., 3.])
    """
    return np.asarray(np.einsum("...i,...i->...", a, b))


def smaller_eigenvalue(a: Float, b: Float, c: Float) -> Float:
    """Return the smaller eigenvalues of [[a, b], [b, c]].

    Examples
    --------
    >>> float(smaller_eigenvalue(2.0, 1.0, 2.0))
    1.0
    """
    return np.asarray(0.5 * (a + c) - np.hypot(0.5 * (a - c), b))


def solve_2x2(H: Float, g: Float) -> Float:
    """Return H⁻¹ g of symmetric matrices (..., 2, 2) and vectors (..., 2).

    Examples
    --------
    >>> solve_2x2(np.diag([2.0, 4.0]), np.ones(2))
    array([0.5 , 0.25])
    """
    a, b, c = H[..., 0, 0], H[..., 0, 1], H[..., 1, 1]
    x, y = g[..., 0], g[..., 1]
    return np.stack([c * x - b * y, a * y - b * x], axis=-1) / (a * c - b * b)[..., None]
