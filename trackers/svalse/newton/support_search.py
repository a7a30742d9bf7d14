"""Changes of the support between Newton steps: accept or reject, merge, remove, add, finish."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.parameters import FrozenModel
from arrivals.trackers.svalse.newton.batch import Components, any_set, enlarged
from arrivals.trackers.svalse.newton.candidate_grid import CandidateGrid
from arrivals.trackers.svalse.newton.candidates import (
    add_candidates,
    reestimation_gains,
    removal_gains,
)
from arrivals.trackers.svalse.newton.elbo import evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.problems import log_odds
from arrivals.trackers.svalse.newton.state import SolverState
from arrivals.trackers.svalse.newton.wave_switch import switch_waves
from arrivals.typing import Bool, Float, Int
from arrivals.validation import count, not_negative

MARGIN = 1e-3  # nats by which an addition must exceed the record


@dataclass(frozen=True)
class IterationLimits(FrozenModel):
    """Numbers of Newton steps after a change of the support, and of such changes.

    Parameters
    ----------
    inner, removal, fill, final : int
        Newton steps after an addition, after a removal, after an addition of the fill stage, and
        at the end.
    inner_tolerance : float
        Change of the ELBO, nats, at which those before the end stop.
    large_gain : float
        Gain of a Newton step, nats, after which another follows in any case.
    max_changes : int
        Largest number of changes of the support.
    """

    inner: int = 3
    removal: int = 1
    fill: int = 2
    final: int = 12
    inner_tolerance: float = 1e-2
    large_gain: float = 10.0
    max_changes: int = 60

    def __post_init__(self) -> None:
        for name in ("inner", "removal", "fill", "final", "max_changes"):
            object.__setattr__(self, name, count(name, getattr(self, name), minimum=0))
        not_negative("inner_tolerance", self.inner_tolerance)
        not_negative("large_gain", self.large_gain)


DEFAULT_LIMITS = IterationLimits()


@dataclass(frozen=True, eq=False)
class SupportSearch:
    """Changes of the support of an array's problems, and their limits.

    Parameters
    ----------
    response : ExpectedResponse
    grid : CandidateGrid
    limits : IterationLimits
    tolerance : float
        Change of F, nats, at which the final Newton steps stop.
    max_iterations : int
        Largest number of Newton steps.
    kl_weight : float
        Share of the KL divergences that is charged.
    n_components : int
        Components whose activity is estimated.
    max_active, fill_target : int
        Largest number of active components, and that of the fill stage, which also ends at four
        more than were active, or eight.
    reestimate : bool
        True if the gain of a removal includes that of updating the noise.
    curved_probability : float
        Prior probability that a wave is curved, where components have a range.
    """

    response: ExpectedResponse
    grid: CandidateGrid
    limits: IterationLimits
    tolerance: float
    max_iterations: int
    kl_weight: float
    n_components: int
    max_active: int
    fill_target: int
    reestimate: bool
    curved_probability: float

    def next_change(self, state: SolverState) -> None:
        """Accept or reject the trial components, then set the next change and Newton steps."""
        rejected = self.accept_or_reject(state)
        stop = state.n_changes >= self.limits.max_changes
        stop = stop | (state.iterations >= self.max_iterations)
        open_ = ~(rejected | stop)
        if any_set(open_):
            self.merge(state, open_)
        removed = self.remove_weakest(state, open_ & ~state.filling)
        added = self.add(state, open_ & ~removed)
        idle = ~(removed | added)
        switched = self.switch(state, idle & state.may_switch & ~state.filling & ~stop)
        self.finish(state, idle & ~switched, stop)
        state.on_trial = added
        steps_left = self.max_iterations - state.iterations
        np.minimum(state.steps_remaining, steps_left, out=state.steps_remaining)

    def accept_or_reject(self, state: SolverState) -> Bool:
        """Keep additions that exceed the record, undo the others and return their rows."""
        if not any_set(state.on_trial):
            return np.zeros(len(state), dtype=np.bool_)
        now = state.evaluation.criterion(self.kl_weight)
        better = state.on_trial & (now > np.maximum(state.before, state.record) + MARGIN)
        worse = state.on_trial & ~better
        if any_set(better):
            state.record = np.where(better, now, state.record)
            count_change(state, better)
            assign_slots(state, better)
        if any_set(worse):
            state.evaluation = state.evaluation.replace_rows(worse, state.saved.select(worse))
            state.rejected = np.where(worse, state.evaluation.F, state.rejected)
        return worse

    def merge(self, state: SolverState, rows: Bool) -> None:
        """Remove every component too near to an earlier one, and exclude the points near it."""
        k = self.grid.first_duplicate(state.evaluation)
        while any_set(rows & (k >= 0)):
            near = rows & (k >= 0)
            excluded = state.removed.excluded.copy()
            excluded[near] |= self.grid.exclusion(state.evaluation, near, k)
            state.removed = state.removed.changed(excluded=excluded)
            self.remove(state, near, k, can_reactivate=False)
            k = self.grid.first_duplicate(state.evaluation)

    def remove_weakest(self, state: SolverState, rows: Bool) -> Bool:
        """Remove the component whose removal gains most, if it gains; return where one was."""
        if not any_set(rows):
            return rows
        gains = removal_gains(self.response, state.evaluation, self.kl_weight)
        if self.reestimate:
            gains = gains + reestimation_gains(self.response, state.evaluation)
        k = gains.argmax(axis=1)
        rows = rows & (gains[np.arange(len(state)), k] > 0)
        if any_set(rows):
            self.remove(state, rows, k, can_reactivate=True)
            self.set_steps(state, rows, self.limits.removal)
        return rows

    def remove(self, state: SolverState, rows: Bool, k: Int, can_reactivate: bool) -> None:
        """Remove the k-th component of some rows, and keep it in the memory as it is."""
        index, k, old = np.flatnonzero(rows), k[rows], state.evaluation
        slot = old.components.slot[index, k]
        memory, flags = state.removed.memory.copy(), state.removed.can_reactivate.copy()
        memory.packed[index, :, slot] = old.components.packed[index, :, k]
        tracked = slot < flags.shape[1]
        flags[index[tracked], slot[tracked]] = can_reactivate
        state.removed = state.removed.changed(memory=memory, can_reactivate=flags)
        count_change(state, rows)
        kept = old.components.select(rows).without(k)
        self.set_components(state, rows, kept, old.K[rows] - 1)

    def add(self, state: SolverState, rows: Bool) -> Bool:
        """Add the best new components on trial; return where there are any."""
        now = state.evaluation
        fill_target = np.minimum(self.fill_target, state.fill_target)
        room = np.where(state.filling, fill_target, self.max_active) - now.K
        unchanged = np.abs(now.F - state.rejected) < self.limits.inner_tolerance
        rows = rows & (room > 0) & ~unchanged
        if not any_set(rows):
            return rows
        part = state.select(rows)
        prior = part.log_odds_new
        if any_set(part.estimate_rho):
            estimated = self.estimated_log_odds(part.evaluation.K + 1)
            prior = np.where(part.estimate_rho & ~part.filling, estimated, prior)
        room = np.where(part.filling, room[rows], 1)
        new = add_candidates(self.grid, part.evaluation, prior, part.removed, room, self.kl_weight)
        gain = new.n > 0
        added = rows.copy()
        added[rows] = gain
        if any_set(added):
            state.saved = state.saved.replace_rows(added, now.select(added))
            state.before = np.where(added, now.criterion(self.kl_weight), state.before)
            components, K = new.appended_to(part.evaluation.components, part.evaluation.K)
            self.set_components(state, added, components.select(gain), K[gain])
            n = np.where(state.filling, self.limits.fill, self.limits.inner)
            self.set_steps(state, added, n)
        return added

    def switch(self, state: SolverState, rows: Bool) -> Bool:
        """Change one component from plane to curved, or back, if it gains; return where one was."""
        if not any_set(rows):
            return rows
        part = state.select(rows)
        evaluation, tried, changed = switch_waves(
            self.response, part.evaluation, part.estimate_nu, self.limits.inner,
            self.curved_probability, self.kl_weight,
        )  # fmt: skip
        state.evaluation = state.evaluation.replace_rows(rows, evaluation)
        switched, steps = rows.copy(), np.zeros(len(rows), dtype=np.int64)
        switched[rows], steps[rows] = changed, self.limits.inner * tried
        state.iterations = state.iterations + steps
        state.may_switch = state.may_switch & ~(rows & ~switched)
        count_change(state, switched)
        self.set_steps(state, switched, self.limits.removal)
        return switched

    def finish(self, state: SolverState, idle: Bool, stop: Bool) -> None:
        """End the fill stage, take the final steps, or finish in rows without a gain."""
        state.done = idle & ((state.finished & ~state.filling) | stop)
        state.finished = state.finished & ~(stop & ~state.finished)
        idle = idle & ~state.done
        filled = idle & state.filling
        if any_set(filled):
            self.end_fill_stage(state, filled)
        final = idle & ~filled
        if any_set(final):
            first = final & ~state.had_final
            state.may_switch = state.may_switch | (first & self.response.chart.has_curvature)
            state.finished, state.had_final = state.finished | final, state.had_final | final
            self.set_steps(state, final, self.limits.final, self.tolerance)

    def end_fill_stage(self, state: SolverState, rows: Bool) -> None:
        """End the fill stage: from now on ν, τ and ρ are updated."""
        state.filling = state.filling & ~rows
        state.estimate_nu = state.estimate_nu | rows
        state.record = np.where(rows, -np.inf, state.record)
        state.rejected = np.where(rows, np.nan, state.rejected)
        estimated = rows & state.estimate_rho
        if any_set(estimated):
            now = state.evaluation.select(estimated)
            self.set_components(state, estimated, now.components, now.K)
        self.set_steps(state, rows, self.limits.inner)

    def set_steps(
        self, state: SolverState, rows: Bool, n: Int | int, tolerance: float | None = None
    ) -> None:
        """Set the number of Newton steps that follow, and the gain at which they end early."""
        tolerance = self.limits.inner_tolerance if tolerance is None else tolerance
        state.steps_remaining = np.where(rows, n, state.steps_remaining)
        state.tolerance = np.where(rows, tolerance, state.tolerance)

    def set_components(
        self, state: SolverState, rows: Bool, components: Components, K: Int
    ) -> None:
        """Replace the components of some rows, with the prior by the estimated ρ."""
        old = state.evaluation.select(rows)
        log_prior_inactive = old.log_prior_inactive
        if any_set(state.estimate_rho):
            estimated, filling = state.estimate_rho[rows], state.filling[rows]
            odds = np.where(
                estimated & ~filling, self.estimated_log_odds(K), state.log_odds_new[rows]
            )
            components = components.copy()
            components.log_odds[estimated] = odds[estimated, None]
            all_inactive = -self.n_components * np.log1p(np.exp(odds))
            log_prior_inactive = np.where(estimated, all_inactive, log_prior_inactive)
        components = components.first(max(int(K.max()), 1))
        new = evaluate(self.response, old.Y, components, K, old.nu, old.tau, log_prior_inactive)
        state.evaluation = state.evaluation.replace_rows(rows, new)

    def estimated_log_odds(self, K: Int) -> Float:
        """Return the log odds of ρ = K/L, which lies between 1/L and (L-1)/L."""
        L = max(self.n_components, 2)
        return log_odds(np.clip(K, 1, L - 1) / L)


def count_change(state: SolverState, rows: Bool) -> None:
    """Count a change of the support."""
    state.n_changes = state.n_changes + rows
    state.finished = state.finished & ~rows
    state.rejected = np.where(rows, np.nan, state.rejected)


def assign_slots(state: SolverState, rows: Bool) -> None:
    """Assign slots of the memory to the components that passed their trial."""
    now, removed = state.evaluation, state.removed
    slot = now.components.slot
    active = now.used & rows[:, None]
    new = active & (slot < 0)
    slot = np.where(new, state.n_known[:, None] + np.cumsum(new, axis=1) - 1, slot)
    state.evaluation = now.changed(components=now.components.with_slots(slot))
    state.n_known = state.n_known + new.sum(axis=1)
    packed, n_known = removed.memory.packed, int(state.n_known.max())
    if n_known > packed.shape[2]:
        packed = enlarged(packed, (packed.shape[1], n_known))
    flags = removed.can_reactivate.copy()
    tracked = active & (slot < flags.shape[1])
    flags[np.nonzero(tracked)[0], slot[tracked]] = False
    state.removed = removed.changed(memory=removed.memory.like(packed), can_reactivate=flags)
