"""The factors of the variational posterior: log amplitudes [10]-[11], positions [12]-[14]."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import Levels, Offsets
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, symmetric_2x2
from arrivals.typing import Bool, Float, Int

HALVINGS = 12  # of a Newton step that makes φ rise
LOWEST = 1e-3  # of the Gauss-Newton trace: below, the curvature is not trusted


class Factors(NamedTuple):
    """Means and precisions of all factors after one cycle.

    Parameters
    ----------
    u, w : ndarray, shape (..., n_sources)
        Means and precisions of the log amplitudes.
    theta : ndarray, shape (..., n_sources, 2)
        Modes of the positions.
    P : ndarray, shape (..., n_sources, 2, 2)
        Their precisions.
    """

    u: Float
    w: Float
    theta: Float
    P: Float


def powers_precision(problem: JointPosterior, lam: Float) -> Float:
    """Return 1/v = 1/v₀ + Σ W λ², (..., n_sources)."""
    return np.asarray(problem.prior.w + dot(problem.W[..., None, :] * lam, lam))  # (11)


def gauss_seidel(
    problem: JointPosterior,
    found: Levels,
    u: Float,
    theta: Float,
    newton_steps: int,
    tolerance: float,
) -> Factors:
    """Return the factors after one cycle in which each sees the newest of the others.

    Parameters
    ----------
    problem : Problem
        With one batch axis.
    found : Levels
        Those of the expansion point.
    u, theta : ndarray, shape (n_batch, n_sources), (n_batch, n_sources, 2)
        The expansion point.
    newton_steps : int
        At most, for each position.
    tolerance : float
        Positions have settled once Newton's step is shorter, m.

    Examples
    --------
    See `rss_cycles.solve`.
    """
    lam, r = found.shares, problem.xi - found.log_sigma
    w = powers_precision(problem, lam)
    u, theta, P = u.copy(), theta.copy(), np.empty((*theta.shape, 2))
    mu, w0 = problem.prior.mu, problem.prior.w
    Wlam = problem.W[:, None] * lam
    for j in range(u.shape[-1]):
        pull = dot(Wlam[:, j], r + lam[:, j] * u[:, j, None])
        new = (w0[:, j] * mu[:, j] + pull) / w[:, j]  # (10)
        r = r - lam[:, j] * (new - u[:, j])[:, None]
        u[:, j] = new
    c = 0.5 * problem.field.alpha * lam
    log_range = found.offsets.log_range
    for j in range(u.shape[-1]):
        one = slice(j, j + 1)
        bowl = bowl_of(problem, c[:, one], r[:, None], log_range[:, one], one)
        theta[:, one], P[:, one], rho = newton(bowl, theta[:, one], newton_steps, tolerance)
        r = rho[:, 0]
    return Factors(u, w, theta, P)


def jacobi(
    problem: JointPosterior,
    found: Levels,
    u: Float,
    theta: Float,
    newton_steps: int,
    tolerance: float,
) -> Factors:
    """Return the factors after one cycle in which each sees the others as they were.

    Parameters are those of `gauss_seidel`. Algorithm 1 as printed.
    """
    lam, r = found.shares, problem.xi - found.log_sigma
    w = powers_precision(problem, lam)
    pull = dot(problem.W[:, None] * lam, r[:, None] + lam * u[..., None])
    new = (problem.prior.w * problem.prior.mu + pull) / w  # (10)
    c = 0.5 * problem.field.alpha * lam
    bowl = bowl_of(problem, c, r[:, None], found.offsets.log_range, slice(None))
    theta, P, _ = newton(bowl, theta, newton_steps, tolerance)
    return Factors(new, w, theta, P)


class _Look(NamedTuple):
    seen: Offsets
    rho: Float
    phi: Float


class PositionCost(NamedTuple):
    """What one cycle asks of positions: φ(θ) = ½ Σ W ρ² + the prior's, ρ = base + c log R(θ).

    Parameters
    ----------
    problem : Problem
    c, half : ndarray, shape (n_batch, n, n_sensors)
        ½αλ of some sources, and half of it.
    base : ndarray, shape (n_batch, n, n_sensors)
        r - c log R̄.
    which : slice
        Those sources.
    """

    problem: JointPosterior
    c: Float
    half: Float
    base: Float
    which: slice

    def look(self, theta: Float) -> _Look:
        """Return offsets, ρ and φ at positions (n_batch, n, 2)."""
        seen = self.problem.field.offsets(theta)
        rho = np.log(seen.square)
        rho *= self.half
        rho += self.base
        step, pull = self.step(theta)
        W = self.problem.W[:, None]
        phi = 0.5 * (dot(W * rho, rho) + (step * pull).sum(axis=-1))
        return _Look(seen, rho, phi)

    def take(self, rows: Int) -> PositionCost:
        """Return some of the batch."""
        return PositionCost(
            self.problem.take(rows), self.c[rows], self.half[rows], self.base[rows], self.which
        )

    def step(self, theta: Float) -> tuple[Float, Float]:
        """Return θ - θ₀ and Σ₀⁻¹(θ - θ₀)."""
        step = theta - self.problem.prior.theta[:, self.which]
        P = self.problem.prior.P[:, self.which]
        return step, (P * step[..., None, :]).sum(axis=-1)

    def slopes(self, theta: Float, look: _Look) -> tuple[Float, Float]:
        """Return gradient (n_batch, n, 2) and a positive Hessian (n_batch, n, 2, 2) of φ.

        Where the curvature is not clearly positive, it is Gauss and Newton's.
        """
        W, P0 = self.problem.W[:, None], self.problem.prior.P[:, self.which]
        seen, rho = look.seen, look.rho
        inverse = seen.inverse
        ex, ey = seen.dx * inverse, seen.dy * inverse
        s = W * self.c
        t = s * rho
        s = s * self.c
        _, pull = self.step(theta)
        gradient = np.stack([dot(t, ex), dot(t, ey)], axis=-1) + pull
        sx, sy = s * ex, s * ey
        a, b, c = dot(sx, ex), dot(sx, ey), dot(sy, ey)
        tx, ty = t * ex, t * ey
        bend = dot(t, inverse)
        full = (
            a + bend - 2 * dot(tx, ex) + P0[..., 0, 0],
            b - 2 * dot(tx, ey) + P0[..., 0, 1],
            c + bend - 2 * dot(ty, ey) + P0[..., 1, 1],
        )
        newton = (a + P0[..., 0, 0], b + P0[..., 0, 1], c + P0[..., 1, 1])
        sound = lowest(*full) > LOWEST * (newton[0] + newton[2])
        return gradient, symmetric_2x2(
            *(np.where(sound, x, y) for x, y in zip(full, newton, strict=True))
        )


def bowl_of(
    problem: JointPosterior, c: Float, r: Float, log_range: Float, which: slice
) -> PositionCost:
    """Return the bowl of sources from the residuals r and log ranges at the expansion point."""
    return PositionCost(problem, c, 0.5 * c, r - c * log_range, which)


def newton(
    bowl: PositionCost, theta: Float, steps: int, tolerance: float
) -> tuple[Float, Float, Float]:
    """Return the modes of φ, its Hessians there, and ρ there.

    Each position stops by itself, when its step is shorter than `tolerance`, m.
    """
    look = bowl.look(theta)
    moving = np.ones(look.phi.shape, dtype=np.bool_)
    for _ in range(steps):
        gradient, H = bowl.slopes(theta, look)
        step = np.where(moving[..., None], -solve_2x2(H, gradient), 0.0)
        moving = moving & (np.hypot(step[..., 0], step[..., 1]) > tolerance)
        theta, look = _descended(bowl, theta, step, look)
        if not moving.any():
            break
    _, H = bowl.slopes(theta, look)
    return theta, H, look.rho


def _descended(bowl: PositionCost, theta: Float, step: Float, before: _Look) -> tuple[Float, _Look]:
    """Return positions after a step, halved until φ does not rise, and the look from there."""
    to = theta + step
    look = bowl.look(to)
    rows = np.flatnonzero(_rises(look.phi, before.phi, step).any(axis=-1))
    if len(rows) == 0:
        return to, look
    few, step = bowl.take(rows), step[rows]
    for halving in range(HALVINGS):
        now = few.look(theta[rows] + step)
        rises = _rises(now.phi, before.phi[rows], step)
        if not rises.any():
            break
        shorter = 0.0 if halving == HALVINGS - 1 else 0.5
        step = np.where(rises[..., None], shorter * step, step)
    to[rows] = theta[rows] + step
    return to, bowl.look(to)


def _rises(phi: Float, before: Float, step: Float) -> Bool:
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


def lowest(a: Float, b: Float, c: Float) -> Float:
    """Return the smaller eigenvalues of [[a, b], [b, c]].

    Examples
    --------
    >>> float(lowest(2.0, 1.0, 2.0))
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
