"""Detection of sources of unknown number or positions, and their initial beliefs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.motion_models.base import MotionModel
from arrivals.trackers.rss.arguments import (
    warn_few_readings,
    warn_unsupported_sources,
    without_position,
)
from arrivals.trackers.rss.belief import Entries, SourceBeliefs
from arrivals.trackers.rss.inference.solution import Marginals, WeightedReadings
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
from arrivals.trackers.rss.settings import AmplitudePrior, GridSearch
from arrivals.typing import Float

if TYPE_CHECKING:
    from arrivals.trackers.rss.base import RSSTracker

PATIENCE = 2  # sources added without a gain of evidence before the selection ends


def detect_sources(tracker: RSSTracker, readings: WeightedReadings) -> None:
    """Update the belief of a tracker where the number of sources is unknown or changes."""
    sources, W = tracker.source_beliefs(), readings.W[0]
    tracks, max_sources = tracker.current_tracks(len(sources.u)), tracker.search.max_sources
    new = new_source_prior(tracker.measurement.sensors[W > 0], tracker.amplitude, tracker.search)
    problem = tracker.joint_posterior(sources, readings)
    problem = problem._replace(xi=readings.xi[0], W=W).at_valid_sensors()
    predicted = Candidate(problem, sources.u, problem.prior.theta)
    if tracker.births:
        steps = tracker.births.confirm_steps
        result = update_with_births(predicted, tracks, new, tracker.solve, steps, max_sources)
        candidate, tracks = result.candidate, result.tracks
        sources = update_supported(sources, result, tracker.position, tracker.motion)
        n_known = len(result.supported)
    else:
        candidate = select_sources(predicted, new, tracker.n_sources, max_sources)
        tracks, n_known = TrackTable.certain(len(candidate.u)), 0
    detected = new_beliefs(candidate, tracker.P0, tracker.motion.dim_x, tracker.position)
    sources = sources.joined(detected.select(slice(n_known, None)))
    active = tracks.active
    problem = candidate.problem._replace(W=readings.precision[0, W > 0]).select(None)
    diagnostics = problem.diagnose(candidate.solution)
    tracker.store(sources.select(active), candidate.solution, diagnostics, tracks.select(active))


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
    if n_sources is None:
        max_sources = min(max_sources, carried_sources(len(empty.problem.W)))
        return best_model(forward_selection(empty, new, max_sources, PATIENCE), new)
    warn_few_readings(len(empty.problem.W), n_sources)
    candidates = forward_selection(empty, new, n_sources)
    warn_unsupported_sources([one.log_evidence_of_set for one in candidates], n_sources)
    return local_search(candidates[n_sources], new, same_number=True)


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
