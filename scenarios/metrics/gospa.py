"""Metrics between two sets of points of any size: GOSPA, OSPA and RMSE."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.scenarios.metrics.distances import Distance, assigned, distances
from arrivals.typing import Float
from arrivals.validation import items, number, positive


@dataclass(frozen=True)
class Gospa:
    """GOSPA metric and its three parts.

    Parameters
    ----------
    total : float
        The metric, in the unit of the points.
    distance, missed, false : float
        Parts due to errors of detected points, missed points and false points. They are p-th
        powers: total^p = distance + missed + false; for p = 1 they have the unit of the points.

    Examples
    --------
    >>> gospa([10, 20, 40], [11, 26, 70], c=10).missed
    5.0
    """

    total: float
    distance: float
    missed: float
    false: float


def gospa(
    truth: ArrayLike,
    estimate: ArrayLike,
    c: float,
    p: float = 1.0,
    alpha: float = 2.0,
    period: float | None = None,
    distance: Distance = "euclidean",
) -> Gospa:
    """Compute the generalised optimal sub-pattern assignment metric: errors, missed and false.

    Parameters
    ----------
    truth, estimate : array_like, shape (n,) or (n, dim)
        True and estimated angles or points, in any unit. Rows with a NaN are ignored.
    c : float
        Cut-off, same unit: a true and an estimated point at distance `c` or more are not paired.
    p : float
        Exponent, at least 1.
    alpha : float
        In (0, 2]: an unpaired point costs c^p / α. For 2, a distant pair costs as much as two
        unpaired points; below, a pair beyond the cut-off costs c^p, half missed and half false.
    period : float, optional
        Period of the angles, such as 2π for rad; differences are wrapped.
    distance : {"euclidean", "great_circle"}
        Great circles are between points (n, 2) of azimuth and elevation; `period` is required then,
        as the full turn: 360, or 2π for rad.

    Returns
    -------
    Gospa
        The metric and its parts.

    Raises
    ------
    ValueError
        If dimensions differ, a point is infinite, or `c`, `p`, `alpha`, `period` are out of range.

    References
    ----------
    Rahmathullah, García-Fernández and Svensson, "Generalized optimal sub-pattern assignment
    metric", FUSION 2017, definition 1 and proposition 1.

    Examples
    --------
    10 is estimated as 11 and 20 as 26; 40 is missed, and 70 is false.

    >>> gospa([10, 20, 40], [11, 26, 70], c=10)
    Gospa(total=17.0, distance=7.0, missed=5.0, false=5.0)
    >>> gospa([10, 20, 40], [], c=10).total, gospa([], [1, 2], c=10).total
    (15.0, 10.0)
    >>> gospa([-179], [178], c=10, period=360).distance
    3.0

    Azimuths 90 degrees apart are 7 degrees apart near the zenith.

    >>> sphere = {"period": 360, "distance": "great_circle"}
    >>> round(gospa([[0, 85]], [[90, 85]], c=10, **sphere).distance, 2)
    7.07
    """
    p = _exponent(p, c := positive("c", c))
    if not positive("alpha", alpha) <= 2:
        raise ValueError(f"alpha must lie in (0, 2]; got {alpha}")
    d = distances(truth, estimate, period, distance)
    pairs = assigned(d, c, p)
    near = pairs[pairs < c]
    n_cut, surplus, detected = len(pairs) - len(near), len(d) - d.shape[1], float((near**p).sum())
    missed = float(c**p * (n_cut / 2 + max(surplus, 0) / alpha))
    false = float(c**p * (n_cut / 2 + max(-surplus, 0) / alpha))
    return Gospa((detected + missed + false) ** (1 / p), detected, missed, false)


def ospa(
    truth: ArrayLike,
    estimate: ArrayLike,
    c: float,
    p: float = 1.0,
    period: float | None = None,
    distance: Distance = "euclidean",
) -> float:
    """Compute the OSPA metric: the error per point; an unpaired point counts as `c`.

    Parameters
    ----------
    truth, estimate : array_like, shape (n,) or (n, dim)
        True and estimated angles or points, in any unit. Rows with a NaN are ignored.
    c : float
        Cut-off, same unit.
    p : float
        Exponent, at least 1.
    period : float, optional
        Period of the angles; differences are wrapped.
    distance : {"euclidean", "great_circle"}
        As in `gospa`.

    Returns
    -------
    float
        The metric, in [0, c]; 0 for two empty sets.

    Raises
    ------
    ValueError
        If dimensions differ, a point is infinite, or `c`, `p`, `period` are out of range.

    References
    ----------
    Schuhmacher, Vo and Vo, "A consistent metric for performance evaluation of multi-object
    filters", IEEE Trans. Signal Process. 56, 2008, (3).

    Examples
    --------
    >>> ospa([10, 20], [12], c=10)
    6.0
    """
    d, p = distances(truth, estimate, period, distance), _exponent(p, c := positive("c", c))
    size, surplus = max(d.shape), abs(d.shape[0] - d.shape[1])
    powers = np.sum(np.minimum(assigned(d, c, p), c) ** p) + c**p * surplus
    return float((powers / size) ** (1 / p)) if size else 0.0  # (3)


def rmse(
    truth: ArrayLike,
    estimate: ArrayLike,
    c: float,
    period: float | None = None,
    distance: Distance = "euclidean",
) -> float:
    """Compute the RMSE per true point: a missed point counts as `c`, false points as zero.

    Parameters
    ----------
    truth, estimate : array_like, shape (n,) or (n, dim)
        True and estimated angles or points, in any unit. Rows with a NaN are ignored.
    c : float
        Cut-off, same unit.
    period : float, optional
        Period of the angles; differences are wrapped.
    distance : {"euclidean", "great_circle"}
        As in `gospa`.

    Returns
    -------
    float
        Root mean square error, in [0, c]; 0 for an empty truth.

    Raises
    ------
    ValueError
        If dimensions differ, a point is infinite, or `c` or `period` is not positive.

    Examples
    --------
    >>> round(rmse([10, 20, 40], [11, 26, 70], c=10), 3)
    6.758
    >>> rmse([10, 20, 40], [], c=10), rmse([], [1, 2], c=10)
    (10.0, 0.0)
    """
    c, d = positive("c", c), distances(truth, estimate, period, distance)
    if not len(d):
        return 0.0
    pairs = np.minimum(assigned(d, c, 2.0), c)
    return float(np.sqrt((np.sum(pairs**2) + c**2 * (len(d) - len(pairs))) / len(d)))  # (74)


def mean_gospa(
    truth: Sequence[ArrayLike] | Float,
    estimate: Sequence[ArrayLike] | Float,
    c: float,
    p: float = 1.0,
    alpha: float = 2.0,
    period: float | None = None,
    distance: Distance = "euclidean",
) -> Gospa:
    """Average GOSPA and its parts over time steps.

    Parameters
    ----------
    truth, estimate : array_like, shape (n_steps, n_slots) or (n_steps, n_slots, dim)
        One set in each step, padded with NaN, or lists of sets of different sizes.
    c, p, alpha : float
        As in `gospa`.
    period : float, optional
        As in `gospa`.
    distance : {"euclidean", "great_circle"}
        As in `gospa`.

    Returns
    -------
    Gospa
        Means of `total`, `distance`, `missed` and `false`, each over the steps.

    Raises
    ------
    ValueError
        If the numbers of steps differ or are zero; further as in `gospa`.

    Examples
    --------
    >>> mean_gospa([[0, 50], [1, np.nan]], [[2, np.nan], [1, np.nan]], c=10)
    Gospa(total=3.5, distance=1.0, missed=2.5, false=0.0)
    """
    steps = [gospa(t, f, c, p, alpha, period, distance) for t, f in _steps(truth, estimate)]
    return Gospa(*np.mean([astuple(step) for step in steps], axis=0).tolist())


def mean_rmse(
    truth: Sequence[ArrayLike] | Float,
    estimate: Sequence[ArrayLike] | Float,
    c: float,
    period: float | None = None,
    distance: Distance = "euclidean",
) -> float:
    """Average the root mean square errors of time steps.

    Parameters
    ----------
    truth, estimate : array_like, shape (n_steps, n_slots) or (n_steps, n_slots, dim)
        One set in each step, padded with NaN, or lists of sets of different sizes.
    c : float
        As in `rmse`.
    period : float, optional
        As in `rmse`.
    distance : {"euclidean", "great_circle"}
        As in `gospa`.

    Returns
    -------
    float
        Mean over the steps; a step with an empty truth counts as 0.

    Raises
    ------
    ValueError
        If the numbers of steps differ or are zero; further as in `rmse`.

    Examples
    --------
    >>> mean_rmse([[0], [1]], [[2], [np.nan]], c=10)
    6.0
    """
    return float(np.mean([rmse(t, f, c, period, distance) for t, f in _steps(truth, estimate)]))


def _exponent(p: float, c: float) -> float:
    """Return an exponent for which c^p is finite and not zero."""
    if not (1 <= number("p", p) < np.inf and abs(p * math.log10(c)) < 150):
        cure = "c^p must be from 1e-150 to 1e150"
        raise ValueError(f"p must be finite and at least 1; got {p}: {cure}")
    return float(p)


def _steps(
    truth: Sequence[ArrayLike] | Float, estimate: Sequence[ArrayLike] | Float
) -> list[tuple[ArrayLike, ArrayLike]]:
    truth, estimate = items("truth", truth), items("estimate", estimate)
    if len(truth) != len(estimate) or len(truth) == 0:
        got = f"{len(truth)} and {len(estimate)}"
        raise ValueError(f"truth and estimate must have the same number of steps, >= 1; got {got}")
    return list(zip(truth, estimate, strict=True))
