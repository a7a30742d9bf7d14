"""Functions that decide the claims on computation: by processor time and by operations."""

from __future__ import annotations

from functools import partial

import numpy as np

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.reproduce.decisions import Both, Decision, by_forms, negative
from arrivals.scenarios.reproduce.rss.decisions import LITERAL, OURS, Table1Results
from arrivals.scenarios.reproduce.rss.operations import cycle_operations, search_operations
from arrivals.scenarios.reproduce.rss.timing import CYCLE, DIFFERENCES, N_SENSORS, SEARCH
from arrivals.typing import Float

ORDER_OF_MAGNITUDE, SIGNIFICANT = 5.0, 2.0  # times as fast, at least
LINEAR, EXPONENTIAL = 20.0, 1000.0  # times as long for 10 times the sources: at most, at least
FEW_SOURCES, MANY_SOURCES = 5, 50


def faster(n_sources: int, least: float) -> Both:
    """Decide that a cycle is faster than an iteration of ML by a factor, in time and operations.

    By the paper's form ML has no analytic gradient; by ours it is Levenberg-Marquardt with one.
    """
    return (
        partial(_faster, n_sources, least, f"{CYCLE} {LITERAL}", DIFFERENCES),
        partial(_faster, n_sources, least, f"{CYCLE} {OURS}", SEARCH),
    )


def _faster(
    n_sources: int, least: float, vb: str, ml: str, results: Table1Results
) -> Decision | None:
    times = [results.times.get((name, n_sources)) for name in (vb, ml)]
    cycle, search = times
    if cycle is None or search is None:
        return None
    count = [operations(name, n_sources) for name in (vb, ml)]
    ratio, error = log_ratio(search, cycle)
    numbers = (
        f"times: VB {cycle.mean():.2g} ms, ML {search.mean():.2g} ms, {_times(ratio, error)} as "
        f"fast; operations: VB {count[0]:.2g}, ML {count[1]:.2g}, {count[1] / count[0]:.2g} times "
        "as few"
    )
    by_time = negative(float(np.log(least)) - ratio, error)
    return Decision(_both(by_time, count[1] >= least * count[0]), numbers)


def linear() -> Both:
    """Decide that a cycle is linear in the number of sources."""
    return by_forms((f"{CYCLE} {LITERAL}", f"{CYCLE} {OURS}"), _growth, LINEAR)


def exponential() -> Both:
    """Decide that an iteration of ML is exponential in the number of sources."""
    return by_forms((DIFFERENCES, SEARCH), _growth, EXPONENTIAL)


def _growth(limit: float, name: str, results: Table1Results) -> Decision | None:
    few, many = (results.times.get((name, K)) for K in (FEW_SOURCES, MANY_SOURCES))
    if few is None or many is None:
        return None
    count = operations(name, MANY_SOURCES) / operations(name, FEW_SOURCES)
    ratio, error = log_ratio(many, few)
    numbers = (
        f"{_times(ratio, error)} as long and {count:.2g} times as many operations for "
        f"K = {MANY_SOURCES} as for K = {FEW_SOURCES}"
    )
    less = negative(ratio - float(np.log(limit)), error)
    if limit == LINEAR:
        return Decision(_both(less, count < limit), numbers)
    return Decision(_both(None if less is None else not less, count > limit), numbers)


def operations(name: str, n_sources: int) -> int:
    """Return the operations of an iteration of a timed method.

    Examples
    --------
    >>> operations(SEARCH, 1) < operations(DIFFERENCES, 1)
    True
    """
    if name.startswith(CYCLE):
        return cycle_operations(n_sources, N_SENSORS)
    return search_operations(n_sources, N_SENSORS, differences=name == DIFFERENCES)


def log_ratio(first: Float, second: Float) -> tuple[float, float]:
    """Return the mean logarithm of the ratio of times, and its standard error; NaN of one.

    Examples
    --------
    >>> log_ratio(np.array([2.0, 2.0]), np.array([1.0, 1.0]))[1]
    0.0
    """
    d = np.log(first / second)
    return float(d.mean()), standard_error(d)


def _times(ratio: float, error: float) -> str:
    value = float(np.exp(ratio))
    return f"{value:.2g} ± {value * error:.1g} times"


def _both(by_time: bool | None, by_operations: bool) -> bool | None:
    """Return the verdict of time and operations; None where they differ."""
    return by_time if by_time == by_operations else None
