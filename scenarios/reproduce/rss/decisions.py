"""Functions that decide the claims on Table 1 and Fig. 4 of the paper on signal strength."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from arrivals.scenarios.experiments.statistics import jackknife
from arrivals.scenarios.metrics.position_errors import PositionErrors
from arrivals.scenarios.reproduce.decisions import Both, Decide, Decision, by_forms, negative
from arrivals.scenarios.reproduce.rss.convergence import LocalMaxima, ModeSteps
from arrivals.scenarios.reproduce.rss.published_values import TABLE_1
from arrivals.scenarios.reproduce.rss.timing import Times
from arrivals.typing import Bool, Float, Int

Key: TypeAlias = tuple[str, str]  # case and method
LITERAL, OURS, ML = "vb_literal", "vb", "lm"
ONE = "K=1 prior"  # case
FEW = "after 9 cycles"  # of a method
SHOULDER_DB = 84.0
UNITS = {
    "amplitude_bias": "dB",
    "amplitude_rms": "dB",
    "power_std": "dB",
    "shoulder": "%",
}  # of others m
FORMS = {LITERAL: "VB", OURS: "VB, prior fixed", ML: "ML"}  # in the line of a claim
COMPETITIVE = 1.2  # times the error of ML, at most


class Table1Results(NamedTuple):
    """What the claims on Table 1 and Fig. 4 are decided by.

    Parameters
    ----------
    errors : mapping of (case, method) to PositionErrors
    power : mapping of (case, method) to ndarray
        Estimated powers of the sources, dB, (n_runs, n_sources).
    settled, converged, diverged, unmoved : mapping of (case, method) to ndarray of bool
        Of each run, as in `convergence`; `unmoved` of ML.
    steps : mapping of (case, method) to ndarray
        Longest way of a source in one cycle, m, (n_runs,).
    maxima : mapping of (case, method) to LocalMaxima
    modes : mapping of case to ModeSteps
    times : mapping of (method, number of sources) to ndarray
        Processor times of an iteration, ms.
    """

    errors: Mapping[Key, PositionErrors]
    power: Mapping[Key, Float]
    settled: Mapping[Key, Bool]
    converged: Mapping[Key, Bool]
    diverged: Mapping[Key, Bool]
    unmoved: Mapping[Key, Bool]
    steps: Mapping[Key, Float]
    maxima: Mapping[Key, LocalMaxima]
    modes: Mapping[str, ModeSteps]
    times: Times


def power_spread(level: Float) -> float:
    """Return the standard deviation of powers, dB, without those beyond 30 dB from the median."""
    near = level[np.abs(level - np.median(level)) < 30]
    return float(near.std())


def shoulder(level: Float) -> float:
    """Return the percentage of powers above 84 dB, the prior's mean and 1.3 deviations."""
    return 100 * float(np.mean(level > SHOULDER_DB))


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
    if first not in results.errors or second not in results.errors:
        return None
    n = min(len(results.errors[key].position) for key in (first, second))
    low, high = (_figure(metric, key, results, np.arange(n)) for key in (first, second))
    d, error = jackknife(
        lambda rows: _figure(metric, first, results, rows) - _figure(metric, second, results, rows),
        n,
    )
    unit = UNITS.get(metric, "m")
    names = [FORMS[key[1]] if first[0] == second[0] else key[0] for key in (first, second)]
    published = [getattr(TABLE_1.get(key), metric, None) for key in (first, second)]
    paper = "" if None in published else (
        f"; the paper has {published[0]:g} and {published[1]:g} {unit}"
    )  # fmt: skip
    numbers = (
        f"{names[0]} {low:.3g}, {names[1]} {high:.3g} {unit}; "
        f"difference {d:.2g} ± {error:.2g} {unit}{paper}"
    )
    return Decision(negative(d, error), numbers)


def _figure(metric: str, key: Key, results: Table1Results, rows: Int) -> float:
    """Return a figure of some runs: of the powers, or of Table 1 without its sign."""
    if metric in OF_POWERS:
        return OF_POWERS[metric](results.power[key][rows])
    return abs(float(getattr(results.errors[key].runs(rows).summary(), metric)))


def competitive(case: str) -> Both:
    """Decide that the location error of VB is at most 1.2 times that of ML."""
    return by_forms((LITERAL, OURS), _competitive, case)


def _competitive(case: str, method: str, results: Table1Results) -> Decision | None:
    return at_most(COMPETITIVE, FORMS[method], (case, method), "ML", (case, ML), results)


def at_most(
    factor: float, name: str, first: Key, other: str, second: Key, results: Table1Results
) -> Decision | None:
    """Decide that one location error is at most a factor times another; None without results."""
    here, there = (results.errors.get(key) for key in (first, second))
    if here is None or there is None:
        return None

    def ratio(rows: Int) -> float:
        return here.runs(rows).summary().location_rms / there.runs(rows).summary().location_rms

    value, error = jackknife(ratio, len(here.position))
    each = [one.summary().location_rms for one in (here, there)]
    numbers = f"{name} {each[0]:.3g} m, {other} {each[1]:.3g} m: {value:.2f} ± {error:.2f} times"
    return Decision(negative(value - factor, error), numbers)
