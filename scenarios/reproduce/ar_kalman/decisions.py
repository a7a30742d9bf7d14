"""Functions that decide the claims of the report, from values by metric, form, part and run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.ar_kalman.experiments import INNER, LITERAL, OURS, REPORT
from arrivals.scenarios.reproduce.ar_kalman.scores import Results
from arrivals.scenarios.reproduce.decisions import (
    Both,
    Decide,
    Decision,
    all_of,
    below,
    by_forms,
    mean_negative,
    negative,
    share,
)
from arrivals.typing import Float

CONVERGED, HALF = 0.5, 2.5  # degrees; half of the initial error of moving sources
DIFFERENCE = 0.25  # of a score: smaller ones are not significant
SYSTEMATIC = 0.2  # of a processor time: differences between machines and loads
VOICES = ("voice 1", "voice 2")


def by_both(decide: Callable[..., Decision | None], *args: Any) -> Both:
    """Return a function that decides by the report's form, and one by ours."""
    return by_forms((REPORT, OURS), decide, *args)


def values(results: Results, metric: str, form: str, *names: str) -> list[Float] | None:
    """Return the runs of parts; None if one was left out or has none."""
    found = [results.get((metric, form, name)) for name in names]
    given = [one for one in found if one is not None and not np.isnan(one).any()]
    return given if len(given) == len(found) else None


def named_means(names: Sequence[str], found: Sequence[Float], unit: str) -> str:
    """Return the means of parts with their standard errors, with names if there are several."""
    each = [f"{one.mean():.2g} ± {standard_error(one):.1g}" for one in found]
    if len(each) > 1:
        each = [f"{name}: {mean}" for name, mean in zip(names, each, strict=True)]
    return f"{'; '.join(each)} {unit}"


def under(metric: str, limit: float, *names: str, unit: str = "degrees") -> Both:
    """Decide that the mean of a score is below a limit, in all parts."""
    return by_both(_under, metric, limit, names, unit)


def _under(
    metric: str, limit: float, names: Sequence[str], unit: str, form: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, *names)
    if found is None:
        return None
    holds = all_of(mean_negative(one - limit) for one in found)
    return Decision(holds, named_means(names, found, unit))


def lower(metric: str, lowest: str, highest: str, unit: str = "degrees") -> Both:
    """Decide by the same runs that a score is lower in one part than in another."""
    return by_both(_lower, metric, lowest, highest, unit)


def _lower(
    metric: str, lowest: str, highest: str, unit: str, form: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, lowest, highest)
    if found is None:
        return None
    return below(np.abs(found[0]), np.abs(found[1]), unit, (lowest, highest))


def better_than(method: str, *names: str) -> Both:
    """Decide that the error of the tracker is below that of a subspace method."""
    return by_both(_better_than, method, names)


def _better_than(method: str, names: Sequence[str], form: str, results: Results) -> Decision | None:
    mine = values(results, "rmse", form, *names)
    others = values(results, "rmse", method, *names)
    if mine is None or others is None:
        return None
    n = min(map(len, others))
    first, second = (np.mean([one[:n] for one in many], axis=0) for many in (mine, others))
    return below(first, second, "degrees", ("tracker", method.upper()))


def mainly_bias(*names: str) -> Both:
    """Decide that the bias of the directions is above the spread of their errors."""
    return by_both(_mainly_bias, names)


def _mainly_bias(names: Sequence[str], form: str, results: Results) -> Decision | None:
    bias, spread = (values(results, metric, form, *names) for metric in ("bias", "spread"))
    if bias is None or spread is None:
        return None
    size = [np.sign(one.mean()) * one for one in bias]
    means = np.mean(spread, axis=0), np.mean(size, axis=0)
    decision = below(*means, "degrees", ("spread", "bias"))
    each = ", ".join(f"{one.mean():.2g}" for one in size)
    return Decision(decision.holds, f"bias {each} degrees; on average {decision.numbers}")


def grows_more(low: str, high: str) -> Both:
    """Decide that the error of directions grows by a larger factor than that of AR models."""
    return by_both(_grows_more, low, high)


def _grows_more(low: str, high: str, form: str, results: Results) -> Decision | None:
    doa = values(results, "rmse", form, low, high)
    models = values(results, "ar error", form, low, high)
    if doa is None or models is None:
        return None
    directions, others = (np.log2(one[0] / one[1]) for one in (doa, models))
    d = directions - others
    numbers = (
        f"the error grows by {directions.mean():.2f} octaves of the directions, "
        f"{others.mean():.2f} of the AR models, difference {d.mean():.2f} ± {standard_error(d):.2f}"
    )
    return Decision(mean_negative(-d), numbers)


def same(metric: str, name: str, other: str, unit: str = "degrees") -> Both:
    """Decide that a score differs by less than `DIFFERENCE` between two parts."""
    return by_both(_same, metric, name, other, unit)


def _same(
    metric: str, name: str, other: str, unit: str, form: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, name, other)
    if found is None:
        return None
    one, right = found
    # beyond the upper limit, and beyond the lower one
    beyond = one - (1 + DIFFERENCE) * right, (1 - DIFFERENCE) * right - one
    holds = all_of(map(mean_negative, beyond))
    d = one - right
    numbers = f"{name}: {one.mean():.3g}; {other}: {right.mean():.3g} {unit}"
    return Decision(holds, f"{numbers}, difference {d.mean():.2g} ± {standard_error(d):.1g}")


def fails(limit: float, *names: str) -> Both:
    """Decide that the error is above a limit in most runs of the parts together."""
    return by_both(_fails, limit, names)


def _fails(limit: float, names: Sequence[str], form: str, results: Results) -> Decision | None:
    found = values(results, "rmse", form, *names)
    if found is None:
        return None
    part, error = share(np.concatenate(found) > limit)
    numbers = f"in {part:.0%} of the runs, RMSE {named_means(names, found, 'degrees')}"
    return Decision(negative(0.5 - part, error), numbers)


def doubles(metric: str, name: str, right: str, unit: str = "degrees") -> Both:
    """Decide by the same runs that a score of a part is more than twice that of another."""
    return by_both(_doubles, metric, name, right, unit)


def _doubles(
    metric: str, name: str, right: str, unit: str, form: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, name, right)
    if found is None:
        return None
    d = found[0] / found[1]
    holds = mean_negative(2 - d)
    means = f"{name}: {found[0].mean():.3g}; right: {found[1].mean():.3g} {unit}"
    return Decision(holds, f"{means}, {d.mean():.2f} ± {standard_error(d):.2f} times")


def averaging() -> Both:
    """Decide that all pairs together have a smaller spread than the inner pair alone."""
    return by_both(_averaging)


def _averaging(form: str, results: Results) -> Decision | None:
    whole = values(results, "spread", form, "M = 2")
    inner = values(results, "spread", INNER[form], "M = 2")
    if not whole or not inner:
        return None
    return below(whole[0], inner[0], "degrees", ("all", "inner"))


def in_real_time(name: str) -> Both:
    """Decide that an interval takes less processor time than it lasts."""
    return by_both(_in_real_time, name)


def _in_real_time(name: str, form: str, results: Results) -> Decision | None:
    used, lasts = results.get(("cpu ms", form, name)), results.get(("duration ms", "", name))
    if used is None or lasts is None:
        return None
    n, spread = round(8 * lasts[0]), max(standard_error(used), SYSTEMATIC * float(used.mean()))
    numbers = f"{used.mean():.1f} ms of the processor for {n} samples, {lasts[0]:.2f} ms at 8 kHz"
    return Decision(negative(float(used.mean() - lasts[0]), spread), numbers)


def order_of_voices(results: Results) -> Decision | None:
    """Decide that the partial autocorrelation of the shipped voices gives order 1."""
    found = values(results, "order", VOICES[0], ""), values(results, "order", VOICES[1], "")
    if found[0] is None or found[1] is None:
        return None
    orders = [int(one[0][0]) for one in found if one]
    shares = np.mean([results["share", voice, ""] for voice in VOICES], axis=0)
    numbers = (
        f"orders {orders[0]} and {orders[1]} of at most 20; in intervals of 30 samples lag 1 is "
        f"beyond the band in {shares[0]:.0%}, lag 2 in {shares[1]:.0%}"
    )
    return Decision(orders == [1, 1], numbers)


def literal_fails(limit: float, *names: str) -> Decide:
    """Decide that the form word for word has an error above a limit, in all parts."""
    return partial(_literal_fails, limit, names)


def _literal_fails(limit: float, names: Sequence[str], results: Results) -> Decision | None:
    found = values(results, "rmse", LITERAL, *names)
    if found is None:
        return None
    holds = all_of(mean_negative(limit - one) for one in found)
    return Decision(holds, f"RMSE {named_means(names, found, 'degrees')}")
