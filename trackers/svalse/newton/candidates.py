"""Single changes of the support of a line spectrum: merges, removals, additions.

All have a leading axis of independent problems. Gains are those of the support criterion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from arrivals.symmetric import clamped_inverse, log_det, trace_of_product
from arrivals.trackers.svalse.newton.batch import BatchRecord, Components, any_set
from arrivals.trackers.svalse.newton.candidate_grid import CandidateGrid
from arrivals.trackers.svalse.newton.charts.angle_chart import LOG_2PI
from arrivals.trackers.svalse.newton.elbo import Evaluation
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse, over_snapshots
from arrivals.typing import Bool, Complex, Float, Int

SECONDARY_PEAK_POWER = 0.2  # of the strongest: smallest |u|² of a peak added along with it


def removal_gains(response: ExpectedResponse, evaluation: Evaluation, kl_weight: float) -> Float:
    """Return the increase of the criterion by removal of each component, (B, L).

    Exact while the points are held; -inf in unused slots.
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
    """Evidence of one more component at each point of the grid, (B, n_points) each.

    Attributes
    ----------
    gain : ndarray
        Increase of the ELBO without prior and KL cost.
    u2 : ndarray
        Power |u|² of the amplitude, summed over bins.
    P : ndarray, shape (B, F, L, n_points)
        Products âᴴa of the components and the points.
    curvature, covariance : ndarray, shape (B, d(d+1)/2, n_points)
        Information of the data on a component there, and the covariance of a new one.
    """

    gain: Float
    u2: Float
    P: Complex
    curvature: Float
    covariance: Float


def grid_evidence(grid: CandidateGrid, evaluation: Evaluation) -> GridEvidence:
    """Return the evidence of one more component at each point."""
    P = evaluation.A.conj() @ grid.A.swapaxes(1, 2)  # âᴴa
    residual = evaluation.Y - evaluation.A.swapaxes(2, 3) @ evaluation.W
    z = grid.A @ residual.conj()  # of its conjugate, only |z|² counts
    z2 = over_snapshots(z.real**2 + z.imag**2)
    GP = evaluation.G @ P
    nu, tau = evaluation.nu[:, :, None], evaluation.tau[:, :, None]
    d = grid.norm2 + nu / tau - (P.real * GP.real + P.imag * GP.imag).sum(axis=2)
    u2 = z2 / d**2
    total = grid.response.total
    gain = total(z.shape[3] * np.log(nu / (tau * d)) + z2 / (d * nu))
    curvature = total(2 * u2[:, :, None] * grid.gram / nu[:, :, None])
    smallest = 1 / grid.response.chart.max_variance
    covariance = clamped_inverse(curvature + grid.birth_precision[:, None], smallest)
    return GridEvidence(gain, u2.sum(axis=1), P, curvature, covariance)


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
        full = Components.zeros(len(K), length, old.layout)
        full.packed[:, :, : old.packed.shape[2]] = old.packed
        for i in range(int(self.n.max())):
            rows = np.flatnonzero(self.n > i)
            full.packed[rows, :, K[rows] + i] = self.components.packed[rows, :, i]
        return full, total


@dataclass(eq=False)
class RemovedComponents(BatchRecord):
    """Components of the step that were removed, and points at which none is added.

    Attributes
    ----------
    memory : Components, of length n_slots
        All components of the step, as they were when they were removed.
    can_reactivate : ndarray of bool, shape (B, n_tracked)
        Tracked components that were removed, not merged, and may return with their priors.
    excluded : ndarray of bool, shape (B, n_points)
        Points near to a merged component: none is added there.
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
    near = grid.near(evaluation, evidence.P)
    evidence = evidence._replace(gain=np.where(removed.excluded | near, -np.inf, evidence.gain))
    # KL divergence of a normal density from the prior of a new component
    d, S = grid.response.n_unknowns, evidence.covariance
    kl = grid.log_range - 0.5 * (d * LOG_2PI + d + log_det(S))
    if grid.birth_mean is not None:
        trace = trace_of_product(grid.birth_precision[:, None], S)
        kl = kl + grid.birth_quadratic + 0.5 * trace
    gain = evidence.gain + log_odds[:, None] - kl_weight * kl
    rows, best, layout = np.arange(len(gain)), gain.argmax(axis=1), evaluation.components.layout
    may_return = bool(removed.can_reactivate.any())
    if not (may_return or any_set(gain[rows, best] > 0)):
        return NewComponents(Components.zeros(len(gain), 1, layout), np.zeros_like(best))
    components = Components.zeros(len(rows), max(int(room.max()), 1), layout)
    components = components.with_slots(np.array(-1))
    components.log_odds[...] = log_odds[:, None]
    components.kl_constant[...] = grid.log_range
    components.prior_precision[...] = grid.birth_precision[:, None]
    set_points(grid, components, 0, best, S)
    new = NewComponents(components, (gain[rows, best] > 0).astype(np.int64))
    if room.max() > 1:
        new = secondary_peaks(grid, new, gain, evidence, room)
    if may_return:
        reactivate(grid, new, gain[rows, best], evidence, removed, kl_weight)
    return new


def secondary_peaks(
    grid: CandidateGrid, new: NewComponents, gain: Float, evidence: GridEvidence, room: Int
) -> NewComponents:
    """Add further local maxima, two beams apart and strong, to the best."""
    n, rows = new.n, np.arange(len(new.n))
    last = gain.argmax(axis=1)
    strong = evidence.u2 > SECONDARY_PEAK_POWER * evidence.u2[rows, last][:, None]
    open_ = grid.local_maxima(gain) & (gain > 0) & strong
    for i in range(1, new.components.packed.shape[2]):
        open_ = open_ & ~grid.near_peak(last) & (i < room)[:, None]
        added = open_.any(axis=1) & (n == i)
        if not any_set(added):
            break
        last = np.where(open_, gain, -np.inf).argmax(axis=1)
        set_points(grid, new.components, i, last, evidence.covariance)
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
    kl, precision = grid.return_costs(memory, evidence.curvature, evidence.covariance)
    back = evidence.gain[:, None] + memory.log_odds[:, :, None] - kl_weight * kl
    back = np.where(removed.can_reactivate[:, :, None], back, -np.inf).reshape(len(n), -1)
    best = back.argmax(axis=1)
    better = back[rows, best] > np.maximum(gain, 0)
    if any_set(better):
        who, where = np.divmod(best[better], grid.n_points)
        information = precision[better, :, who, where].T  # (q, number of rows)
        smallest = 1 / grid.response.chart.max_variance
        new.components.packed[better, :, 0] = memory.packed[better, :, who]
        new.components.point[better, :, 0] = grid.points[:, where].T
        new.components.covariance[better, :, 0] = clamped_inverse(information, smallest).T
        n[better] = 1


def set_points(
    grid: CandidateGrid, components: Components, i: int, best: Int, covariance: Float
) -> None:
    """Put the i-th new component of each problem at a point of the grid, (B,)."""
    components.point[:, :, i] = grid.points[:, best].T
    components.covariance[:, :, i] = covariance[np.arange(len(best)), :, best]
    if grid.birth_mean is not None:
        components.prior_mean[:, :, i] = grid.birth_mean
