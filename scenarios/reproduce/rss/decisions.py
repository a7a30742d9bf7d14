"""Functions that decide the claims on Table 1 and Fig. 4 of the paper on signal strength."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from arrivals.scenarios.metrics.position_errors import PositionErrors
from arrivals.scenarios.reproduce.claims import Decide, Decision, negative
from arrivals.scenarios.reproduce.rss.convergence import LocalMaxima
from arrivals.scenarios.reproduce.rss.published_values import TABLE_1
from arrivals.scenarios.reproduce.rss.timing import CYCLE, DIFFERENCES, SEARCH, Times
from arrivals.typing import Bool, Float, Int

Both: TypeAlias = tuple[Decide, Decide]  # by the paper's form, and by ours
Key: TypeAlias = tuple[str, str]  # case and method
LITERAL, OURS, ML = "vb_literal", "vb", "lm"
GROUPS = 25  # of runs, for standard errors
ONE = "K=1 prior"  # case
FEW = "after 9 cycles"  # of a method
SHOULDER_DB = 84.0
MANY_RUNS = 1000  # without a counterexample
ORDER_OF_MAGNITUDE = 5.0  # times as fast, at least
LINEAR, EXPONENTIAL = 20.0, 1000.0  # times as long for 10 times the sources: at most, at least
UNITS = {
    "amplitude_bias": "dB",
    "amplitude_rms": "dB",
    "power_std": "dB",
    "shoulder": "of all",
}  # of others m


class Table1Results(NamedTuple):
    """What the claims on Table 1 and Fig. 4 are decided by.

    Parameters
    ----------
    errors : mapping of (case, method) to PositionErrors
    power : mapping of (case, method) to ndarray
        Estimated powers of the sources, dB, (n_runs, n_sources).
    settled, converged, jumped : mapping of (case, method) to ndarray of bool
        Of each run, as in `convergence`.
    maxima : mapping of (case, method) to LocalMaxima
    times : mapping of (method, number of sources) to ndarray
        Processor times of an iteration, ms.
    """

    errors: Mapping[Key, PositionErrors]
    power: Mapping[Key, Float]
    settled: Mapping[Key, Bool]
    converged: Mapping[Key, Bool]
    jumped: Mapping[Key, Bool]
    maxima: Mapping[Key, LocalMaxima]
    times: Times


def jackknife(statistic: Callable[[Int], float], n_runs: int) -> tuple[float, float]:
    """Return a statistic of all runs, and its standard error by leaving out groups of runs.

    Parameters
    ----------
    statistic : callable
        Takes indices of runs.
    n_runs : int

    References
    ----------
    Efron, *The Jackknife, the Bootstrap and Other Resampling Plans*, 1982, ch. 3.

    Examples
    --------
    >>> mean, error = jackknife(lambda runs: float(runs.mean()), 100)
    >>> mean, round(error, 2)
    (49.5, 5.89)
    """
    rows = np.arange(n_runs)
    groups = min(GROUPS, n_runs)
    if groups < 2:
        return statistic(rows), np.nan
    left = np.array([
        statistic(np.delete(rows, part)) for part in np.array_split(rows, groups)
    ])  # fmt: skip
    spread = np.square(left - left.mean()).sum() * (groups - 1) / groups
    return statistic(rows), float(np.sqrt(spread))


def power_spread(level: Float) -> float:
    """Return the standard deviation of powers, dB, without those beyond 30 dB from the median."""
    near = level[np.abs(level - np.median(level)) < 30]
    return float(near.std())


def shoulder(level: Float) -> float:
    """Return the share of powers above 84 dB, the prior's mean and 1.3 deviations."""
    return float(np.mean(level > SHOULDER_DB))


OF_POWERS = {"power_std": power_spread, "shoulder": shoulder}


# -- accuracy -----------------------------------------------------------------------------------


def smaller(metric: str, case: str, vb_first: bool) -> Both:
    """Decide that a figure of Table 1 is smaller for VB than for ML, or the reverse."""
    pairs = [(vb, ML) if vb_first else (ML, vb) for vb in (LITERAL, OURS)]
    paper, ours = (partial(_smaller, metric, (case, a), (case, b)) for a, b in pairs)
    return paper, ours


def between_cases(metric: str, first: Key, second: Key) -> Decide:
    """Decide that a figure of Table 1 is smaller for one case and method than for another."""
    return partial(_smaller, metric, first, second)


def _smaller(metric: str, first: Key, second: Key, results: Table1Results) -> Decision | None:
    def value(key: Key, rows: Int) -> float:
        if metric in OF_POWERS:
            return OF_POWERS[metric](results.power[key][rows])
        return abs(float(getattr(results.errors[key].runs(rows).summary(), metric)))

    if first not in results.errors or second not in results.errors:
        return None
    n = min(len(results.errors[key].position) for key in (first, second))
    low, high = (value(key, np.arange(n)) for key in (first, second))
    d, error = jackknife(lambda rows: value(first, rows) - value(second, rows), n)
    unit = UNITS.get(metric, "m")
    published = [getattr(TABLE_1.get(key), metric, None) for key in (first, second)]
    paper = "" if None in published else f", paper {published[0]:g} and {published[1]:g}"
    numbers = f"{low:.3g} and {high:.3g} {unit}{paper}, difference {d:.2f} ± {error:.2f}"
    return Decision(negative(d, error), numbers)


# -- convergence --------------------------------------------------------------------------------


def share(flags: Bool) -> tuple[float, float]:
    """Return the share of runs, and its standard error.

    Examples
    --------
    >>> share(np.array([True, False] * 50))
    (0.5, 0.05)
    """
    p, n = float(flags.mean()), len(flags)
    least = min(2 / n, 0.5)  # no run of n is not never
    q = min(max(p, least), 1 - least)
    return p, float(np.sqrt(q * (1 - q) / n))


def mostly(field: str, case: str) -> Both:
    """Decide that something happens in more than half of the runs."""
    paper, ours = (partial(_mostly, field, (case, name)) for name in (LITERAL, OURS))
    return paper, ours


def always(field: str, case: str) -> Both:
    """Decide that something happens in all runs; not decided by few runs."""
    paper, ours = (partial(_always, field, (case, name)) for name in (LITERAL, OURS))
    return paper, ours


def _always(field: str, key: Key, results: Table1Results) -> Decision | None:
    flags = getattr(results, field).get(key)
    if flags is None:
        return None
    holds = False if not flags.all() else True if len(flags) >= MANY_RUNS else None
    return Decision(holds, f"{flags.mean():.1%} of the trials")


def as_good_after_few(case: str) -> Both:
    """Decide that the location error after 9 cycles is within a tenth of that after 30."""
    paper, ours = (partial(_as_good, case, name) for name in (LITERAL, OURS))
    return paper, ours


def _as_good(case: str, method: str, results: Table1Results) -> Decision | None:
    few, many = (results.errors.get((case, name)) for name in (f"{method} {FEW}", method))
    if few is None or many is None:
        return None

    def excess(rows: Int) -> float:
        return few.runs(rows).summary().location_rms - 1.1 * many.runs(rows).summary().location_rms

    d, error = jackknife(excess, len(few.position))
    here, there = (one.summary().location_rms for one in (few, many))
    ratio = f"{here / there:.2f} ± {error / there:.2f} of it"
    return Decision(negative(d, error), f"{here:.3g} and {there:.3g} m, {ratio}")


def seldom(field: str, case: str) -> Both:
    """Decide that something happens in less than a hundredth of the runs."""
    paper, ours = (partial(_seldom, field, (case, name)) for name in (LITERAL, OURS))
    return paper, ours


def mostly_by(field: str, case: str, method: str) -> Decide:
    """Decide that something happens in more than half of the runs of a method."""
    return partial(_mostly, field, (case, method))


def _mostly(field: str, key: Key, results: Table1Results) -> Decision | None:
    flags = getattr(results, field).get(key)
    if flags is None:
        return None
    p, error = share(flags)
    return Decision(negative(0.5 - p, error), f"{p:.0%} ± {error:.0%} of the trials")


def _seldom(field: str, key: Key, results: Table1Results) -> Decision | None:
    flags = getattr(results, field).get(key)
    if flags is None:
        return None
    p, error = share(flags)
    return Decision(negative(p - 0.01, error), f"{p:.1%} ± {error:.1%} of the trials")


def more_stuck(case: str) -> Both:
    """Decide that ML ends near a local maximum more often than VB."""
    paper, ours = (partial(_more_stuck, case, name) for name in (LITERAL, OURS))
    return paper, ours


def _more_stuck(case: str, method: str, results: Table1Results) -> Decision | None:
    vb, ml = (results.maxima.get((case, name)) for name in (method, ML))
    if vb is None or ml is None:
        return None
    d = vb.stuck.astype(float) - ml.stuck
    error = float(np.hypot(d.std(), 0.5 / len(d)) / np.sqrt(len(d)))
    numbers = f"{ml.stuck.mean():.0%} and {vb.stuck.mean():.0%} of the trials"
    return Decision(negative(float(d.mean()), error), numbers)


def hidden(case: str) -> Decide:
    """Decide that the goodness of fit misses most of the trials in which ML is stuck."""
    return partial(_hidden, case)


def _hidden(case: str, results: Table1Results) -> Decision | None:
    ends = results.maxima.get((case, ML))
    if ends is None or not ends.stuck.any():
        return None
    p, error = share(ends.flagged[ends.stuck])
    return Decision(negative(p - 0.5, error), f"it flags {p:.0%} ± {error:.0%} of them")


# -- time ---------------------------------------------------------------------------------------


def faster(n_sources: int) -> Both:
    """Decide that a cycle is an order of magnitude faster than an iteration of ML.

    By the paper's form ML has no analytic gradient; by ours it is Levenberg-Marquardt with one.
    """
    return (
        partial(_faster, n_sources, f"{CYCLE} {LITERAL}", DIFFERENCES),
        partial(_faster, n_sources, f"{CYCLE} {OURS}", SEARCH),
    )


def _faster(n_sources: int, vb: str, ml: str, results: Table1Results) -> Decision | None:
    times = [results.times.get((name, n_sources)) for name in (vb, ml)]
    if any(one is None for one in times):
        return None
    cycle, search = (float(np.min(one)) for one in times if one is not None)
    numbers = f"{cycle:.2g} and {search:.2g} ms: {search / cycle:.2g} times as fast"
    return Decision(search / cycle >= ORDER_OF_MAGNITUDE, numbers)


def linear() -> Both:
    """Decide that a cycle is linear in the number of sources."""
    paper, ours = (partial(_growth, f"{CYCLE} {name}", LINEAR) for name in (LITERAL, OURS))
    return paper, ours


def exponential() -> Both:
    """Decide that an iteration of ML is exponential in the number of sources."""
    paper, ours = (partial(_growth, name, EXPONENTIAL) for name in (DIFFERENCES, SEARCH))
    return paper, ours


def _growth(name: str, limit: float, results: Table1Results) -> Decision | None:
    few, many = (results.times.get((name, K)) for K in (5, 50))
    if few is None or many is None:
        return None
    ratio = float(np.min(many) / np.min(few))
    holds = ratio < limit if limit == LINEAR else ratio > limit
    return Decision(holds, f"{ratio:.2g} times as long for 10 times the sources")
