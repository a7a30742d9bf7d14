"""Better places of new sources, by all readings since their detection."""

from __future__ import annotations

from typing import TYPE_CHECKING

from arrivals.trackers.rss.inference.joint_posterior import JointPosterior
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior
from arrivals.trackers.rss.model_order.model_selection import Candidate
from arrivals.typing import Float

if TYPE_CHECKING:
    from arrivals.trackers.rss.base import RSSTracker

SETTLING_STEPS = 10  # with readings, after a source has been detected
MAX_READINGS = 12  # a source; with more, one step determines the place
MIN_GAIN = 1.0  # of the log evidence by another place


def better_places(
    tracker: RSSTracker, weights: Float, new: NewSourcePrior
) -> tuple[list[int], Candidate] | None:
    """Return sources that have a better place in the pooled readings, and all places; or None.

    Parameters
    ----------
    tracker : RSSTracker
        After an update.
    weights : ndarray, shape (n_sensors,)
        Weights of the pooled readings now.
    new : NewSourcePrior

    Returns
    -------
    moved : list of int
        Indices of sources, in the order of the last sources of `candidate`.
    candidate : Candidate
    """
    sources = tracker.source_beliefs()
    K, pool = len(sources.u), tracker.pool
    if not 3 * K <= (weights > 0).sum() < MAX_READINGS * K:
        return None
    propagation = tracker.measurement.propagation._replace(sensors=pool.sensors)
    problem = JointPosterior(propagation, pool.xi, weights, new.prior(K)).at_valid_sensors()
    best = Candidate(problem, sources.u, sources.x[:, tracker.position]).refitted()
    moved: list[int] = []
    order = list(range(K))
    for j in range(K):
        at = order.index(j)
        other = best.without(at).enlarged(new)
        if other.log_evidence_of_set > best.log_evidence_of_set + MIN_GAIN:
            best = other
            order.append(order.pop(at))
            moved.append(j)
    return (moved, best) if moved else None
