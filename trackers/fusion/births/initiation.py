"""Births in every hypothesis, and rival hypotheses with other births."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from arrivals.trackers.fusion.births.crossing_sets import BirthModel, CrossingSets, Detections
from arrivals.trackers.fusion.births.new_tracks import ErrorBelief, new_tracks
from arrivals.trackers.fusion.births.packings import packings
from arrivals.trackers.fusion.hypotheses import Hypothesis, agree
from arrivals.trackers.fusion.settings import GlobalHypotheses
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.typing import Bool, Float, Int

MIN_LOG_WEIGHT = -3.0  # of a set in a packing: existence 0.05
MAX_RIVALS = 3  # new hypotheses from one of them in a step


class Packing(NamedTuple):
    """Disjoint crossings of one hypothesis.

    Parameters
    ----------
    sets : CrossingSets
        By falling weight.
    total : float
        Sum of their log weights, each plus 3.
    """

    sets: CrossingSets
    total: float


class Initiation(NamedTuple):
    """A hypothesis with its births.

    Parameters
    ----------
    row : int
        Number of the hypothesis that it continues.
    hypothesis : Hypothesis
        With the new tracks, and the evidence of their packing.
    used : ndarray of bool, shape (n_detections,)
        Bearings of the packing.
    """

    row: int
    hypothesis: Hypothesis
    used: Bool


class Labels:
    """Labels of new tracks: the same for the same bearings in all hypotheses of one group.

    Examples
    --------
    >>> labels = Labels(7)
    >>> labels.of(np.array([[0, 1], [2, -1]]), 0), labels.of(np.array([[2, -1]]), 0), labels.new()
    (array([7, 8]), array([8]), 9)
    """

    def __init__(self, next_label: int) -> None:
        self.next_label = next_label
        self._known: dict[tuple[int, bytes], int] = {}

    def of(self, members: Int, group: int) -> Int:
        """Return a label for each row of members, (n_sets,), in a group of hypotheses."""
        labels = []
        for row in members:
            key = group, row.tobytes()
            if key not in self._known:
                self._known[key] = self.new()
            labels.append(self._known[key])
        return np.array(labels, dtype=np.int64)

    def new(self) -> int:
        """Return the next label."""
        self.next_label += 1
        return self.next_label - 1


def possible_packings(sets: CrossingSets, detections: Detections) -> list[Packing]:
    """Return the packings of the crossings of one hypothesis, the best first."""
    sets = sets.select(sets.log_weight > MIN_LOG_WEIGHT)
    # sets that share a detection are the two images of a bearing of a line, too
    n = 1 + int(detections.bearing.max(initial=0))
    keys = detections.station * n + detections.bearing
    members = [frozenset(keys[row[row >= 0]].tolist()) for row in sets.members]
    found = packings(members, sets.log_weight - MIN_LOG_WEIGHT)
    return [Packing(sets.select(np.array(chosen, dtype=np.int64)), t) for chosen, t in found]


def rival_packings(ways: Sequence[Packing], margin: float) -> list[Packing]:
    """Return the packings within `margin` nats of the best whose likely births differ."""

    def births(way: Packing) -> tuple[Float, Float]:
        likely = way.sets.log_weight > 0
        return way.sets.position[likely], way.sets.covariance[likely]

    kept = [births(ways[0])]
    rivals: list[Packing] = []
    for way in ways[1:]:
        if way.total <= ways[0].total - margin or len(rivals) == MAX_RIVALS:
            break
        own = births(way)
        if not any(agree(*own, *other) for other in kept):
            kept.append(own)
            rivals.append(way)
    return rivals


def initiate(
    hypotheses: Sequence[Hypothesis],
    unexplained: Float,
    detections: Detections,
    model: BirthModel,
    layout: StateLayout,
    settings: GlobalHypotheses,
    labels: Labels,
    n_own: int,
) -> list[Initiation]:
    """Return hypotheses with their best births, and rivals with other births.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
    unexplained : ndarray, shape (n_hypotheses, n_detections)
        Probability that each bearing is of none of the tracks.
    detections : Detections
    model : BirthModel
    layout : StateLayout
    settings : GlobalHypotheses
    labels : Labels
    n_own : int
        Number of hypotheses that are not the challenger's; those share labels.

    Returns
    -------
    list of Initiation
    """
    sets = model.crossing_sets(detections, unexplained)
    none = np.zeros(len(detections.station), dtype=np.bool_)
    after: list[Initiation] = []
    for row, hypothesis in enumerate(hypotheses):
        own = sets.select(sets.hypothesis == row)
        if not len(own.members):
            after.append(Initiation(row, hypothesis, none))
            continue
        ways = possible_packings(own, detections)
        rivals = rival_packings(ways, settings.rivals) if settings.rivals else []
        known = ErrorBelief.best_of(hypothesis.tracks, layout)
        for way in (ways[0], *rivals):
            room = max(settings.max_tracks - hypothesis.tracks.n_tracks, 0)
            chosen = way.sets.select(slice(room))
            label = labels.of(chosen.members, int(row >= n_own))
            born = new_tracks(chosen, label, known, layout, model, detections)
            used = none.copy()
            used[way.sets.members[way.sets.members >= 0]] = True
            grown = hypothesis._replace(tracks=hypothesis.tracks.joined(born))
            after.append(Initiation(row, grown.gained(way.total), used))
    return after
