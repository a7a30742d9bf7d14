"""Functions that decide the claims on where the iterations end, and whether that can be seen."""

from __future__ import annotations

from functools import partial

import numpy as np

from arrivals.scenarios.experiments.statistics import jackknife
from arrivals.scenarios.reproduce.decisions import (
    Both,
    Decide,
    Decision,
    by_forms,
    negative,
    share,
)
from arrivals.scenarios.reproduce.rss.convergence import JUMP
from arrivals.scenarios.reproduce.rss.decisions import (
    FEW,
    FORMS,
    LITERAL,
    ML,
    OURS,
    Key,
    Table1Results,
    at_most,
)
from arrivals.scenarios.reproduce.rss.timing import DIFFERENCES
from arrivals.typing import Bool, Float, Int

MANY_RUNS = 1000  # without a counterexample
AS_GOOD = 1.1  # times the error after 30 cycles
OFTEN = 0.1  # of the trials
EASY = 0.9  # of the pairs of a trial of a kind and another: ranked in this order
FEWEST = 5  # trials of a kind, and others, that are ranked


def mostly(field: str, case: str) -> Both:
    """Decide that something happens in more than half of the runs."""
    return by_forms((LITERAL, OURS), _mostly, field, case)


def _mostly(field: str, case: str, method: str, results: Table1Results) -> Decision | None:
    flags = getattr(results, field).get((case, method))
    return None if flags is None else _more_than(0.5, flags)


def _more_than(limit: float, flags: Bool) -> Decision:
    p, error = share(flags)
    return Decision(negative(limit - p, error), f"{p:.1%} ± {error:.1%} of the trials")


def jumps_mostly(case: str, method: str) -> Decide:
    """Decide that a cycle of a method moves a source by more than 100 m in most runs."""
    return partial(_jumps_mostly, (case, method))


def _jumps_mostly(key: Key, results: Table1Results) -> Decision | None:
    steps = results.steps.get(key)
    return None if steps is None else _more_than(0.5, np.asarray(steps > JUMP))


def always(field: str, case: str) -> Both:
    """Decide that something happens in all runs; not decided by few runs."""
    return by_forms((LITERAL, OURS), _always, field, case)


def _always(field: str, case: str, method: str, results: Table1Results) -> Decision | None:
    flags = getattr(results, field).get((case, method))
    if flags is None:
        return None
    holds = False if not flags.all() else True if len(flags) >= MANY_RUNS else None
    return Decision(holds, f"{flags.sum()} of {len(flags)} trials")


def as_good_after_few(case: str) -> Both:
    """Decide that the location error after 9 cycles is within a tenth of that after 30."""
    return by_forms((LITERAL, OURS), _as_good, case)


def _as_good(case: str, method: str, results: Table1Results) -> Decision | None:
    few, many = (case, f"{method} {FEW}"), (case, method)
    return at_most(AS_GOOD, "after 9 cycles", few, "after 30", many, results)


# -- pairs of methods ---------------------------------------------------------------------------


def more_stuck(case: str) -> Both:
    """Decide that ML ends near a local maximum more often than VB."""
    return by_forms((LITERAL, OURS), _more_stuck, case)


def _more_stuck(case: str, method: str, results: Table1Results) -> Decision | None:
    vb, ml = (results.maxima.get((case, name)) for name in (method, ML))
    if vb is None or ml is None:
        return None
    return _more_often("ML", ml.stuck, FORMS[method], vb.stuck)


def more_divergent(case: str) -> Both:
    """Decide that VB diverges more often than ML."""
    return by_forms((LITERAL, OURS), _more_divergent, case)


def _more_divergent(case: str, method: str, results: Table1Results) -> Decision | None:
    vb, ml = (results.diverged.get((case, name)) for name in (method, ML))
    if vb is None or ml is None:
        return None
    return _more_often(FORMS[method], vb, "ML", ml)


def _more_often(name: str, first: Bool, other: str, second: Bool) -> Decision:
    """Decide by paired runs that something happens more often in the first than in the second."""
    d = np.asarray(second, dtype=float) - first
    error = float(np.hypot(d.std(), 0.5 / len(d)) / np.sqrt(len(d)))
    numbers = (
        f"{name} {first.mean():.1%}, {other} {second.mean():.1%} of the trials; "
        f"difference {first.mean() - second.mean():+.1%} ± {error:.1%}"
    )
    return Decision(negative(float(d.mean()), error), numbers)


def stable_by_prior(case: str) -> Decide:
    """Decide that fewer searches for a mode move a source by more than 100 m with the prior."""
    return partial(_stable_by_prior, case)


def _stable_by_prior(case: str, results: Table1Results) -> Decision | None:
    steps = results.modes.get(case)
    if steps is None:
        return None
    far = [np.asarray(part > JUMP) for part in steps]
    return _more_often("without the prior", far[1], "with it", far[0])


def without_direction(case: str) -> Both:
    """Decide that ML often finds no first direction.

    By the paper's form the search has gradients by differences; ours has analytic ones.
    """
    return by_forms((DIFFERENCES, ML), _without_direction, case)


def _without_direction(case: str, method: str, results: Table1Results) -> Decision | None:
    flags = results.unmoved.get((case, method))
    return None if flags is None else _more_than(OFTEN, flags)


# -- detection ----------------------------------------------------------------------------------


def ranked(score: Float, event: Bool) -> float:
    """Return the share of pairs of an event and another run in which the event scores higher.

    Examples
    --------
    >>> ranked(np.array([3.0, 1.0, 2.0]), np.array([True, False, False]))
    1.0
    """
    d = score[event][:, None] - score[~event]
    return float(np.mean((d > 0) + 0.5 * (d == 0)))


def visible(case: str) -> Both:
    """Decide that the divergence of VB is easy to detect by its largest step."""
    return by_forms((LITERAL, OURS), _visible, case)


def _visible(case: str, method: str, results: Table1Results) -> Decision | None:
    found = _of_steps((case, method), results)
    if found is None:
        return None
    value, error = found
    numbers = _shown(value, error, results.diverged[case, method])
    return Decision(negative(EASY - value, error), numbers)


def harder(case: str) -> Both:
    """Decide that local maxima of ML are harder to detect than the divergence of VB."""
    return by_forms((LITERAL, OURS), _harder, case)


def _harder(case: str, method: str, results: Table1Results) -> Decision | None:
    steps, ends = _of_steps((case, method), results), results.maxima.get((case, ML))
    if steps is None or ends is None:
        return None
    fit = _ranking(ends.misfit, ends.stuck)
    numbers = (
        f"local maxima of ML by their misfit: {_shown(*fit, ends.stuck)}; divergence of "
        f"{FORMS[method]} by its steps: {_shown(*steps, results.diverged[case, method])}"
    )
    return Decision(negative(fit[0] - steps[0], float(np.hypot(fit[1], steps[1]))), numbers)


def _of_steps(key: Key, results: Table1Results) -> tuple[float, float] | None:
    steps, diverged = results.steps.get(key), results.diverged.get(key)
    return None if steps is None or diverged is None else _ranking(steps, diverged)


def _ranking(score: Float, event: Bool) -> tuple[float, float]:
    """Return the share of ranked pairs and its standard error, NaN with too few runs of a kind."""
    if min(event.sum(), (~event).sum()) < FEWEST:
        return np.nan, np.nan
    finite = np.nan_to_num(score, nan=np.inf, posinf=1e300)

    def of(rows: Int) -> float:
        return ranked(finite[rows], event[rows])

    value, error = jackknife(of, len(event))
    return value, max(error, 1 / len(event))


def _shown(value: float, error: float, event: Bool) -> str:
    if np.isnan(value):
        return f"{event.sum()} of {len(event)} trials: cannot be ranked"
    return f"{value:.0%} ± {error:.0%} of the pairs"
