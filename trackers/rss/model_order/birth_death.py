"""Sources that come and go: counted by the evidence, believed after several steps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from arrivals.trackers.rss.belief import SourceBeliefs
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Marginals
from arrivals.trackers.rss.inference.solution import Solution, found_of, in_batch
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior
from arrivals.trackers.rss.model_order.model_selection import Candidate
from arrivals.typing import Bool, Float, Int

if TYPE_CHECKING:
    from arrivals.trackers.rss.base import RSSTracker

SURE = float(np.log(99.0))  # log odds at which a source is believed in, or given up


@dataclass(frozen=True, eq=False)
class TrackTable:
    """Who is there; all (n_sources,).

    Parameters
    ----------
    label : ndarray of int
    odds : ndarray
        Log odds that the source is there, within ± ln 99.
    confirmed : ndarray of bool
        It has once been sure.
    next_label : int
    """

    label: Int
    odds: Float
    confirmed: Bool
    next_label: int

    @classmethod
    def known(cls, n: int) -> TrackTable:
        """Return n sources that are there beyond doubt.

        Examples
        --------
        >>> TrackTable.known(2).existence
        array([1., 1.])
        """
        return cls(np.arange(n), np.full(n, np.inf), np.ones(n, dtype=np.bool_), n)

    @property
    def existence(self) -> Float:
        """Probabilities that the sources are there."""
        return np.asarray(1 / (1 + np.exp(-self.odds)))

    def take(self, rows: Int | Bool) -> TrackTable:
        """Return some of the sources."""
        return TrackTable(self.label[rows], self.odds[rows], self.confirmed[rows], self.next_label)

    def weighed(self, evidence: Float, confirm: int) -> TrackTable:
        """Return the census after one more step's evidence for each source.

        A step counts for 2 ln 99 / `confirm` at most: so many it takes to be sure, either way.
        """
        most = 2 * SURE / confirm
        odds = np.clip(self.odds, -SURE, SURE) + np.clip(evidence, -most, most)
        odds = np.clip(odds, -SURE, SURE)
        return replace(self, odds=odds, confirmed=self.confirmed | (odds >= SURE - 1e-9))

    def with_newborn(self, gains: list[float], confirm: int) -> TrackTable:
        """Return the census with some more, of whom nothing is sure but a first step's evidence."""
        n = len(gains)
        fresh = TrackTable(
            self.next_label + np.arange(n),
            np.full(n, -SURE),
            np.zeros(n, dtype=np.bool_),
            self.next_label + n,
        ).weighed(np.array(gains), confirm)
        return TrackTable(
            np.append(self.label, fresh.label),
            np.append(self.odds, fresh.odds),
            np.append(self.confirmed, fresh.confirmed),
            fresh.next_label,
        )


class Counted(NamedTuple):
    """Sources, census, and the fit behind them."""

    sources: SourceBeliefs
    census: TrackTable
    fit: Candidate
    found: Solution


def counted(
    tracker: RSSTracker, sources: SourceBeliefs, census: TrackTable, xi: Float, W: Float
) -> Counted:
    """Correct sources by readings, with births and deaths.

    The sources that the readings speak for are corrected, the others only predicted. What speaks
    for a source is the difference of the Laplace evidence with it and without it. Whatever
    raises the evidence as one more source is kept as a newborn. Each is shown once it is sure,
    and given up when its odds have fallen to the same depth.

    Parameters
    ----------
    tracker : RSSTracker
    sources : Sources
        Predicted.
    census : Census
    xi, W : ndarray, shape (n_sensors,)
        Readings and weights.
    """
    problem = JointPosterior(tracker.measurement.field, xi, W, sources.prior(tracker.xy))
    expected = Candidate(problem, sources.u, sources.x[:, tracker.xy])
    fit, heard, evidence = spoken_for(tracker, expected)
    census = census.weighed(evidence, tracker.confirm)
    room = tracker.max_sources - len(sources.u)
    fit, gains = with_newborn(fit, expected.part(heard), tracker.newcomers(W > 0), room)
    found = found_of(fit)
    K = len(heard)
    old = Marginals(found.marginals.v[0, :K], found.marginals.Sigma[0, :K])
    moved = sources.take(heard).corrected(
        fit.u[:K], fit.theta[:K], old, tracker.xy, tracker.motion.angles
    )
    sources = SourceBeliefs(*(part.copy() for part in sources))
    for part, new in zip(sources, moved, strict=True):
        part[heard] = new
    alive = census.odds > -SURE + 1e-9
    sources = sources.take(alive).joined(tracker.fresh(fit).take(slice(K, None)))
    return Counted(sources, census.take(alive).with_newborn(gains, tracker.confirm), fit, found)


def with_newborn(
    fit: Candidate, expected: Candidate, new: NewSourcePrior, room: int
) -> tuple[Candidate, list[float]]:
    """Return a fit enlarged as long as each more source raises the evidence enough, and the gains.

    Sources that have just appeared pull the known ones off their places, so the newborn are also
    looked for from where those were expected.

    Parameters
    ----------
    fit : Fit
        Of the sources that are known.
    expected : Fit
        The same sources as predicted.
    new : Newcomers
    room : int
        Sources that may be added.
    """
    gains: list[float] = []
    while len(gains) < room:
        both = [fit.enlarged(new)]
        if len(expected.u):
            expected = expected.enlarged(new)
            both.append(expected)
        larger = max(both, key=lambda other: other.log_evidence)
        gain = larger.log_evidence - fit.log_evidence
        if not gain > SURE:
            break
        gains.append(gain)
        fit = larger
    return fit, gains


def spoken_for(tracker: RSSTracker, whole: Candidate) -> tuple[Candidate, Int, Float]:
    """Return the fit of the sources that raise the evidence, their numbers, and what it says.

    Returns
    -------
    fit : Fit
    heard : ndarray of int
        Which of the sources the fit is of.
    evidence : ndarray, shape (n_sources,)
        Log evidence with a source less that without it; negative for the others.
    """
    evidence = np.zeros(len(whole.u))
    heard = np.arange(len(whole.u))
    fit = solved(tracker, whole)
    while len(heard):
        lost = np.array([fit.log_evidence - fit.without(j).log_evidence for j in range(len(heard))])
        evidence[heard] = lost
        j = int(lost.argmin())
        if lost[j] > 0:
            break
        fit = fit.without(j)
        heard = np.delete(heard, j)
    return fit, heard, evidence


def solved(tracker: RSSTracker, fit: Candidate) -> Candidate:
    """Return the fit after the tracker's own method, and the joint maximum from there."""
    if len(fit.u) == 0:
        return fit
    found = tracker.solve(in_batch(fit.problem), fit.u[None], fit.theta[None])
    return Candidate(fit.problem, found.u[0], found.theta[0]).refitted()
