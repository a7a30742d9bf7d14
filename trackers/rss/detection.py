"""Detection of sources of unknown number or positions, and their initial beliefs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.motion_models.base import MotionModel
from arrivals.trackers.rss.arguments import (
    warn_few_readings,
    warn_mirror,
    warn_unsupported_sources,
    without_position,
)
from arrivals.trackers.rss.belief import Entries, SourceBeliefs
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.inference.solution import Marginals, WeightedReadings
from arrivals.trackers.rss.mirror import Line
from arrivals.trackers.rss.model_order.birth_death import (
    BirthDeathUpdate,
    carried_sources,
    update_with_births,
)
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior
from arrivals.trackers.rss.model_order.model_selection import (
    Candidate,
    best_model,
    forward_selection,
    local_search,
)
from arrivals.trackers.rss.model_order.track_table import TrackTable
from arrivals.trackers.rss.pooled_readings import PooledReadings, displacement_variance
from arrivals.trackers.rss.relocation import SETTLING_STEPS, better_places
from arrivals.trackers.rss.settings import AmplitudePrior, GridSearch
from arrivals.typing import Float

if TYPE_CHECKING:
    from arrivals.trackers.rss.base import RSSTracker

PATIENCE = 2  # sources added without a gain of evidence before the selection ends


def detect_sources(tracker: RSSTracker, readings: WeightedReadings) -> None:
    """Update the belief of a tracker where the number of sources is unknown or changes.

    A step with too few readings for its sources is searched together with those before it.
    """
    sources, xi, W = tracker.source_beliefs(), readings.xi[0], readings.W[0]
    tracks, prior = tracker.current_tracks(len(sources.u)), sources.prior(tracker.position)
    propagation, max_sources = tracker.measurement.propagation, tracker.search.max_sources
    pool, weights, new = pool_readings(tracker, xi, W)
    around = propagation._replace(sensors=pool.sensors)
    step, together = (
        Candidate(problem.at_valid_sensors(), sources.u, prior.theta)
        for problem in (
            JointPosterior(propagation, xi, W, prior),
            JointPosterior(around, pool.xi, weights, prior),
        )
    )
    if tracker.births:
        steps = tracker.births.confirm_steps
        result = update_with_births(
            step, together, pool.is_complete(len(step.problem.W)), tracks, new,
            tracker.solve, steps, max_sources,
        )  # fmt: skip
        candidate, searched, tracks = result.candidate, result.searched, result.tracks
        sources = update_supported(sources, result, tracker.position, tracker.motion)
        n_known = len(result.supported)
    else:
        complete = pool.is_complete(len(step.problem.W))
        chosen = sufficient(step, together, tracker.n_sources or 1, complete)
        if chosen is None:
            tracker.pool = pool
            tracker.record_missed()
            return
        candidate = searched = select_sources(chosen, new, tracker.n_sources, max_sources)
        tracks, n_known = TrackTable.certain(len(candidate.u)), 0
    detected = new_beliefs(searched, tracker.P0, tracker.motion.dim_x, tracker.position)
    sources = sources.joined(detected.select(slice(n_known, None)))
    active, solution = tracks.active, candidate.solution
    fraction = readings.W.sum() / readings.precision.sum()
    problem = candidate.problem._replace(W=candidate.problem.W / fraction)
    diagnostics = problem.select(None).diagnose(solution)
    tracker.store(sources.select(active), solution, diagnostics, tracks.select(active))
    tracker.pool = pool
    if len(detected.u) > n_known:
        tracker.settling = SETTLING_STEPS
    elif tracker.settling:
        settle(tracker, weights, new)
    line = None
    if tracker.x0 is None and active.any():
        line = Line.through(pool.sensors[pool.seen])
    if line is not None and tracker.line is None:
        warn_mirror()
    tracker.line = line


def keep_settling(tracker: RSSTracker, readings: WeightedReadings) -> None:
    """Check the places of detected sources after an update of a constant number of them."""
    xi, W = readings.xi[0], readings.W[0]
    if tracker.line is not None and not tracker.line.contains(tracker.measurement.sensors[W > 0]):
        tracker.line = None
    if tracker.settling:
        tracker.pool, weights, new = pool_readings(tracker, xi, W)
        settle(tracker, weights, new)


def settle(tracker: RSSTracker, weights: Float, new: NewSourcePrior) -> None:
    """Move the sources that have a better place in the pooled readings."""
    tracker.settling -= 1
    better = better_places(tracker, weights, new)
    if better is not None:
        moved, candidate = better
        found = new_beliefs(candidate, tracker.P0, tracker.motion.dim_x, tracker.position)
        sources = tracker.source_beliefs()
        sources = sources.replaced(moved, found.select(slice(-len(moved), None)))
        tracker.set_belief(sources, tracker.current_tracks(len(sources.u)))


def pool_readings(
    tracker: RSSTracker, xi: Float, W: Float
) -> tuple[PooledReadings, Float, NewSourcePrior]:
    """Return the pooled readings after a step, their weights now, and the prior of new sources."""
    pool, valid = tracker.pool, W > 0
    if len(pool.xi) != len(xi):
        pool = PooledReadings.none(len(xi))
    sensors = np.where(valid[:, None], tracker.measurement.sensors, pool.sensors)
    new = new_source_prior(sensors[valid | pool.seen], tracker.amplitude, tracker.search)
    motion, position = tracker.motion, tracker.position
    P0 = without_position(tracker.P0, motion.dim_x, position)

    def spread(age: Float) -> Float:
        # a displacement s at the distance of the area's deviation changes a level by ½α s/std
        variance = displacement_variance(motion, P0, position, age) / new.std**2
        slope = 0.5 * tracker.measurement.alpha
        return np.where(variance < 1, slope**2 * variance, np.inf)

    pool = pool.joined(xi, W, sensors, spread(pool.age))
    return pool, pool.aged(spread(pool.age)), new


def sufficient(
    step: Candidate, together: Candidate, n_sources: int, complete: bool
) -> Candidate | None:
    """Return the readings that sources are detected in; None to wait for more.

    Parameters
    ----------
    step, together : Candidate
        Without a source: readings of the step, and pooled with those before.
    n_sources : int
    complete : bool
        Whether other sensors are not expected to follow.
    """
    n, n_together = len(step.problem.W), len(together.problem.W)
    if n >= 3 * n_sources:
        return step
    if complete or n_together >= 6 * n_sources:
        return together
    return step if n >= max(3, 2 * n_sources) else None


def new_source_prior(
    sensors: Float, amplitude: AmplitudePrior, search: GridSearch
) -> NewSourcePrior:
    """Return the prior of a source in the area of the sensors (n_sensors, 2).

    Examples
    --------
    >>> sensors = np.array([[0.0, 0.0], [60.0, 80.0]])
    >>> new_source_prior(sensors, AmplitudePrior(mean=[9.0, 9.2]), GridSearch()).mu
    9.1
    """
    mean, variance = (
        float(np.mean(np.asarray(value))) for value in (amplitude.mean, amplitude.variance)
    )
    return NewSourcePrior.among(sensors, mean, variance, search)


def select_sources(
    empty: Candidate, new: NewSourcePrior, n_sources: int | None, max_sources: int
) -> Candidate:
    """Return the sources detected in one set of readings.

    Parameters
    ----------
    empty : Candidate
        The candidate without a source, at the sensors with valid readings.
    new : NewSourcePrior
    n_sources : int or None
        Number of sources; selected by the evidence if None.
    max_sources : int
        Largest number where it is selected; at most one for three readings.
    """
    searched = empty.thinned()
    if n_sources is None:
        max_sources = min(max_sources, carried_sources(len(empty.problem.W)))
        best = best_model(forward_selection(searched, new, max_sources, PATIENCE), new)
        if searched is empty:
            return best
        found = best.at_sensors_of(empty)
        larger = forward_selection(found, new, max_sources, PATIENCE)
        best = max(larger, key=lambda candidate: candidate.log_evidence_of_set)
        return best if best is found else local_search(best, new, same_number=False)
    warn_few_readings(len(empty.problem.W), n_sources)
    candidates = forward_selection(searched, new, n_sources)
    best = local_search(candidates[n_sources], new, same_number=True)
    if searched is not empty:
        candidates = [each.at_sensors_of(empty) for each in candidates]
        best = best.at_sensors_of(empty)
    warn_unsupported_sources([one.log_evidence_of_set for one in candidates], n_sources)
    return best


def new_beliefs(
    candidate: Candidate, P0: ArrayLike | None, n: int, position: Entries
) -> SourceBeliefs:
    """Return the beliefs of detected sources: at rest, with the covariance P0 of the velocity.

    Parameters
    ----------
    candidate : Candidate
    P0 : array_like, shape (n, n) or (n_sources, n, n), optional
        As in `RSSVB`.
    n : int
        Number of entries of a state.
    position : tuple of two int
        Entries of a state that are the position.
    """
    K, moments, xy = len(candidate.u), candidate.solution.marginals, np.array(position)
    x, P = np.zeros((K, n)), np.tile(without_position(P0, n, position), (K, 1, 1))
    x[:, xy] = candidate.theta
    P[:, xy[:, None], xy] = moments.Sigma[0]
    return SourceBeliefs(x, P, candidate.u, moments.v[0])


def update_supported(
    sources: SourceBeliefs, result: BirthDeathUpdate, position: Entries, motion: MotionModel
) -> SourceBeliefs:
    """Return predicted sources after the update of those supported by the readings."""
    candidate, K = result.candidate, len(result.supported)
    moments = Marginals(*(part[0, :K] for part in candidate.solution.marginals))
    updated = sources.select(result.supported).updated(
        candidate.u[:K], candidate.theta[:K], moments, position, motion
    )
    return sources.replaced(result.supported, updated)
