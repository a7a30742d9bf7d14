"""Single changes of the support of a line spectrum: merges, removals, additions.

All have a leading axis of independent problems. Gains are those of the support criterion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.manifolds.manifold import AngleManifold
from arrivals.trackers.svalse.newton.batch import BatchRecord, any_set
from arrivals.trackers.svalse.newton.elbo import Components, Evaluation
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse, over_snapshots
from arrivals.trackers.svalse.newton.step import MAX_ANGLE_VARIANCE
from arrivals.typing import Bool, Float, Int

LOG_2PI = float(np.log(2 * np.pi))
SECONDARY_PEAK_POWER = 0.2  # of the strongest: smallest |u|² of a peak added along with it


class CandidateGrid:
    """Angles at which components may be added, and the response there.

    Parameters
    ----------
    response : ExpectedResponse
    points_per_sensor : int
        Angles for each sensor of a filled line of the same extent.
    merge : float
        Smallest distance of two components, rad of direction.
    """

    def __init__(self, response: ExpectedResponse, points_per_sensor: int, merge: float) -> None:
        self.manifold: AngleManifold = response.manifold
        self.response = response
        n = int(np.ceil(points_per_sensor * max(response.extent, 4)))
        self.theta = -np.pi + 2 * np.pi * np.arange(n) / n
        # uniform over all angles that differ
        self.log_range = LOG_2PI
        if self.manifold.front_back_ambiguous:  # the front half is enough
            self.theta = (self.theta + np.pi / n) / 2
            self.log_range = LOG_2PI - np.log(2)
        self.A, self.slope2, self.norm2 = response.at(self.theta)
        self.doa = self.manifold.to_doa(self.theta)
        self.phasors = np.exp(1j * self.theta)
        two_beams = 4 * np.pi / response.extent
        self.cos_apart = np.cos(two_beams) + 1e-9 if two_beams < np.pi + 1e-9 else -2.0
        self.merge, self.cos_merge = merge, np.cos(min(merge, np.pi))
        # of angles whose directions may be near: any where front and back are ambiguous
        largest = 1.01 * merge * float(self.manifold.slope(self.theta).max())
        self.cos_near = (
            -2.0 if self.manifold.front_back_ambiguous else np.cos(min(largest, np.pi)) - 1e-12
        )

    def near(self, doa: Float) -> Bool:
        """Return which angles are too near to directions (..., n): (..., n, n_angles)."""
        return np.asarray(np.cos(doa[..., None] - self.doa) > self.cos_merge)


def first_duplicate(grid: CandidateGrid, evaluation: Evaluation) -> Int:
    """Return the first component too near to an earlier one, (B,), or -1."""
    L = evaluation.used.shape[1]
    if L < 2 or grid.merge == 0:
        return np.full(len(evaluation), -1)
    theta = np.where(evaluation.used, evaluation.components.mu, np.nan)
    near = np.cos(theta[:, :, None] - theta[:, None, :]) > grid.cos_near
    if np.count_nonzero(near) == sum(evaluation.K.tolist()):  # each near to itself only
        return np.full(len(evaluation), -1)
    doa = grid.manifold.to_doa(theta)
    near = np.cos(doa[:, :, None] - doa[:, None, :]) > grid.cos_merge  # round the circle, too
    later = np.tril(near, -1).any(axis=2)
    return np.where(later.any(axis=1), later.argmax(axis=1), -1)


def removal_gains(response: ExpectedResponse, evaluation: Evaluation, kl_weight: float) -> Float:
    """Return the increase of the criterion by removal of each component, (B, L).

    Exact while the angles are held; -inf in unused slots.
    """
    used, tau = evaluation.used, evaluation.tau
    C = evaluation.nu[:, :, None] * evaluation.G.diagonal(axis1=2, axis2=3).real
    C = np.where(used[:, None], C, 1.0)
    w2 = over_snapshots(evaluation.W.real**2 + evaluation.W.imag**2)
    by_bin = evaluation.W.shape[3] * (np.log(tau)[:, :, None] - np.log(C)) - w2 / C
    gain = response.total(by_bin) - evaluation.components.log_odds + kl_weight * evaluation.D
    return np.where(used, gain, -np.inf)


def reestimation_gains(response: ExpectedResponse, evaluation: Evaluation) -> Float:
    """Return the further increase of F after each removal if ν is updated again, (B, L).

    A bin of d' degrees of freedom without the component, whose noise would be x times ν, gains
    d' (x - 1 - ln x).
    """
    M, N = evaluation.Y.shape[2:]
    diagonal = evaluation.G.diagonal(axis1=2, axis2=3).real
    G = np.where(evaluation.used[:, None], diagonal, 1.0)
    w2 = over_snapshots(evaluation.W.real**2 + evaluation.W.imag**2)
    freedom = N * (M - evaluation.K[:, None, None])
    x = (freedom + w2 / (G * evaluation.nu[:, :, None])) / (freedom + N)
    return response.total((freedom + N) * (x - 1 - np.log(np.maximum(x, 1e-3))))


class GridEvidence(NamedTuple):
    """Evidence of one more component at each angle of the grid, (B, n_angles) each.

    Attributes
    ----------
    gain : ndarray
        Increase of the ELBO without prior and KL cost.
    u2 : ndarray
        Power |u|² of the amplitude, summed over bins.
    variance : ndarray
        Variance of the angle, rad².
    """

    gain: Float
    u2: Float
    variance: Float


def grid_evidence(grid: CandidateGrid, evaluation: Evaluation) -> GridEvidence:
    """Return the evidence of one more component at each angle."""
    P = evaluation.A.conj() @ grid.A.swapaxes(1, 2)  # âᴴa
    residual = evaluation.Y - evaluation.A.swapaxes(2, 3) @ evaluation.W
    z = grid.A.conj() @ residual
    z2 = over_snapshots(z.real**2 + z.imag**2)
    GP = evaluation.G @ P
    nu, tau = evaluation.nu[:, :, None], evaluation.tau[:, :, None]
    d = grid.norm2 + nu / tau - (P.real * GP.real + P.imag * GP.imag).sum(axis=2)
    u2 = z2 / d**2
    total = grid.response.total
    gain = total(z.shape[3] * np.log(nu / (tau * d)) + z2 / (d * nu))
    curvature = total(2 * u2 * grid.slope2 / nu)
    return GridEvidence(gain, u2.sum(axis=1), 1 / np.maximum(curvature, 1 / MAX_ANGLE_VARIANCE))


@dataclass(frozen=True, eq=False)
class NewComponents:
    """The best component to add to each problem, and secondary ones.

    Attributes
    ----------
    components : Components
        New components, the best first.
    n : ndarray of int, shape (B,)
        Number of them to add; 0 where none would gain.
    """

    components: Components
    n: Int

    def appended_to(self, old: Components, K: Int) -> tuple[Components, Int]:
        """Return components with the new ones behind the K in use, and their numbers."""
        total = K + self.n
        length = max(int(total.max()), old.packed.shape[2])
        full = Components.zeros(len(K), length)
        full.packed[:, :, : old.packed.shape[2]] = old.packed
        for i in range(int(self.n.max())):
            rows = np.flatnonzero(self.n > i)
            full.packed[rows, :, K[rows] + i] = self.components.packed[rows, :, i]
        return full, total


@dataclass(eq=False)
class RemovedComponents(BatchRecord):
    """Components of the step that were removed, and angles at which none is added.

    Attributes
    ----------
    memory : Components, of length n_slots
        All components of the step, as they were when they were removed.
    can_reactivate : ndarray of bool, shape (B, n_tracked)
        Tracked components that were removed, not merged, and may return with their priors.
    excluded : ndarray of bool, shape (B, n_angles)
        Angles near to a merged component: none is added there.
    """

    memory: Components
    can_reactivate: Bool
    excluded: Bool


def add_candidates(
    grid: CandidateGrid,
    evaluation: Evaluation,
    log_odds: Float,
    removed: RemovedComponents,
    room: Int,
    kl_weight: float,
) -> NewComponents:
    """Return the components to add: new ones, or one that was removed before.

    Parameters
    ----------
    grid : CandidateGrid
    evaluation : Evaluation
    log_odds : ndarray, shape (B,)
        Prior log odds of a new component.
    removed : RemovedComponents
    room : ndarray of int, shape (B,)
        Largest number of new components in one change.
    kl_weight : float
        Share of the KL divergence that a component is charged.
    """
    evidence = grid_evidence(grid, evaluation)
    doa = grid.manifold.to_doa(evaluation.components.mu)
    near = (grid.near(doa) & evaluation.used[:, :, None]).any(axis=1)
    evidence = evidence._replace(gain=np.where(removed.excluded | near, -np.inf, evidence.gain))
    # KL divergence of a normal density from the uniform one
    kl = grid.log_range - 0.5 * (LOG_2PI + 1 + np.log(evidence.variance))
    gain = evidence.gain + log_odds[:, None] - kl_weight * kl
    rows, best = np.arange(len(evaluation)), gain.argmax(axis=1)
    components = Components.zeros(len(rows), max(int(room.max()), 1)).with_slots(np.array(-1))
    components.log_odds[...] = log_odds[:, None]
    components.kl_constant[...] = grid.log_range
    components.mu[:, 0] = grid.theta[best]
    components.variance[:, 0] = evidence.variance[rows, best]
    new = NewComponents(components, (gain[rows, best] > 0).astype(np.int64))
    if room.max() > 1:
        new = secondary_peaks(grid, new, gain, evidence, room)
    if removed.can_reactivate.any():
        reactivate(grid, new, gain[rows, best], evidence, removed, kl_weight)
    return new


def secondary_peaks(
    grid: CandidateGrid, new: NewComponents, gain: Float, evidence: GridEvidence, room: Int
) -> NewComponents:
    """Add further local maxima, two beams apart and strong, to the best."""
    n, rows = new.n, np.arange(len(new.n))
    peak = (gain >= np.roll(gain, 1, axis=1)) & (gain >= np.roll(gain, -1, axis=1))
    last = gain.argmax(axis=1)
    strong = evidence.u2 > SECONDARY_PEAK_POWER * evidence.u2[rows, last][:, None]
    open_ = peak & (gain > 0) & strong
    for i in range(1, new.components.packed.shape[2]):
        near = np.cos(grid.theta - grid.theta[last][:, None]) > grid.cos_apart
        open_ = open_ & ~near & (i < room)[:, None]
        added = open_.any(axis=1) & (n == i)
        if not any_set(added):
            break
        last = np.where(open_, gain, -np.inf).argmax(axis=1)
        new.components.mu[:, i] = grid.theta[last]
        new.components.variance[:, i] = evidence.variance[rows, last]
        n = n + added
    return NewComponents(new.components, n)


def reactivate(
    grid: CandidateGrid,
    new: NewComponents,
    gain: Float,
    evidence: GridEvidence,
    removed: RemovedComponents,
    kl_weight: float,
) -> None:
    """Replace the new component by one that was removed before if that gains more."""
    n, rows = new.n, np.arange(len(new.n))
    n_slots = removed.can_reactivate.shape[1]
    memory = removed.memory.first(n_slots)
    kappa, mu = memory.prior_kappa, memory.prior_mu
    # KL divergence of a normal density from the von Mises prior
    phasors = (kappa * np.exp(-1j * mu))[:, :, None] * grid.phasors
    entropy = 0.5 * (LOG_2PI + 1 + np.log(evidence.variance))
    kl = memory.kl_constant[:, :, None] - phasors.real - entropy[:, None]
    back = evidence.gain[:, None] + memory.log_odds[:, :, None] - kl_weight * kl
    back = np.where(removed.can_reactivate[:, :, None], back, -np.inf).reshape(len(n), -1)
    best = back.argmax(axis=1)
    better = back[rows, best] > np.maximum(gain, 0)
    if any_set(better):
        who, where = np.divmod(best[better], len(grid.theta))
        precision = 1 / evidence.variance[better, where] + kappa[better, who]
        new.components.packed[better, :, 0] = memory.packed[better, :, who]
        new.components.mu[better, 0] = grid.theta[where]
        new.components.variance[better, 0] = 1 / precision
        n[better] = 1
