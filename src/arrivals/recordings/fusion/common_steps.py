"""Steps of common time: grids of recordings, steps of tables, and the steps nearest to times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from arrivals.typing import Float, Int

COMMON = 1.5  # mean number of stations at a time, from which times are common
MOST_STEPS = 10**7
ROUNDING = 1e-9  # of a step, by which a time on the edge of two is in the later one


def nearest_steps(time: Float, steps: Float, half: float) -> Int:
    """Return the index of the step nearest to each time, -1 if none lies within half a step.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times, s.
    steps : ndarray, shape (n_steps,)
        Middles of the steps, s, increasing.
    half : float
        Half of a step, s.

    Returns
    -------
    ndarray of int, shape (n,)

    Examples
    --------
    >>> nearest_steps(np.array([0.9, 1.6, 7.0]), np.array([0.0, 1.0, 2.0]), 0.5)
    array([ 1,  2, -1])
    """
    if not len(steps):
        return np.full(len(time), -1)
    after = np.clip(np.searchsorted(steps, time), 1, max(1, len(steps) - 1))
    before = after - 1
    after = np.minimum(after, len(steps) - 1)
    at = np.where(time - steps[before] < steps[after] - time, before, after)
    return np.where(np.abs(time - steps[at]) <= half * (1 + ROUNDING), at, -1)


def grid(times: Sequence[Float], duration: float) -> Float:
    """Return middles of steps of one duration that span the times of all stations.

    Parameters
    ----------
    times : sequence of ndarray
        Middles of the steps of each station, s.
    duration : float
        Of a step, s.

    Returns
    -------
    ndarray, shape (n_steps,)

    Raises
    ------
    ValueError
        If there are more than ten million steps.

    Examples
    --------
    >>> grid([np.array([0.5, 1.5]), np.array([1.52, 2.52, 3.52])], 1.0)
    array([0.5, 1.5, 2.5, 3.5])
    """
    first, last = min(float(one[0]) for one in times), max(float(one[-1]) for one in times)
    n = int(np.floor((last - first) / duration + 0.5)) + 1
    if n > MOST_STEPS:
        raise ValueError(
            f"recordings must have at most {MOST_STEPS} steps in all; got {n}, from {first:g} to "
            f"{last:g} s: check start_s"
        )
    return np.asarray(first + duration * np.arange(n), np.float64)


def members(times: Sequence[Float], steps: Float, duration: float) -> Int:
    """Return the step of each station that is taken in each common step, -1 if none.

    A station takes part in a step whose middle lies within half a step of one of its own; of
    several the nearest is taken.

    Parameters
    ----------
    times : sequence of ndarray
        Middles of the steps of each station, s, increasing.
    steps : ndarray, shape (n_steps,)
        Middles of the common steps, s.
    duration : float
        Of a common step, s.

    Returns
    -------
    ndarray of int, shape (n_steps, n_stations)

    Examples
    --------
    >>> members([np.array([0.5, 1.5]), np.array([1.1, 1.7])], np.array([0.5, 1.5]), 1.0)
    array([[ 0, -1],
           [ 1,  1]])
    """
    taken = np.full((len(steps), len(times)), -1)
    for k, own in enumerate(times):
        at = nearest_steps(own, steps, duration / 2)
        valid = np.flatnonzero(at >= 0)
        # the nearest of several is written last
        order = valid[np.argsort(-np.abs(own[valid] - steps[at[valid]]), kind="stable")]
        taken[at[order], k] = order
    return taken


def interval(time: Float, station: Int) -> float:
    """Return the median time between successive bearings of a station at different times, s.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times, s.
    station : ndarray of int, shape (n,)
        Indices of the stations.

    Returns
    -------
    float
        1 s if no station has two times.

    Examples
    --------
    >>> interval(np.array([0.0, 0.3, 1.0, 1.3, 1.3]), np.array([0, 1, 0, 1, 1]))
    1.0
    """
    order = np.lexsort((time, station))
    between = np.diff(time[order])[np.diff(station[order]) == 0]
    between = between[between > 0]
    return float(f"{np.median(between):.3g}") if between.size else 1.0


def table_steps(time: Float, station: Int, duration: float | None) -> tuple[Float, Int, float]:
    """Return the steps of a table, the step of each row, and the duration of a step.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times, s.
    station : ndarray of int, shape (n,)
        Indices of the stations.
    duration : float, optional
        Of a step, s. If None, the rows of one time are a step where most times are those of
        several stations; rows at scattered times are put in steps of the time between two of a
        station.

    Returns
    -------
    steps : ndarray, shape (n_steps,)
        Mean times of the rows, s.
    at : ndarray of int, shape (n,)
    duration : float

    Examples
    --------
    >>> time, station = np.array([0.0, 0.4, 1.0, 1.4, 4.0]), np.array([0, 1, 0, 1, 0])
    >>> table_steps(time, station, None)
    (array([0.2, 1.2, 4. ]), array([0, 0, 1, 1, 2]), 1.0)
    """
    pairs = np.unique(np.stack([time, station]), axis=1)
    length = interval(time, station) if duration is None else duration
    if duration is None and pairs.shape[1] >= COMMON * len(np.unique(time)):
        steps, at = np.unique(time, return_inverse=True)
        return steps, at.ravel(), length
    number = np.floor((time - time.min()) / length + 0.5 + ROUNDING)
    _, at, n = np.unique(number, return_inverse=True, return_counts=True)
    at = at.ravel()
    return np.bincount(at, time) / n, at, length
