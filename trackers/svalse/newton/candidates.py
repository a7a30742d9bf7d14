"""Single changes of the support of a line spectrum: what to merge, to remove, to add.

All work on a leading axis of independent problems. Gains are those of the support criterion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.trackers.svalse.newton.batch import some
from arrivals.trackers.svalse.newton.elbo import (
    KL_CONSTANT,
    MU,
    N_FACTS,
    ODDS,
    PLACE,
    PRIOR_KAPPA,
    PRIOR_MU,
    Evaluation,
    S,
)
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse, over_snapshots
from arrivals.trackers.svalse.newton.step import LARGEST_VARIANCE
from arrivals.typing import Bool, Float, Int

LOG_2PI = float(np.log(2 * np.pi))
RIVAL = 0.2  # of the power of the strongest: what is born beside it in one move


class Grid:
    """Angles at which components may be born, and the response there.

    Parameters
    ----------
    response : Response
    per_sensor : int
        Angles for each sensor of a filled line of the same extent.
    merge : float
        Two components are to be no nearer than this, rad of direction.
    """

    def __init__(self, response: ExpectedResponse, per_sensor: int, merge: float) -> None:
        self.manifold: Manifold = response.manifold
        self.response = response
        n = int(np.ceil(per_sensor * max(response.extent, 4)))
        self.theta = -np.pi + 2 * np.pi * np.arange(n) / n
        # uniform over all angles that differ
        self.log_range = LOG_2PI
        if self.manifold.mirror:  # the front half is enough
            self.theta = (self.theta + np.pi / n) / 2
            self.log_range = LOG_2PI - np.log(2)
        self.A, self.slope2, self.norm2 = response.at(self.theta)
        self.doa = self.manifold.to_doa(self.theta)
        self.waves = np.exp(1j * self.theta)
        two_beams = 4 * np.pi / response.extent
        self.cos_apart = np.cos(two_beams) + 1e-9 if two_beams < np.pi + 1e-9 else -2.0
        self.merge, self.cos_merge = merge, np.cos(min(merge, np.pi))
        # of angles whose directions may be near: with a mirror, of any
        reach = 1.01 * merge * float(self.manifold.slope(self.theta).max())
        self.cos_reach = -2.0 if self.manifold.mirror else np.cos(min(reach, np.pi)) - 1e-12

    def near(self, doa: Float) -> Bool:
        """Tell which angles are too near to directions (..., n): (..., n, n_angles)."""
        return np.asarray(np.cos(doa[..., None] - self.doa) > self.cos_merge)


def nearest_later(grid: Grid, state: Evaluation) -> Int:
    """Return the first component too near to an earlier one, (B,), or -1."""
    none = np.full(len(state), -1)
    L = state.facts.shape[2]
    if L < 2 or grid.merge == 0:
        return none
    theta = np.where(state.used, state.facts[:, MU], np.nan)
    near = np.cos(theta[:, :, None] - theta[:, None, :]) > grid.cos_reach
    if np.count_nonzero(near) == sum(state.K.tolist()):  # but for itself, none
        return none
    doa = grid.manifold.to_doa(theta)
    near = np.cos(doa[:, :, None] - doa[:, None, :]) > grid.cos_merge  # round the circle, too
    later = np.tril(near, -1).any(axis=2)
    return np.where(later.any(axis=1), later.argmax(axis=1), -1)


def removal_gains(response: ExpectedResponse, state: Evaluation, kl: float) -> Float:
    """Return by how much the criterion would rise without each component, (B, L).

    Exact while the angles are held; -inf in unused places.
    """
    C = state.nu[:, :, None] * state.G.diagonal(axis1=2, axis2=3).real
    C = np.where(state.used[:, None], C, 1.0)
    w2 = over_snapshots(state.W.real**2 + state.W.imag**2)
    looks = state.W.shape[3] * (np.log(state.tau)[:, :, None] - np.log(C)) - w2 / C
    gain = response.total(looks) - state.facts[:, ODDS] + kl * state.D
    return np.where(state.used, gain, -np.inf)


def relearned(response: ExpectedResponse, state: Evaluation) -> Float:
    """Return what F would rise further after each removal if ν were learned again, (B, L).

    A bin of d' degrees of freedom without the component, whose noise would be x times ν, gains
    d' (x - 1 - ln x).
    """
    M, N = state.Y.shape[2:]
    G = np.where(state.used[:, None], state.G.diagonal(axis1=2, axis2=3).real, 1.0)
    w2 = over_snapshots(state.W.real**2 + state.W.imag**2)
    freedom = N * (M - state.K[:, None, None])
    x = (freedom + w2 / (G * state.nu[:, :, None])) / (freedom + N)
    return response.total((freedom + N) * (x - 1 - np.log(np.maximum(x, 1e-3))))


@dataclass(frozen=True, eq=False)
class NewComponents:
    """The best component to add to each problem, and its rivals.

    Attributes
    ----------
    facts : ndarray, shape (B, 7, n)
        New components, the best first.
    n : ndarray of int, shape (B,)
        How many of them to add; 0 where none would gain.
    """

    facts: Float
    n: Int


def births(
    grid: Grid,
    state: Evaluation,
    odds: Float,
    memory: Float,
    revivable: Bool,
    barred: Bool,
    room: Int,
    kl: float,
) -> NewComponents:
    """Find what to add: a fresh component, or one that was removed before.

    Parameters
    ----------
    grid : Grid
    state : State
    odds : ndarray, shape (B,)
        Prior log odds of a fresh component.
    memory : ndarray, shape (B, 7, n_known)
        All components of the step.
    revivable : ndarray of bool, shape (B, n_known)
        Which of them may come back, with the priors that they have.
    barred : ndarray of bool, shape (B, n_angles)
        Where nothing may be born.
    room : ndarray of int, shape (B,)
        How many fresh ones may be added in one move.
    kl : float
        Share of the KL divergence that a component is charged.
    """
    base, u2, variance = evidence(grid, state)
    near = grid.near(grid.manifold.to_doa(state.facts[:, MU])) & state.used[:, :, None]
    base = np.where(barred | near.any(axis=1), -np.inf, base)
    cost = 0.5 * (LOG_2PI + 1 + np.log(variance))
    fresh = base + odds[:, None] - kl * (grid.log_range - cost)
    B, rows = len(state), np.arange(len(state))
    facts = np.zeros((B, N_FACTS, max(int(room.max()), 1)))
    facts[:, PLACE], facts[:, ODDS], facts[:, KL_CONSTANT] = -1, odds[:, None], grid.log_range
    best = fresh.argmax(axis=1)
    gain = fresh[rows, best]
    facts[:, MU, 0], facts[:, S, 0] = grid.theta[best], variance[rows, best]
    n = (gain > 0).astype(np.int64)
    if room.max() > 1:
        n = rivals(grid, facts, n, fresh, u2, variance, room)
    if revivable.any():
        revive(grid, facts, n, gain, base, variance, cost, memory, revivable, kl)
    return NewComponents(facts, n)


def evidence(grid: Grid, state: Evaluation) -> tuple[Float, Float, Float]:
    """Return what a component at each angle would gain, its |u|², and its angle's variance."""
    P = state.A.conj() @ grid.A.swapaxes(1, 2)  # âᴴa
    residual = state.Y - state.A.swapaxes(2, 3) @ state.W
    z = grid.A.conj() @ residual
    z2 = over_snapshots(z.real**2 + z.imag**2)
    GP = state.G @ P
    nu, tau = state.nu[:, :, None], state.tau[:, :, None]
    d = grid.norm2 + nu / tau - (P.real * GP.real + P.imag * GP.imag).sum(axis=2)
    u2 = z2 / d**2
    total = grid.response.total
    gain = total(z.shape[3] * np.log(nu / (tau * d)) + z2 / (d * nu))
    curvature = total(2 * u2 * grid.slope2 / nu)
    return gain, u2.sum(axis=1), 1 / np.maximum(curvature, 1 / LARGEST_VARIANCE)


def rivals(
    grid: Grid, facts: Float, n: Int, fresh: Float, u2: Float, variance: Float, room: Int
) -> Int:
    """Add further local maxima, two beams apart and strong, to the best; return their numbers."""
    rows = np.arange(len(n))
    peak = (fresh >= np.roll(fresh, 1, axis=1)) & (fresh >= np.roll(fresh, -1, axis=1))
    last = fresh.argmax(axis=1)
    open_ = peak & (fresh > 0) & (u2 > RIVAL * u2[rows, last][:, None])
    for i in range(1, facts.shape[2]):
        near = np.cos(grid.theta - grid.theta[last][:, None]) > grid.cos_apart
        open_ = open_ & ~near & (i < room)[:, None]
        found = open_.any(axis=1) & (n == i)
        if not some(found):
            break
        last = np.where(open_, fresh, -np.inf).argmax(axis=1)
        facts[:, MU, i], facts[:, S, i] = grid.theta[last], variance[rows, last]
        n = n + found
    return n


def revive(
    grid: Grid,
    facts: Float,
    n: Int,
    gain: Float,
    base: Float,
    variance: Float,
    cost: Float,
    memory: Float,
    revivable: Bool,
    kl: float,
) -> None:
    """Put a component that was removed before in place of the fresh one where it gains more."""
    rows = np.arange(len(n))
    kappa, mu = memory[:, PRIOR_KAPPA], memory[:, PRIOR_MU]
    waves = (kappa * np.exp(-1j * mu))[:, :, None] * grid.waves
    charge = memory[:, KL_CONSTANT, :, None] - waves.real - cost[:, None]
    back = base[:, None] + memory[:, ODDS, :, None] - kl * charge
    back = np.where(revivable[:, :, None], back, -np.inf).reshape(len(n), -1)
    best = back.argmax(axis=1)
    better = back[rows, best] > np.maximum(gain, 0)
    if some(better):
        who, where = np.divmod(best[better], len(grid.theta))
        facts[better, :, 0] = memory[better, :, who]
        facts[better, MU, 0] = grid.theta[where]
        facts[better, S, 0] = 1 / (1 / variance[better, where] + kappa[better, who])
        n[better] = 1


def without(facts: Float, k: Int) -> Float:
    """Return the components (B, 7, L) less the k-th of each problem, the last place empty."""
    L = facts.shape[2]
    order = np.arange(L) + (np.arange(L) >= k[:, None])
    rows = np.arange(len(k))[:, None]
    return np.asarray(facts[rows, :, np.minimum(order, L - 1)].swapaxes(1, 2))


def joined(facts: Float, K: Int, new: NewComponents) -> tuple[Float, Int]:
    """Return the components (B, 7, L) with the new ones behind the K in use."""
    total = K + new.n
    full = np.zeros((*facts.shape[:2], max(int(total.max()), facts.shape[2])))
    full[:, :, : facts.shape[2]] = facts
    for i in range(int(new.n.max())):
        rows = np.flatnonzero(new.n > i)
        full[rows, :, K[rows] + i] = new.facts[rows, :, i]
    return full, total
