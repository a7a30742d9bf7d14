"""Statistics over the runs of a study: standard errors, intervals and paired differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from arrivals.typing import Float, Int
from arrivals.validation import LARGEST, SMALLEST, number, real

GROUPS = 25  # of runs, for the jackknife


class Difference(NamedTuple):
    """Paired difference of two methods over runs.

    Parameters
    ----------
    mean, error : float
        Mean of the difference and its standard error.
    n_below, n_runs : int
        Number of runs with a difference below 0, and of all runs.
    """

    mean: float
    error: float
    n_below: int
    n_runs: int


def paired_difference(first: Mapping[int, float], second: Mapping[int, float]) -> Difference:
    """Return first minus second over the runs that both have.

    Examples
    --------
    >>> paired_difference({0: 1.0, 1: 2.0}, {0: 2.0, 1: 4.0, 2: 0.0})
    Difference(mean=-1.5, error=0.5, n_below=2, n_runs=2)
    """
    d = np.array([first[run] - second[run] for run in first if run in second], dtype=np.float64)
    n = len(d)
    mean = float(d.mean()) if n else np.nan
    return Difference(mean, standard_error(d), int((d < 0).sum()), n)


def standard_error(values: Float) -> float:
    """Return the standard error of the mean; NaN for fewer than two values.

    Examples
    --------
    >>> standard_error(np.array([1.0, 3.0]))
    1.0
    """
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else np.nan


def bootstrap_interval(values: Float, level: float = 0.95) -> tuple[float, float]:
    """Return the bias-corrected and accelerated bootstrap interval of the mean.

    2000 resamples with a fixed seed; NaN for fewer than two values, or one that is not finite.

    References
    ----------
    Efron and Tibshirani, *An Introduction to the Bootstrap*, 1993, ch. 14.

    Examples
    --------
    >>> bootstrap_interval(np.array([2.0, 2.0]))
    (2.0, 2.0)
    """
    from scipy.stats import bootstrap

    values = real("values", values).ravel()
    if not 0 < number("level", level) < 1:
        raise ValueError(f"level must lie in (0, 1); got {level}")
    if values.size < 2 or not (np.abs(values) < LARGEST).all():
        return np.nan, np.nan
    if np.ptp(values) < SMALLEST:
        return float(values[0]), float(values[0])
    interval = bootstrap(
        (values,), np.mean, n_resamples=2000, confidence_level=level,
        rng=np.random.default_rng(0),
    ).confidence_interval  # fmt: skip
    return float(interval.low), float(interval.high)


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
