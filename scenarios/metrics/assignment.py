"""Assignment of estimates to true sources, label switches and track lengths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.scenarios.metrics.distances import Distance, tangent_errors
from arrivals.typing import Float, Int
from arrivals.validation import LARGEST, one_of, positive, real


class Matches(NamedTuple):
    """Pairs of a true and an estimated direction or position, in order of steps.

    Parameters
    ----------
    step, source, slot : ndarray of int, shape (n_pairs,)
        Time step, column of the truth and column of the estimates.
    error : ndarray, shape (n_pairs,) or (n_pairs, dim)
        Estimate minus truth, in the unit of the arguments; wrapped if there is a period. Along
        great circles it lies in the tangent plane: elevation, azimuth along its circle.
    """

    step: Int
    source: Int
    slot: Int
    error: Float


def matches(
    truth: ArrayLike,
    estimate: ArrayLike,
    c: float,
    period: float | None = None,
    distance: Distance = "euclidean",
) -> Matches:
    """Assign estimates nearer than `c` to true points, in each step, as GOSPA with p = 1.

    Parameters
    ----------
    truth, estimate : array_like, shapes (n_steps, n_sources[, dim]), (n_steps, n_slots[, dim])
        True and estimated directions or positions; NaN for inactive and undetected.
    c : float
        Cut-off, in the same unit.
    period : float, optional
        Period of the angles; differences are wrapped.
    distance : {"euclidean", "great_circle"}
        As in `gospa`.

    Returns
    -------
    Matches
        Pairs and their errors.

    Raises
    ------
    ValueError
        If the shapes do not fit, or `c` or `period` is not positive.

    Examples
    --------
    >>> pairs = matches([[10, 20, 40]], [[26, np.nan, 11]], c=10)
    >>> pairs.source, pairs.slot, pairs.error
    (array([0, 1]), array([2, 0]), array([1., 6.]))
    """
    from scipy.optimize import linear_sum_assignment

    t, f = real("truth", truth), real("estimate", estimate)
    if t.ndim not in (2, 3) or f.ndim != t.ndim or len(t) != len(f) or t.shape[2:] != f.shape[2:]:
        raise ValueError(
            "truth and estimate must have shapes (n_steps, n_sources) and (n_steps, n_slots), or "
            f"(..., dim) of positions; got {t.shape} and {f.shape}"
        )
    if np.any(np.abs(t) >= LARGEST) or np.any(np.abs(f) >= LARGEST):
        raise ValueError(
            "truth and estimate must be finite, or NaN for absent points; got infinity"
        )
    on_sphere = one_of("distance", distance, ("euclidean", "great_circle")) == "great_circle"
    if on_sphere and t.ndim == 2:
        raise ValueError(f"truth must have azimuth and elevation, (..., 2); got {t.shape}")
    if on_sphere:
        error = tangent_errors(t[:, :, None], f[:, None], period)
    else:
        error = f[:, None] - t[:, :, None]
    if not on_sphere and period is not None:
        half = positive("period", period) / 2
        error = (error + half) % period - half
    apart = np.abs(error) if error.ndim == 3 else np.linalg.norm(error, axis=-1)
    cost = np.where(np.isnan(apart), np.inf, apart)
    bounded = np.minimum(cost, positive("c", c))
    rows = []
    for step in range(len(t)):
        source, slot = linear_sum_assignment(bounded[step])
        kept = cost[step, source, slot] < c
        rows.append(np.stack([np.full(kept.sum(), step), source[kept], slot[kept]]))
    step, source, slot = np.concatenate([np.zeros((3, 0), dtype=np.int64), *rows], axis=1)
    return Matches(step, source, slot, np.asarray(error[step, source, slot]))


def label_switches(pairs: Matches, label: ArrayLike) -> int:
    """Count the detections of a source with a label other than that of its last detection.

    Parameters
    ----------
    pairs : Matches
        As `matches` returns them.
    label : array_like of int, shape (n_steps, n_slots)
        Labels of the estimates.

    Returns
    -------
    int
        Number of switches of all sources.

    References
    ----------
    Bernardin and Stiefelhagen, "Evaluating multiple object tracking performance", EURASIP J. Image
    Video Process., 2008, section 2.1.3 (mismatches).

    Examples
    --------
    >>> pairs = matches([[0.0, 5.0]] * 3, [[0.0, 5.0], [5.0, 0.0], [5.0, 0.0]], c=1)
    >>> label_switches(pairs, [[7, 8], [8, 7], [7, 8]])
    2
    """
    return sum(int((np.diff(names) != 0).sum()) for _, names in _histories(pairs, label))


def track_lengths(pairs: Matches, label: ArrayLike) -> Int:
    """Return the numbers of successive steps in which a source is detected with one label.

    Parameters
    ----------
    pairs : Matches
        As `matches` returns them.
    label : array_like of int, shape (n_steps, n_slots)
        Labels of the estimates.

    Returns
    -------
    ndarray of int, shape (n_tracks,)
        Lengths of the tracks without gaps.

    Examples
    --------
    >>> pairs = matches([[0.0]] * 6, [[0.0], [0.0], [np.nan], [0.0], [0.0], [0.0]], c=1)
    >>> track_lengths(pairs, [[3], [3], [-1], [3], [3], [4]])
    array([2, 2, 1])
    """
    lengths = [np.zeros(0, dtype=np.int64)]
    for steps, names in _histories(pairs, label):
        breaks = np.flatnonzero((np.diff(steps) > 1) | (np.diff(names) != 0)) + 1
        lengths.append(np.diff(np.concatenate([[0], breaks, [len(steps)]])))
    return np.concatenate(lengths)


def _histories(pairs: Matches, label: ArrayLike) -> list[tuple[Int, Int]]:
    """Return steps and labels of each detected source, in order of time."""
    names = np.asarray(label)[pairs.step, pairs.slot]
    mine = [pairs.source == source for source in np.unique(pairs.source)]
    return [(pairs.step[on], names[on]) for on in mine]
