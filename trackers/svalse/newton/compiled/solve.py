"""Solve independent problems one after the other, each from its start to its end."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.svalse.newton.compiled.compiler import compiled, compiled_part
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


@compiled
def solve_all(task: Task, terms: Terms, removed: Removed, outcome: Outcome) -> None:
    """Solve all problems in place: the fields of the records, and of the start, have an axis more.

    Parameters
    ----------
    task : Task
    terms : Terms
        Snapshots, components and variances at the start; at the end all terms.
    removed : Removed
    outcome : Outcome
        Newton steps, and whether the final ones were taken, of each problem.
    """
    now, trial, saved = like(terms), like(terms), like(terms)
    for b in range(len(terms.K)):
        start = Start(
            task.start.estimate_rho[b : b + 1],
            task.start.log_odds_new[b : b + 1],
            task.start.fill_target[b : b + 1],
        )
        one = Task(task.chart, task.grid, task.search, start)
        memory = Removed(
            removed.memory[b], removed.can_reactivate[b], removed.excluded[b], removed.n_known[b]
        )
        state = initial_progress()
        for record in (now, trial, saved):
            load(terms, b, record)
        result = solve(one, now, trial, saved, memory, state)
        store(result, terms, b)
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
def like(terms: Terms) -> Terms:
    """Return a record with space for one of several problems."""
    return Terms(
        np.empty_like(terms.Y[0]), np.empty_like(terms.packed[0]), np.empty_like(terms.K[0]),
        np.empty_like(terms.nu[0]), np.empty_like(terms.tau[0]),
        np.empty_like(terms.log_prior_inactive[0]), np.empty_like(terms.responses[0]),
        np.empty_like(terms.X[0]), np.empty_like(terms.h[0]),
        np.empty_like(terms.uncertainty_loss[0]), np.empty_like(terms.prior_gradient[0]),
        np.empty_like(terms.prior_curvature[0]), np.empty_like(terms.D[0]),
        np.empty_like(terms.log_prior[0]), np.empty_like(terms.W[0]), np.empty_like(terms.G[0]),
        np.empty_like(terms.explained[0]), np.empty_like(terms.F[0]),
    )  # fmt: skip


@compiled_part
def load(terms: Terms, b: int, e: Terms) -> None:
    """Copy what a problem starts with."""
    K = terms.K[b, 0]
    e.K[0], e.log_prior_inactive[0] = K, terms.log_prior_inactive[b, 0]
    for f in range(e.Y.shape[0]):
        e.nu[f], e.tau[f] = terms.nu[b, f], terms.tau[b, f]
        for m in range(e.Y.shape[1]):
            for n in range(e.Y.shape[2]):
                e.Y[f, m, n] = terms.Y[b, f, m, n]
    for i in range(e.packed.shape[0]):
        for c in range(K):
            e.packed[i, c] = terms.packed[b, i, c]


@compiled_part
def store(e: Terms, terms: Terms, b: int) -> None:
    """Copy the terms of a solution; those of unused slots are 0."""
    K = e.K[0]
    terms.K[b, 0], terms.log_prior_inactive[b, 0] = K, e.log_prior_inactive[0]
    terms.log_prior[b, 0], terms.F[b, 0] = e.log_prior[0], e.F[0]
    n_start = terms.packed.shape[2]
    for i in range(e.packed.shape[0]):
        for c in range(n_start):
            terms.packed[b, i, c] = e.packed[i, c] if c < K else 0.0
    for f in range(e.Y.shape[0]):
        terms.nu[b, f], terms.tau[b, f] = e.nu[f], e.tau[f]
        terms.explained[b, f] = e.explained[f]
    for c in range(K):
        terms.prior_gradient[b, c] = e.prior_gradient[c]
        terms.prior_curvature[b, c], terms.D[b, c] = e.prior_curvature[c], e.D[c]
        for f in range(e.Y.shape[0]):
            terms.uncertainty_loss[b, f, c] = e.uncertainty_loss[f, c]
            for m in range(e.Y.shape[1]):
                terms.responses[b, f, 0, c, m] = e.responses[f, 0, c, m]
            for n in range(e.Y.shape[2]):
                terms.W[b, f, c, n] = e.W[f, c, n]
                for p in range(3):
                    terms.h[b, f, p, c, n] = e.h[f, p, c, n]
            for j in range(K):
                terms.G[b, f, c, j] = e.G[f, c, j]
                for p in range(e.X.shape[1]):
                    terms.X[b, f, p, c, j] = e.X[f, p, c, j]
