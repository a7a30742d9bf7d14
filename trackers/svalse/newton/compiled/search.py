"""Changes of the support of one problem: what `support_search` computes."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.compiler import compiled_part
from arrivals.trackers.svalse.newton.compiled.candidates import (
    add_candidates,
    exclude_near,
    first_duplicate,
    removal_gains,
)
from arrivals.trackers.svalse.newton.compiled.elbo import evaluate
from arrivals.trackers.svalse.newton.compiled.records import (
    LOG_ODDS,
    SLOT,
    Progress,
    Removed,
    Task,
    Terms,
)
from arrivals.trackers.svalse.newton.compiled.step import prepare
from arrivals.trackers.svalse.newton.support_search import MARGIN

NOTHING, REMOVED, MERGED = 0, 1, 2  # results of `remove_one`


@compiled_part
def accept(task: Task, now: Terms, removed: Removed, state: Progress) -> bool:
    """Keep additions that exceed the record; return False if they do not."""
    value = criterion(now, task.search.kl_weight)
    if not value > max(state.before[0], state.record[0]) + MARGIN:
        return False
    state.record[0] = value
    count_change(state)
    for c in range(now.K[0]):  # the new ones are assigned slots of the memory
        if now.packed[SLOT, c] < 0:
            now.packed[SLOT, c] = removed.n_known[0]
            removed.n_known[0] += 1
        slot = int(now.packed[SLOT, c])
        if slot < len(removed.can_reactivate):
            removed.can_reactivate[slot] = False
    return True


@compiled_part
def criterion(e: Terms, kl_weight: float) -> float:
    """Return the support criterion F + (1 - kl_weight) Σ D."""
    total = 0.0
    for c in range(e.K[0]):
        total += e.D[c]
    value: float = e.F[0] + (1 - kl_weight) * total
    return value


@compiled_part
def count_change(state: Progress) -> None:
    """Count a change of the support."""
    state.n_changes[0] += 1
    state.finished[0] = False
    state.rejected[0] = np.nan


@compiled_part
def remove_one(task: Task, now: Terms, removed: Removed, state: Progress) -> int:
    """Remove a component too near to an earlier one, else that whose removal gains most, if any.

    Return MERGED for the former, REMOVED for the latter, else NOTHING.
    """
    c = first_duplicate(task.chart, task.grid, now)
    if c >= 0:
        exclude_near(task.chart, task.grid, now, c, removed.excluded)
        remove(now, removed, state, c, False)
        return MERGED
    if state.filling[0] or now.K[0] == 0:
        return NOTHING
    gains = removal_gains(task.chart, now, task.search.kl_weight, task.search.reestimate)
    c = int(gains.argmax())
    if not gains[c] > 0:
        return NOTHING
    remove(now, removed, state, c, True)
    set_steps(state, task.search.removal, task.search.inner_tolerance)
    return REMOVED


@compiled_part
def remove(now: Terms, removed: Removed, state: Progress, c: int, can_reactivate: bool) -> None:
    """Remove a component, and keep it in the memory as it is."""
    slot = int(now.packed[SLOT, c])
    if slot < len(removed.can_reactivate):
        removed.can_reactivate[slot] = can_reactivate
    count_change(state)
    now.K[0] -= 1
    for i in range(now.packed.shape[0]):
        removed.memory[i, slot] = now.packed[i, c]
        for j in range(c, now.K[0]):
            now.packed[i, j] = now.packed[i, j + 1]


@compiled_part
def add(task: Task, now: Terms, new: Terms, removed: Removed, state: Progress) -> bool:
    """Put the best new components behind those of `now`; return False if there are none."""
    search, filling = task.search, state.filling[0]
    room = (task.start.fill_target[0] if filling else search.max_active) - now.K[0]
    if room <= 0 or abs(now.F[0] - state.rejected[0]) < search.inner_tolerance:
        return False
    prior = task.start.log_odds_new[0]
    if task.start.estimate_rho[0] and not filling:
        prior = estimated_log_odds(task, now.K[0] + 1)
    prepare(now, new)
    if add_candidates(task, now, new, removed, prior, room if filling else 1) == 0:
        return False
    state.before[0] = criterion(now, search.kl_weight)
    set_steps(state, search.fill if filling else search.inner, search.inner_tolerance)
    return True


@compiled_part
def finish(task: Task, state: Progress, stop: bool) -> bool:
    """End the fill stage, take the final steps, or finish; return True after the fill stage."""
    state.done[0] = (state.finished[0] and not state.filling[0]) or stop
    if state.done[0]:
        return False
    if state.filling[0]:  # from now on ν, τ and ρ are updated
        state.filling[0], state.estimate_nu[0] = False, True
        state.record[0], state.rejected[0] = -np.inf, np.nan
        set_steps(state, task.search.inner, task.search.inner_tolerance)
        return True
    state.finished[0] = True
    set_steps(state, task.search.final, task.search.tolerance)
    return False


@compiled_part
def set_steps(state: Progress, n: int, tolerance: float) -> None:
    """Set the number of Newton steps that follow, and the gain at which they end early."""
    state.steps_remaining[0], state.tolerance[0] = n, tolerance


@compiled_part
def limit_steps(task: Task, state: Progress) -> None:
    """Limit the Newton steps that follow to those that are left."""
    left = task.search.max_iterations - state.iterations[0]
    state.steps_remaining[0] = min(state.steps_remaining[0], left)


@compiled_part
def set_components(task: Task, now: Terms, state: Progress) -> None:
    """Evaluate other components, with the prior by the estimated ρ."""
    if task.start.estimate_rho[0]:
        odds = task.start.log_odds_new[0]
        if not state.filling[0]:
            odds = estimated_log_odds(task, now.K[0])
        for c in range(now.K[0]):
            now.packed[LOG_ODDS, c] = odds
        now.log_prior_inactive[0] = -task.search.n_components * np.log1p(np.exp(odds))
    evaluate(task.chart, now)


@compiled_part
def estimated_log_odds(task: Task, K: int) -> float:
    """Return the log odds of ρ = K/L, which lies between 1/L and (L-1)/L."""
    L = max(task.search.n_components, 2)
    rho = min(max(K, 1), L - 1) / L
    odds: float = np.log(rho) - np.log1p(-rho)
    return odds
