"""Decisions on claims by the runs of a study, and the numbers that a reader sees."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.typing import Bool, Float

WORDS = {True: "holds", False: "does not hold", None: "not decided"}


class Decision(NamedTuple):
    """Whether a claim holds, and the numbers that decide it.

    Parameters
    ----------
    holds : bool or None
        None where the runs do not decide it.
    numbers : str
        The numbers, with their units.
    """

    holds: bool | None
    numbers: str


Decide: TypeAlias = Callable[[Any], Decision | None]
Both: TypeAlias = tuple[Decide, Decide]  # by the paper's form, and by ours


def by_forms(
    forms: tuple[str, str], decide: Callable[..., Decision | None], *args: Any, **options: Any
) -> Both:
    """Return `decide(*args, form, results, **options)` for the paper's form, and for ours."""
    paper, ours = (partial(decide, *args, form, **options) for form in forms)
    return paper, ours


def negative(mean: float, error: float) -> bool | None:
    """Return True if a mean is below zero, None if it is within two standard errors of zero.

    Examples
    --------
    >>> negative(-1.0, 0.1), negative(-0.1, 0.1), negative(-1.0, float("nan"))
    (True, None, None)
    """
    return mean < 0 if abs(mean) > 2 * error else None


def mean_negative(values: Float) -> bool | None:
    """Return `negative` of the mean of runs.

    Examples
    --------
    >>> mean_negative(np.array([-1.0, -1.2])), mean_negative(np.array([-1.0]))
    (True, None)
    """
    return negative(float(values.mean()), standard_error(values))


def all_of(decisions: Iterable[bool | None]) -> bool | None:
    """Return True if all hold, False if one does not, else None.

    Examples
    --------
    >>> all_of([True, None]), all_of([None, False])
    (None, False)
    """
    found = set(decisions)
    return False if False in found else None if None in found else True


def below(
    lower: ArrayLike, higher: ArrayLike, unit: str = "", names: tuple[str, str] | None = None
) -> Decision:
    """Decide by paired runs that one figure is below another.

    Parameters
    ----------
    lower, higher : array_like, shape (n_runs,)
    unit : str
        Unit of the figures.
    names : tuple of two str, optional
        Names of the figures in the numbers.

    Examples
    --------
    >>> below([1.0, 1.2, 1.1], [2.0, 2.1, 2.3])
    Decision(holds=True, numbers='1.1 and 2.13, paired difference -1.03 ± 0.09')
    >>> below([1.0, 1.2], [2.0, 2.1], "m", ("VB", "ML")).numbers
    'VB: 1.1; ML: 2.05 m, paired difference -0.95 ± 0.05'
    """
    first, second = np.asarray(lower, dtype=float), np.asarray(higher, dtype=float)
    means = f"{first.mean():.3g} and {second.mean():.3g}"
    if names is not None:
        means = f"{names[0]}: {first.mean():.3g}; {names[1]}: {second.mean():.3g}"
    of = f" {unit}" if unit else ""
    d = first - second
    return Decision(mean_negative(d), f"{means}{of}, {difference(d)}")


def difference(d: Float) -> str:
    """Return the mean of paired differences with its standard error.

    Examples
    --------
    >>> difference(np.array([1.0, 3.0]))
    'paired difference 2.00 ± 1.00'
    """
    if len(d) < 2:
        return "one run"
    return f"paired difference {d.mean():.2f} ± {standard_error(d):.2f}"


def share(flags: Bool) -> tuple[float, float]:
    """Return the share of runs in which something is true, and its standard error.

    None of n runs is taken for two of them in the error.

    Examples
    --------
    >>> share(np.array([True, False] * 50))
    (0.5, 0.05)
    """
    p, n = float(flags.mean()), len(flags)
    least = min(2 / n, 0.5)
    q = min(max(p, least), 1 - least)
    return p, float(np.sqrt(q * (1 - q) / n))
