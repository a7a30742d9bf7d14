"""Functions that decide the claims of the report, from values by metric, form, part and run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from arrivals.scenarios.reproduce.ar_kalman.experiments import INNER, LITERAL, OURS, REPORT
from arrivals.scenarios.reproduce.ar_kalman.scores import Results
from arrivals.scenarios.reproduce.claims import Decide, Decision, below, negative
from arrivals.typing import Float

Both: TypeAlias = tuple[Decide, Decide]  # by the report's form, and by ours
CONVERGED, HALF = 0.5, 2.5  # degrees; half of the initial error of moving sources
DIFFERENCE = 0.25  # of a score: smaller ones are not significant
VOICES = ("voice 1", "voice 2")


def by_both(decide: Callable[..., Decision | None], *args: Any) -> Both:
    """Return a function that decides by the report's form, and one by ours."""
    return partial(decide, REPORT, *args), partial(decide, OURS, *args)


def values(results: Results, metric: str, form: str, *names: str) -> list[Float] | None:
    """Return the runs of parts; None if one was left out or has none."""
    found = [results.get((metric, form, name)) for name in names]
    given = [one for one in found if one is not None and not np.isnan(one).any()]
    return given if len(given) == len(found) else None


def error_of(runs: Float) -> float:
    """Return the standard error of the mean; NaN for one run.

    Examples
    --------
    >>> error_of(np.array([1.0, 3.0]))
    1.0
    """
    return float(runs.std(ddof=1) / np.sqrt(len(runs))) if len(runs) > 1 else float("nan")


def under(metric: str, limit: float, *names: str, unit: str = "degrees") -> Both:
    """Decide that the mean of a score is below a limit, in the worst of the parts."""
    return by_both(_under, metric, limit, names, unit)


def _under(
    form: str, metric: str, limit: float, names: Sequence[str], unit: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, *names)
    if found is None:
        return None
    means = [float(one.mean()) for one in found]
    worst = int(np.argmax(means))
    numbers = ", ".join(f"{mean:.2g}" for mean in means) + f" ± {error_of(found[worst]):.1g} {unit}"
    return Decision(negative(means[worst] - limit, error_of(found[worst])), numbers)


def lower(metric: str, lowest: str, highest: str, unit: str = "degrees") -> Both:
    """Decide by the same runs that a score is lower in one part than in another."""
    return by_both(_lower, metric, lowest, highest, unit)


def _lower(
    form: str, metric: str, lowest: str, highest: str, unit: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, lowest, highest)
    if found is None:
        return None
    return below(np.abs(found[0]), np.abs(found[1]), unit)


def better_than(method: str, *names: str) -> Both:
    """Decide that the error of the tracker is below that of a subspace method."""
    return by_both(_better_than, method, names)


def _better_than(form: str, method: str, names: Sequence[str], results: Results) -> Decision | None:
    mine = values(results, "rmse", form, *names)
    others = values(results, "rmse", method, *names)
    if mine is None or others is None:
        return None
    n = min(map(len, others))
    ours = np.mean([one[:n] for one in mine], axis=0)
    return below(ours, np.mean([one[:n] for one in others], axis=0), "degrees")


def mainly_bias(*names: str) -> Both:
    """Decide that the bias of the directions is above the spread of their errors."""
    return by_both(_mainly_bias, names)


def _mainly_bias(form: str, names: Sequence[str], results: Results) -> Decision | None:
    bias, spread = (values(results, metric, form, *names) for metric in ("bias", "spread"))
    if bias is None or spread is None:
        return None
    size = [np.sign(one.mean()) * one for one in bias]
    decision = below(np.mean(spread, axis=0), np.mean(size, axis=0), "degrees")
    each = ", ".join(f"{one.mean():.2g}" for one in size)
    return Decision(decision.holds, f"bias {each} degrees; spread and bias {decision.numbers}")


def grows_more(low: str, high: str) -> Both:
    """Decide that the error of directions grows by a larger factor than that of AR models."""
    return by_both(_grows_more, low, high)


def _grows_more(form: str, low: str, high: str, results: Results) -> Decision | None:
    doa = values(results, "rmse", form, low, high)
    models = values(results, "ar error", form, low, high)
    if doa is None or models is None:
        return None
    return below(np.log2(models[0] / models[1]), np.log2(doa[0] / doa[1]), "octaves of the error")


def same(metric: str, name: str, other: str, unit: str = "degrees") -> Both:
    """Decide that a score differs by less than `DIFFERENCE` between two parts."""
    return by_both(_same, metric, name, other, unit)


def _same(
    form: str, metric: str, name: str, other: str, unit: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, name, other)
    if found is None:
        return None
    d, limit = found[0] - found[1], DIFFERENCE * float(found[1].mean())
    mean, error = float(d.mean()), error_of(d)
    numbers = f"{found[0].mean():.3g} and {found[1].mean():.3g} {unit}"
    return Decision(negative(abs(mean) - limit, error), f"{numbers}, difference ± {error:.1g}")


def fails(limit: float, *names: str) -> Both:
    """Decide that the error is above a limit in most runs of all parts."""
    return by_both(_fails, limit, names)


def _fails(form: str, limit: float, names: Sequence[str], results: Results) -> Decision | None:
    found = values(results, "rmse", form, *names)
    if found is None:
        return None
    failed = np.concatenate(found) > limit
    means = ", ".join(f"{one.mean():.2g}" for one in found)
    numbers = f"in {failed.mean():.0%} of the runs, RMSE {means} degrees"
    return Decision(negative(0.5 - float(failed.mean()), error_of(failed.astype(float))), numbers)


def doubles(metric: str, name: str, right: str, unit: str = "degrees") -> Both:
    """Decide by the same runs that a score of a part is more than twice that of another."""
    return by_both(_doubles, metric, name, right, unit)


def _doubles(
    form: str, metric: str, name: str, right: str, unit: str, results: Results
) -> Decision | None:
    found = values(results, metric, form, name, right)
    if found is None:
        return None
    decision = below(2 * found[1], found[0], unit)
    means = f"{found[0].mean():.3g} against {found[1].mean():.3g} {unit}"
    return Decision(decision.holds, means)


def averaging() -> Both:
    """Decide that all pairs together have a smaller spread than the inner pair alone."""
    return partial(_averaging, REPORT), partial(_averaging, OURS)


def _averaging(form: str, results: Results) -> Decision | None:
    whole = values(results, "spread", form, "M = 2")
    inner = values(results, "spread", INNER[form], "M = 2")
    return below(whole[0], inner[0], "degrees") if whole and inner else None


def in_real_time(name: str) -> Both:
    """Decide that an interval takes less processor time than it lasts."""
    return by_both(_in_real_time, name)


def _in_real_time(form: str, name: str, results: Results) -> Decision | None:
    used, lasts = results.get(("cpu ms", form, name)), results.get(("duration ms", "", name))
    if used is None or lasts is None:
        return None
    n = round(8 * lasts[0])
    numbers = f"{used[0]:.1f} ms of the processor for {n} samples, {lasts[0]:.2f} ms at 8 kHz"
    return Decision(bool(used[0] < lasts[0]), numbers)


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
    means = [float(one.mean()) for one in found]
    least = int(np.argmin(means))
    numbers = ", ".join(f"{mean:.2g}" for mean in means)
    error = error_of(found[least])
    return Decision(negative(limit - means[least], error), f"RMSE {numbers} ± {error:.1g} degrees")
