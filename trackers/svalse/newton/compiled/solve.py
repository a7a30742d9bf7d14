"""Solve independent problems one after the other, each from its start to its end."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from arrivals.trackers.compiler import compiled, compiled_part
from arrivals.trackers.svalse.newton.compiled.marginals import set_marginals
from arrivals.trackers.svalse.newton.compiled.records import (
    Outcome,
    Progress,
    Removed,
    Start,
    Task,
    Terms,
)
from arrivals.trackers.svalse.newton.compiled.search import (
    MERGED,
    NOTHING,
    accept,
    add,
    finish,
    limit_steps,
    remove_one,
    set_components,
)
from arrivals.trackers.svalse.newton.compiled.step import newton_step, update_variances

SOURCES = Path(__file__).parents[1]  # all that compiled functions use, and its constants


@partial(compiled, sources=SOURCES)
def solve_all(task: Task, removed: Removed, outcome: Outcome) -> None:
    """Solve all problems in place: the fields of the start and of the records have an axis more.

    Parameters
    ----------
    task : Task
        With the snapshots, components and variances at the start; at the end of the solution.
    removed : Removed
    outcome : Outcome
    """
    starts = task.start
    F, M, N = starts.Y.shape[1:]
    L, n_products = starts.packed.shape[2], 3 if task.chart.G.shape[0] == 0 else 4
    now, trial, saved = (
        space(F, M, N, L, n_products), space(F, M, N, L, n_products), space(F, M, N, L, n_products)
    )  # fmt: skip
    for b in range(len(starts.K)):
        one = Task(task.chart, task.grid, task.search, problem(starts, b))
        memory = Removed(
            removed.memory[b], removed.can_reactivate[b], removed.excluded[b], removed.n_known[b]
        )
        state = initial_progress()
        for record in (now, trial, saved):
            load(one.start, record)
        result = solve(one, now, trial, saved, memory, state)
        store(result, one.start)
        set_marginals(task, result, outcome, b)
        outcome.iterations[b], outcome.finished[b] = state.iterations[0], state.finished[0]


@compiled_part
def solve(
    task: Task, now: Terms, trial: Terms, saved: Terms, removed: Removed, state: Progress
) -> Terms:
    """Alternate Newton steps and changes of the support until neither gains.

    The records change places; return that of the solution.
    """
    limits, stale = task.search, True
    state.tolerance[0] = limits.inner_tolerance
    state.steps_remaining[0] = 0 if task.start.estimate_rho[0] else limits.inner
    due = state.steps_remaining[0] == 0  # a change of the support
    while True:
        if stale:
            set_components(task, now, state)
            stale = False
        if due:
            rejected = state.on_trial[0] and not accept(task, now, removed, state)
            if rejected:
                now, saved = saved, now
                state.rejected[0] = now.F[0]
            stop = state.n_changes[0] >= limits.max_changes
            stop = stop or state.iterations[0] >= limits.max_iterations
            state.on_trial[0], change = False, NOTHING
            if not (rejected or stop):
                change = remove_one(task, now, removed, state)
                state.on_trial[0] = change == NOTHING and add(task, now, saved, removed, state)
            if state.on_trial[0]:
                now, saved = saved, now
                stale = True
            elif change == NOTHING:
                stale = finish(task, state, stop)
                if state.done[0]:
                    return now
            else:
                stale = True
            due = change == MERGED  # others may be near, too
            if not due:
                limit_steps(task, state)
            if stale:
                continue
        before = now.F[0]
        if now.K[0] > 0 and newton_step(task.chart, now, trial):
            now, trial = trial, now
        if state.estimate_nu[0]:
            update_variances(task.chart, now)
        state.iterations[0] += 1
        gain, steps = abs(now.F[0] - before), state.steps_remaining[0]
        if gain > limits.large_gain:
            steps = max(steps, 2)
        state.steps_remaining[0] = 0 if gain < state.tolerance[0] else steps - 1
        limit_steps(task, state)
        due = state.steps_remaining[0] == 0


@compiled_part
def initial_progress() -> Progress:
    """Return the progress of a problem that starts: in the fill stage."""
    flags, counts = np.zeros((5, 1), dtype=np.bool_), np.zeros((3, 1), dtype=np.int64)
    numbers = np.zeros((4, 1))
    flags[0, 0] = True
    numbers[1, 0], numbers[2, 0], numbers[3, 0] = -np.inf, np.nan, np.nan
    return Progress(
        flags[0], flags[1], flags[2], flags[3], flags[4], counts[0], counts[1], counts[2],
        numbers[0], numbers[1], numbers[2], numbers[3],
    )  # fmt: skip


@compiled_part
def problem(starts: Start, b: int) -> Start:
    """Return the start of one of several problems: views."""
    return Start(
        starts.Y[b], starts.packed[b], starts.K[b : b + 1], starts.nu[b], starts.tau[b],
        starts.log_prior_inactive[b : b + 1], starts.estimate_rho[b : b + 1],
        starts.log_odds_new[b : b + 1], starts.fill_target[b : b + 1],
    )  # fmt: skip


@compiled_part
def space(F: int, M: int, N: int, L: int, n_products: int) -> Terms:
    """Return a record with space for L components."""
    of_each, numbers, per_bin = np.empty((3, L)), np.empty((3, 1)), np.empty((3, F))
    return Terms(
        np.empty((F, M, N), dtype=np.complex128), np.empty((7, L)), np.empty(1, dtype=np.int64),
        per_bin[0], per_bin[1], numbers[0], np.empty((F, L, 3, M), dtype=np.complex128),
        np.empty((F, n_products, L, L), dtype=np.complex128),
        np.empty((F, 3, L, N), dtype=np.complex128), np.empty((F, L)),
        of_each[0], of_each[1], of_each[2], numbers[1],
        np.empty((F, L, N), dtype=np.complex128), np.empty((F, L, L), dtype=np.complex128),
        per_bin[2], numbers[2],
    )  # fmt: skip


@compiled_part
def load(start: Start, e: Terms) -> None:
    """Copy what a problem starts with."""
    e.K[0], e.log_prior_inactive[0] = start.K[0], start.log_prior_inactive[0]
    for f in range(e.Y.shape[0]):
        e.nu[f], e.tau[f] = start.nu[f], start.tau[f]
        for m in range(e.Y.shape[1]):
            for n in range(e.Y.shape[2]):
                e.Y[f, m, n] = start.Y[f, m, n]
    for i in range(e.packed.shape[0]):
        for c in range(start.K[0]):
            e.packed[i, c] = start.packed[i, c]


@compiled_part
def store(e: Terms, start: Start) -> None:
    """Copy the components and variances of a solution."""
    start.K[0] = e.K[0]
    for f in range(e.Y.shape[0]):
        start.nu[f], start.tau[f] = e.nu[f], e.tau[f]
    for i in range(e.packed.shape[0]):
        for c in range(e.K[0]):
            start.packed[i, c] = e.packed[i, c]
