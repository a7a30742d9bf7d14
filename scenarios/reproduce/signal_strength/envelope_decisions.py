"""Functions that decide the claims on the statistic of signal strength."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from arrivals.scenarios.experiments.statistics import jackknife, standard_error
from arrivals.scenarios.reproduce.claims import Claim
from arrivals.scenarios.reproduce.decisions import Decide, Decision, below, negative
from arrivals.scenarios.reproduce.signal_strength.drive_by import EnvelopeLaw
from arrivals.scenarios.reproduce.signal_strength.range_estimates import Errors
from arrivals.typing import Float, Int

NUMBERS = (10, 50, 100)  # of snapshots
SIGNIFICANCE = 0.01
ACCURATE = 0.05  # distance of distribution functions


class EnvelopeResults(NamedTuple):
    """What the claims on the statistic are decided by.

    Parameters
    ----------
    ranges, positions : mapping of (form, number of snapshots) to Errors
        By one sensor, and by a network.
    bounds : mapping of int to ndarray
        Cramér-Rao bounds of the positions, m, by number of snapshots.
    distances : mapping of (form, number of snapshots) to float
        Between the distribution functions of the form and of the statistic.
    law : EnvelopeLaw
        Of the synthetic sound.
    detected : tuple of three float
        Probability of detection by the formula, by simulation, and its standard error.
    """

    ranges: Mapping[tuple[str, int], Errors]
    positions: Mapping[tuple[str, int], Errors]
    bounds: Mapping[int, Float]
    distances: Mapping[tuple[str, int], float]
    law: EnvelopeLaw
    detected: tuple[float, float, float]


def accurate(form: str, n_snapshots: int) -> Decide:
    """Decide that a form's distribution function differs by at most 0.05."""
    return partial(_accurate, form, n_snapshots)


def _accurate(form: str, n_snapshots: int, results: EnvelopeResults) -> Decision:
    distance = results.distances[form, n_snapshots]
    return Decision(distance <= ACCURATE, f"largest difference {distance:.3f}")


def less_biased(form: str, other: str, n_snapshots: int) -> Decide:
    """Decide that the range by one form has a smaller bias than that by another."""
    return partial(_less_biased, form, other, n_snapshots)


def _less_biased(form: str, other: str, N: int, results: EnvelopeResults) -> Decision:
    first, second = (100 * results.ranges[name, N].error for name in (form, other))
    d = np.sign(first.mean()) * first - np.sign(second.mean()) * second
    error = standard_error(d)
    numbers = (
        f"{form} {first.mean():.2f} %, {other} {second.mean():.2f} %; "
        f"difference {d.mean():.3f} ± {error:.3f} %"
    )
    return Decision(negative(float(d.mean()), error), numbers)


def nearer(form: str, other: str, n_snapshots: int) -> Decide:
    """Decide that positions by one form have smaller errors than those by another."""
    return partial(_nearer, form, other, n_snapshots)


def _nearer(form: str, other: str, N: int, results: EnvelopeResults) -> Decision:
    first, second = (
        np.linalg.norm(results.positions[name, N].error, axis=1) for name in (form, other)
    )
    holds, numbers = below(first, second, "m")
    return Decision(holds, f"mean distance, {form} and {other}: {numbers}")


def normalised_square(errors: Errors) -> float:
    """Return the mean square of the errors in units of their stated deviations; 1 if these fit."""
    return float(np.mean((errors.error / errors.stated) ** 2))


def better_stated(form: str, other: str, n_snapshots: int) -> Decide:
    """Decide that one form states the errors of positions better than another."""
    return partial(_better_stated, form, other, n_snapshots)


def _better_stated(form: str, other: str, N: int, results: EnvelopeResults) -> Decision:
    both = [results.positions[name, N] for name in (form, other)]

    def off(rows: Int) -> float:
        one, two = (
            abs(np.log(normalised_square(Errors(e.error[rows], e.stated[rows])))) for e in both
        )
        return float(one - two)

    d, error = jackknife(off, len(both[0].error))
    squares = [f"{normalised_square(one):.2g}" for one in both]
    numbers = (
        f"mean square of the errors over the stated one: {form} {squares[0]}, {other} "
        f"{squares[1]}; 1 if true"
    )
    return Decision(negative(d, error), numbers)


def gaussian(results: EnvelopeResults) -> Decision:
    """Decide that the envelope is circular Gaussian."""
    p, q = results.law.p_gaussian, results.law.p_circular
    return Decision(
        min(p, q) > SIGNIFICANCE,
        f"probability of such a deviation from a Gaussian {p:.2f}, from circular "
        f"{q:.2f}; below 0.01 it is rejected",
    )


def uncorrelated(results: EnvelopeResults) -> Decision:
    """Decide that envelope samples 15 ms apart are uncorrelated."""
    p, one = results.law.p_uncorrelated, results.law.correlation[1]
    numbers = (
        f"probability of such a correlation {p:.2f}, below 0.01 it is rejected; correlation of "
        f"adjacent segments, 2.5 ms apart, {one:.2f}"
    )
    return Decision(p > SIGNIFICANCE, numbers)


def near_bound(form: str, n_snapshots: int) -> Decide:
    """Decide that the error of positions is within a tenth of the bound."""
    return partial(_near_bound, form, n_snapshots)


def _near_bound(form: str, N: int, results: EnvelopeResults) -> Decision:
    e, bound = results.positions[form, N].error, results.bounds[N]

    def excess(rows: Int) -> float:
        rms = np.sqrt(np.square(e[rows]).sum(axis=1).mean())
        return float(rms / np.sqrt(np.square(bound[rows]).mean()))

    ratio, error = jackknife(excess, len(bound))
    return Decision(negative(ratio - 1.1, error), f"{ratio:.3f} ± {error:.3f} times the bound")


def formula(results: EnvelopeResults) -> Decision:
    """Decide that the simulated probability of detection is that of the formula."""
    exact, found, error = results.detected
    return Decision(
        abs(exact - found) < 3 * error, f"formula {exact:.4f}, simulated {found:.4f} ± {error:.4f}"
    )


CLAIMS: tuple[Claim, ...] = (
    Claim("rss-envelope", "", "the exact probability of detection is the simulated one", None,
          formula, "check"),
    Claim("rss-envelope", "", "the error of positions of the log-Gaussian form is within a tenth "
          "of the Cramér-Rao bound, N = 50", None,
          near_bound("log-Gaussian (the paper)", 50), "ours"),
)  # fmt: skip
