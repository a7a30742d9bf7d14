"""The moves of the fast engine between bursts of Newton steps: judge, merge, remove, add, rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arrivals.parameters import FrozenModel
from arrivals.trackers.svalse.newton.batch import enlarged, some
from arrivals.trackers.svalse.newton.candidates import (
    Grid,
    births,
    joined,
    nearest_later,
    relearned,
    removal_gains,
    without,
)
from arrivals.trackers.svalse.newton.elbo import MU, ODDS, PLACE, Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.state import SolverState, log_odds
from arrivals.typing import Bool, Float, Int

MARGIN = 1e-3  # nats by which an addition must raise the record


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


DEFAULT_LIMITS = IterationLimits()


@dataclass(frozen=True, eq=False)
class SupportSearch:
    """What is done to the support, with all that bounds it.

    Parameters
    ----------
    response : Response
    grid : Grid
    bursts : Bursts
    kl : float
        Share of the angles' KL divergences that is charged.
    places : int
        Components whose activity is in question.
    most, fill_to : int
        Active ones at most, and in the fill stage.
    max_iterations : int
    tolerance : float
        Change of F, nats, at which the final Newton steps stop.
    relearn : bool
        Whether a removal counts what the noise gains by being learned again.
    """

    response: ExpectedResponse
    grid: Grid
    bursts: IterationLimits
    kl: float
    places: int
    most: int
    fill_to: int
    max_iterations: int
    tolerance: float
    relearn: bool = False

    def choose(self, work: SolverState) -> None:
        """Judge what is on trial, and choose the next burst of each problem: one pass 1-4."""
        exhausted = self.judge(work)
        stop = (work.moves >= self.bursts.max_changes) | (work.iterations >= self.max_iterations)
        open_ = ~(exhausted | stop)
        if some(open_):
            self.merge(work, open_)
        removed = self.remove(work, open_ & ~work.filling)
        added = self.add(work, open_ & ~removed)
        self.rest(work, ~(removed | added), stop)
        work.trial = added
        np.minimum(work.left, self.max_iterations - work.iterations, out=work.left)

    def judge(self, work: SolverState) -> Bool:
        """Keep additions that raise the record, undo the others and tell which they are."""
        if not some(work.trial):
            return np.zeros(len(work), dtype=np.bool_)
        now = work.state.criterion(self.kl)
        better = work.trial & (now > np.maximum(work.before, work.record) + MARGIN)
        worse = work.trial & ~better
        if some(better):
            work.record = np.where(better, now, work.record)
            changed(work, better)
            remember(work, better)
        if some(worse):
            work.state = work.state.put(worse, work.saved.take(worse))
            work.rejected = np.where(worse, work.state.F, work.rejected)
        return worse

    def merge(self, work: SolverState, rows: Bool) -> None:
        """Switch off every component too near to an earlier one, and let none be born there."""
        later = nearest_later(self.grid, work.state)
        while some(rows & (later >= 0)):
            near = rows & (later >= 0)
            doa = self.grid.manifold.to_doa(work.state.facts[near, MU, later[near]])
            barred = work.barred.copy()
            barred[near] |= self.grid.near(doa)
            work.barred = barred
            self.drop(work, near, later, revivable=False)
            later = nearest_later(self.grid, work.state)

    def remove(self, work: SolverState, rows: Bool) -> Bool:
        """Remove the component whose removal gains most, if it gains; tell where one was."""
        if not some(rows):
            return rows
        gains = removal_gains(self.response, work.state, self.kl)
        if self.relearn:
            gains = gains + relearned(self.response, work.state)
        k = gains.argmax(axis=1)
        rows = rows & (gains[np.arange(len(work)), k] > 0)
        if some(rows):
            self.drop(work, rows, k, revivable=True)
            self.burst(work, rows, self.bursts.removal, self.bursts.inner_tolerance)
        return rows

    def drop(self, work: SolverState, rows: Bool, k: Int, revivable: bool) -> None:
        """Remove the k-th component of some rows, and remember it as it is."""
        of, k = np.flatnonzero(rows), k[rows]
        state = work.state
        fact = state.facts[of, :, k]
        place = fact[:, PLACE].astype(np.int64)
        work.memory, work.revivable = work.memory.copy(), work.revivable.copy()
        work.memory[of, :, place] = fact
        known = place < work.revivable.shape[1]
        work.revivable[of[known], place[known]] = revivable
        changed(work, rows)
        self.evaluated(work, rows, without(state.facts[rows], k), state.K[rows] - 1)

    def add(self, work: SolverState, rows: Bool) -> Bool:
        """Add the best newcomers on trial; tell where there are some."""
        state = work.state
        room = np.where(work.filling, self.fill_to, self.most) - state.K
        same = np.abs(state.F - work.rejected) < self.bursts.inner_tolerance
        rows = rows & (room > 0) & ~same
        if not some(rows):
            return rows
        part = work.take(rows)
        odds = part.birth
        if some(part.free):
            odds = np.where(part.free & ~part.filling, self.learned(part.state.K + 1), odds)
        new = births(
            self.grid, part.state, odds, part.memory[:, :, : part.revivable.shape[1]],
            part.revivable, part.barred, np.where(part.filling, room[rows], 1), self.kl,
        )  # fmt: skip
        found = rows.copy()
        found[rows] = new.n > 0
        if some(found):
            work.saved = work.saved.put(found, state.take(found))
            work.before = np.where(found, state.criterion(self.kl), work.before)
            facts, K = joined(part.state.facts, part.state.K, new)
            self.evaluated(work, found, facts[new.n > 0], K[new.n > 0])
            n = np.where(work.filling, self.bursts.fill, self.bursts.inner)
            self.burst(work, found, n, self.bursts.inner_tolerance)
        return found

    def rest(self, work: SolverState, idle: Bool, stop: Bool) -> None:
        """Where no move is left: end the fill stage, take the final steps, or be done."""
        work.done = idle & ((work.finished & ~work.filling) | stop)
        work.finished = work.finished & ~(stop & ~work.finished)
        idle = idle & ~work.done
        filled = idle & work.filling
        if some(filled):
            work.filling = work.filling & ~filled
            work.learn = work.learn | filled
            work.record = np.where(filled, -np.inf, work.record)
            work.rejected = np.where(filled, np.nan, work.rejected)
            free = filled & work.free
            if some(free):
                self.evaluated(work, free, work.state.facts[free], work.state.K[free])
            self.burst(work, filled, self.bursts.inner, self.bursts.inner_tolerance)
        final = idle & ~filled
        if some(final):
            work.finished = work.finished | final
            self.burst(work, final, self.bursts.final, self.tolerance)

    def burst(self, work: SolverState, rows: Bool, n: Int | int, tolerance: float) -> None:
        """Set the number of Newton steps that follow."""
        work.left = np.where(rows, n, work.left)
        work.tolerance = np.where(rows, tolerance, work.tolerance)

    def evaluated(self, work: SolverState, rows: Bool, facts: Float, K: Int) -> None:
        """Give some rows other components."""
        old = work.state.take(rows)
        rest = old.rest
        learning = (work.free & ~work.filling)[rows]
        if some(work.free):
            facts = facts.copy()
            odds = np.where(learning, self.learned(K), work.birth[rows])
            free = work.free[rows]
            facts[free, ODDS] = odds[free, None]
            absent = -self.places * np.log1p(np.exp(odds))
            rest = np.where(free, absent, rest)
        L = max(int(K.max()), 1)
        facts = facts[:, :, :L]
        new = evaluate(self.response, old.Y, facts, K, old.nu, old.tau, rest)
        work.state = work.state.put(rows, new)

    def learned(self, K: Int) -> Float:
        """Return the log odds of ρ = K/L, which lies between 1/L and (L-1)/L."""
        L = max(self.places, 2)
        return log_odds(np.clip(K, 1, L - 1) / L)


def changed(work: SolverState, rows: Bool) -> None:
    """Count a move."""
    work.moves = work.moves + rows
    work.finished = work.finished & ~rows
    work.rejected = np.where(rows, np.nan, work.rejected)


def remember(work: SolverState, rows: Bool) -> None:
    """Give the components that passed their trial a place in the memory."""
    state: Evaluation = work.state
    place = state.facts[:, PLACE]
    active = state.used & rows[:, None]
    fresh = active & (place < 0)
    number = np.where(fresh, work.n_known[:, None] + np.cumsum(fresh, axis=1) - 1, place)
    facts = state.facts.copy()
    facts[:, PLACE] = number
    work.state = replace(state, facts=facts)
    work.n_known = work.n_known + fresh.sum(axis=1)
    work.memory = (
        enlarged(work.memory, (facts.shape[1], int(work.n_known.max())), copy=False)
        if work.n_known.max() > work.memory.shape[2]
        else work.memory
    )
    known = active & (number < work.revivable.shape[1])
    revivable = work.revivable.copy()
    revivable[np.nonzero(known)[0], number[known].astype(np.int64)] = False
    work.revivable = revivable
