"""Births and deaths of sources by the Laplace evidence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.inference.solution import Solution
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior
from arrivals.trackers.rss.model_order.model_selection import Candidate
from arrivals.trackers.rss.model_order.track_table import MAX_LOG_ODDS, TrackTable
from arrivals.typing import Float, Int

Solve = Callable[[JointPosterior, Float, Float], Solution]


class BirthDeathUpdate(NamedTuple):
    """Result of an update with births and deaths.

    Parameters
    ----------
    candidate : Candidate
        Estimates of the supported sources, followed by the new ones if the step was searched.
    supported : ndarray of int
        Indices of the supported ones among the predicted sources.
    searched : Candidate
        The same in the readings that were searched for new sources.
    tracks : TrackTable
        Predicted sources with the evidence of this step, followed by the new ones.
    """

    candidate: Candidate
    supported: Int
    searched: Candidate
    tracks: TrackTable


def update_with_births(
    predicted: Candidate,
    together: Candidate,
    complete: bool,
    tracks: TrackTable,
    new: NewSourcePrior,
    solve: Solve,
    confirm_steps: int,
    max_sources: int,
) -> BirthDeathUpdate:
    """Update sources that may appear and disappear.

    Sources supported by the readings are updated; the others keep their prediction. The support
    of a source is the difference of the Laplace evidence with it and without it. A source whose
    addition increases the evidence by ln 99 is new. A step with fewer than three readings a source
    is searched together with those before it. A new source is confirmed, and later deleted, by the
    log odds in the track table.

    Parameters
    ----------
    predicted : Candidate
        Predicted sources.
    together : Candidate
        The same in the readings of the step and those before it.
    complete : bool
        Whether no other sensors are expected to follow; else twice as many readings are required.
    tracks : TrackTable
        Their labels and existence.
    new : NewSourcePrior
    solve : callable
        The tracker's method, for a batch of problems.
    confirm_steps, max_sources : int
        As in `BirthDeath` and `GridSearch`.

    Returns
    -------
    BirthDeathUpdate
    """
    candidate, supported, evidence = supported_sources(predicted, solve)
    tracks = tracks.updated(evidence, confirm_steps)
    searched, known, n_known = candidate, predicted.part(supported), len(supported)
    is_short = carried_sources(len(predicted.problem.W)) <= n_known
    if is_short:
        known = together.part(supported)
        searched = replace(known, u=candidate.u, theta=candidate.theta)
    n_readings = len(known.problem.W)
    if is_short and not complete:
        n_readings //= 2
    n_free = carried_sources(n_readings) - n_known
    n_free = min(n_free, max_sources - len(predicted.u))
    if is_short and n_free > 0:
        searched = searched.refitted()
    searched, gains = add_new_sources(searched, known, new, n_free)
    tracks = tracks.extended(gains, confirm_steps)
    return BirthDeathUpdate(candidate if is_short else searched, supported, searched, tracks)


def carried_sources(n_readings: int) -> int:
    """Return the largest number of sources that readings determine: three unknowns each.

    Examples
    --------
    >>> carried_sources(8)
    2
    """
    return n_readings // 3


def add_new_sources(
    candidate: Candidate, predicted: Candidate, new: NewSourcePrior, n_free: int
) -> tuple[Candidate, list[float]]:
    """Add sources while each increases the evidence by more than ln 99.

    Sources that have just appeared bias the estimates of the known ones, so the search also
    starts from the predictions of those.

    Parameters
    ----------
    candidate : Candidate
        Estimates of the known sources.
    predicted : Candidate
        Predictions of the same sources.
    new : NewSourcePrior
    n_free : int
        Largest number of sources to add.

    Returns
    -------
    candidate : Candidate
    gains : list of float
        Increase of the log evidence by each new source.
    """
    gains: list[float] = []
    while len(gains) < n_free:
        larger = [candidate.enlarged(new)]
        if len(predicted.u):
            predicted = predicted.enlarged(new)
            larger.append(predicted)
        best = max(larger, key=lambda other: other.log_evidence)
        gain = best.log_evidence - candidate.log_evidence
        if not gain > MAX_LOG_ODDS:
            break
        gains.append(gain)
        candidate = best
    return candidate, gains


def supported_sources(predicted: Candidate, solve: Solve) -> tuple[Candidate, Int, Float]:
    """Return the sources that increase the evidence, after an update.

    Parameters
    ----------
    predicted : Candidate
        Predicted sources.
    solve : callable
        The tracker's method, for a batch of problems.

    Returns
    -------
    candidate : Candidate
        Estimates of the supported sources.
    supported : ndarray of int
        Their indices among the predicted ones.
    evidence : ndarray, shape (n_sources,)
        Log evidence with a source minus that without it; negative for unsupported sources.
    """
    evidence = np.zeros(len(predicted.u))
    supported = np.arange(len(predicted.u))
    candidate = solved(predicted, solve)
    while len(supported):
        without = [candidate.without(j) for j in range(len(supported))]
        losses = np.array([candidate.log_evidence - other.log_evidence for other in without])
        evidence[supported] = losses
        j = int(losses.argmin())
        if losses[j] > 0:
            break
        candidate = without[j]
        supported = np.delete(supported, j)
    return candidate, supported, evidence


def solved(candidate: Candidate, solve: Solve) -> Candidate:
    """Return the joint maximum that starts at the solution of a tracker's own method."""
    if len(candidate.u) == 0:
        return candidate
    solution = solve(candidate.problem.select(None), candidate.u[None], candidate.theta[None])
    return Candidate(candidate.problem, solution.u[0], solution.theta[0]).refitted()
