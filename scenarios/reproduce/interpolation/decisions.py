"""Functions that decide the claims on the interpolation-delay filter, from values of every trial.

Directions and errors are in degrees.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.decisions import (
    Decision,
    all_of,
    difference,
    mean_negative,
    negative,
    share,
)
from arrivals.typing import Float

# Values of the trials by the study's case, such as (source, method, direction)
Results: TypeAlias = Mapping[tuple[Any, ...], Float]
LARGEST = 1.93  # largest error of a mean in the paper's table, degrees
CLOSE = 1.25  # ratio of variances that are "very close"
CUT_OFF = 10.0  # degrees, of errors that are compared by their mean square
NEAR = 2.0  # errors of estimates that have converged, degrees
SAME = 0.5  # difference of means that agree, degrees
ENOUGH = 30  # equal estimates of every case that count as zero variance


# -- Table 1: results by (source, method, direction) -------------------------------------------


def ends_of(results: Results, source: str, method: str) -> dict[float, Float]:
    """Return the final directions of a method by the true one."""
    return {key[2]: ends for key, ends in results.items() if key[:2] == (source, method)}


def accurate(method: str, results: Results, *, source: str) -> Decision | None:
    """Decide that the means of all directions are within the paper's largest error."""
    ends = ends_of(results, source, method)
    if not ends:
        return None
    bias = {doa: float(each.mean()) - doa for doa, each in ends.items()}
    error = {doa: standard_error(each) for doa, each in ends.items()}
    worst = max(bias, key=lambda doa: abs(bias[doa]))
    holds = all_of(negative(abs(bias[doa]) - LARGEST, error[doa]) for doa in ends)
    numbers = f"{method}: error {bias[worst]:+.2f} ± {error[worst]:.2f} degrees at {worst:g}"
    return Decision(holds, numbers)


def squares(results: Results, source: str, method: str) -> Float | None:
    """Return the squared deviations from the mean of each trial, averaged over directions."""
    ends = ends_of(results, source, method)
    if not ends:
        return None
    each = [(values - values.mean()) ** 2 for values in ends.values()]
    return np.asarray(np.mean(each, axis=0) * len(each[0]) / (len(each[0]) - 1))


def lower_variance(
    method: str, results: Results, *, source: str, than: str, factor: float = 1.0
) -> Decision | None:
    """Decide that the variance, mean of all directions, is below `factor` times another one."""
    first, second = (squares(results, source, name) for name in (method, than))
    if first is None or second is None:
        return None
    d = first - factor * second
    numbers = f"{method} {first.mean():.3g}, {than} {second.mean():.3g} degrees²"
    return Decision(mean_negative(d), numbers)


def zero_variance(method: str, results: Results, *, cases: Iterable[Any] = ()) -> Decision | None:
    """Decide that all estimates of a method are equal, in all its cases or in some of a tone.

    Fewer than `ENOUGH` equal estimates of a case do not decide.
    """
    wanted = set(cases)
    mine = [
        values for (source, name, doa), values in results.items()
        if name == method and (not wanted or (source == "tone" and doa in wanted))
    ]  # fmt: skip
    return _all_equal(method, mine)


def zero_variance_by_snr(method: str, results: Results) -> Decision | None:
    """Decide that all errors of a method are equal at every SNR of Fig. 8."""
    mine = [values for key, values in results.items() if (key[0], key[2]) == ("fig8", method)]
    return _all_equal(method, mine)


def _all_equal(method: str, cases: Sequence[Float]) -> Decision | None:
    if not cases:
        return None
    zero = [bool(np.ptp(values) < 1e-9) for values in cases]
    highest = 0.0 if all(zero) else max(float(values.var(ddof=1)) for values in cases)
    numbers = f"{method}: zero in {sum(zero)} of {len(zero)} cases, at most {highest:.2g} degrees²"
    enough = min(map(len, cases)) >= ENOUGH
    return Decision((True if enough else None) if all(zero) else False, numbers)


def percentage_within(
    method: str, results: Results, *, source: str, low: float, high: float
) -> Decision | None:
    """Decide that the errors of the means, percent of the direction, are within a range."""
    ends = ends_of(results, source, method)
    if not ends:
        return None
    percent = [100 * (float(each.mean()) / doa - 1) for doa, each in ends.items()]
    error = [100 * standard_error(each) / doa for doa, each in ends.items()]
    holds = all_of(_within(p, e, low, high) for p, e in zip(percent, error, strict=True))
    return Decision(holds, f"{method} {min(percent):.2f} to {max(percent):.2f} %")


def variances_within(
    method: str, results: Results, *, source: str, low: float, high: float
) -> Decision | None:
    """Decide that the variances of all directions are within a range."""
    ends = ends_of(results, source, method)
    if not ends:
        return None
    variances = [float(each.var(ddof=1)) for each in ends.values()]
    # the larger one of the error for normal estimates and that of their squared deviations
    errors = [
        max(v * np.sqrt(2 / (len(each) - 1)), standard_error((each - each.mean()) ** 2))
        for v, each in zip(variances, ends.values(), strict=True)
    ]
    holds = all_of(_within(v, e, low, high) for v, e in zip(variances, errors, strict=True))
    return Decision(holds, f"{method} {min(variances):.3g} to {max(variances):.3g} degrees²")


def _within(value: float, error: float, low: float, high: float) -> bool | None:
    return all_of((negative(low - value, error), negative(value - high, error)))


def published_means(
    method: str, results: Results, *, published: Sequence[tuple[float, float]], source: str
) -> Decision | None:
    """Decide that the paper's means and those of a source differ by less than `SAME`."""
    ends = ends_of(results, source, method)
    if not ends:
        return None
    off, errors = [], []
    for (mean, variance), each in zip(published, ends.values(), strict=False):
        errors.append(float(np.sqrt(variance / 100 + each.var(ddof=1) / len(each))))  # 100 runs
        off.append(mean - float(each.mean()))
    holds = all_of(negative(abs(d) - SAME, e) for d, e in zip(off, errors, strict=True))
    means = ", ".join(f"{d:+.2f}" for d in off)
    return Decision(holds, f"{method}: printed minus found {means} degrees")


def smaller_at_75(method: str, results: Results, *, source: str) -> Decision | None:
    """Decide that the variance at 75 degrees is below that at 15."""
    ends = ends_of(results, source, method)
    if not {15.0, 75.0} <= set(ends):
        return None
    first, second = ((ends[doa] - ends[doa].mean()) ** 2 for doa in (75.0, 15.0))
    numbers = f"{method} {first.mean():.3g} at 75 and {second.mean():.3g} degrees² at 15"
    return Decision(mean_negative(first - second), f"{numbers}, {difference(first - second)}")


# -- Figs 2 to 8: errors by (figure's case, method, ...) ---------------------------------------


def converges(method: str, results: Results, *, doa: float, snr_db: float) -> Decision | None:
    """Decide that most trials end near the truth."""
    return mostly_near(method, results, key=("end", doa, snr_db), limit=NEAR, unit="degrees")


def mostly_near(
    method: str, results: Results, *, key: tuple[Any, ...], limit: float, unit: str
) -> Decision | None:
    """Decide that more than half of the errors are below a limit."""
    errors = results.get((*key, method))
    if errors is None:
        return None
    near, spread = share(np.abs(errors) < limit)
    median = f"median error {np.median(np.abs(errors)):.2g} {unit}".rstrip()
    return Decision(negative(0.5 - near, spread), f"{method} {near:.0%} of the trials, {median}")


def smaller(
    method: str, results: Results, *, than: str, cases: Sequence[tuple[Any, ...]], unit: str
) -> Decision | None:
    """Decide that a figure of a method, mean of several cases, is below that of another one."""
    found = [[results.get((*case, name)) for case in cases] for name in (method, than)]
    first, second = ([each for each in one if each is not None] for one in found)
    if not len(first) == len(second) == len(cases):
        return None
    mine, others = np.mean(first, axis=0), np.mean(second, axis=0)
    numbers = f"{method} {mine.mean():.3g}, {than} {others.mean():.3g} {unit}"
    return Decision(mean_negative(mine - others), f"{numbers}, {difference(mine - others)}")


def rms_below(
    method: str, results: Results, *, than: str, cases: Sequence[tuple[Any, ...]]
) -> Decision | None:
    """Decide that a mean square error, mean of several cases, is below that of another method.

    Errors are cut off at `CUT_OFF`: else the few trials of scans that take a side lobe decide.
    """
    first, second = (_squares_of(results, name, cases, False) for name in (method, than))
    if first is None or second is None:
        return None
    d = first - second
    rms = [float(np.sqrt(np.mean(each))) for each in (first, second)]
    numbers = f"{method} {rms[0]:.3g}, {than} {rms[1]:.3g} degrees"
    return Decision(mean_negative(d), numbers)


def variance_below(
    method: str,
    results: Results,
    *,
    than: str,
    cases: Sequence[tuple[Any, ...]],
    factor: float = 1.0,
) -> Decision | None:
    """Decide that a variance, mean of several cases, is below `factor` times another one.

    Deviations from the mean are cut off at `CUT_OFF`.
    """
    first, second = (_squares_of(results, name, cases, True) for name in (method, than))
    if first is None or second is None:
        return None
    d = first - factor * second
    numbers = f"{method} {first.mean():.3g}, {than} {second.mean():.3g} degrees²"
    return Decision(mean_negative(d), numbers)


def _squares_of(
    results: Results, method: str, cases: Sequence[tuple[Any, ...]], centred: bool
) -> Float | None:
    """Return the squared errors of each trial, or deviations from the mean, averaged over cases."""
    found = [results.get((*case, method)) for case in cases]
    off = [each - centred * each.mean() for each in found if each is not None]
    if not off or len(off) < len(cases):
        return None
    return np.asarray(np.mean([np.minimum(np.abs(each), CUT_OFF) ** 2 for each in off], axis=0))


def near_bound(
    method: str, results: Results, *, cases: Sequence[tuple[Any, ...]]
) -> Decision | None:
    """Decide that the mean square error is at most `CLOSE` times the square of the bound."""
    if not all((*case, method) in results for case in cases):
        return None
    ratio = np.mean([(results[(*c, method)] / results[(*c, "CRB")]) ** 2 for c in cases], axis=0)
    error = standard_error(ratio)
    numbers = f"{ratio.mean():.2f} ± {error:.2f} times that of the bound"
    return Decision(mean_negative(ratio - CLOSE), numbers)
