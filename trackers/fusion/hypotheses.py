"""Global hypotheses: sets of tracks with weights, and the challenger that starts anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from arrivals.trackers.fusion.settings import GlobalHypotheses
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.trackers.fusion.tracks import Tracks, squared_distances
from arrivals.typing import Bool, Float

MIN_EXISTENCE = 0.02  # of tracks that are kept
MAX_SPREAD = 0.5  # standard deviation of their position, over the size of the area
LIKELY = 0.5  # existence of tracks that are reported and compared
SAME = 9.0  # squared distance of two tracks, over their covariances, that count as one
YOUNG = 5  # steps; tracks of older ones are not duplicates
DUPLICATE = 2.0, 5.0  # squared distances of position and state
MAX_AGE = 50  # steps; older tracks count as this old
MAX_LOSS = 10.0  # nats below the best hypothesis
BURN_IN = 3  # steps of a challenger that do not count
PAUSE = 2  # steps between two challengers


class Hypothesis(NamedTuple):
    """A set of tracks with its log weight.

    Parameters
    ----------
    tracks : Tracks
        Without batch axes.
    log_weight : float
        Relative to other hypotheses, nats.
    evidence : float
        Its change in this step.
    """

    tracks: Tracks
    log_weight: float = 0.0
    evidence: float = 0.0

    def gained(self, evidence: float) -> Hypothesis:
        """Return the hypothesis with a larger weight."""
        return self._replace(
            log_weight=self.log_weight + evidence, evidence=self.evidence + evidence
        )


def agree(x: Float, C: Float, other_x: Float, other_C: Float) -> bool:
    """Return True if each position of one set has one of the other within d² < 9, and vice versa.

    Parameters
    ----------
    x, other_x : ndarray, shape (n, 2)
        Positions, m.
    C, other_C : ndarray, shape (n, 2, 2)
        Covariances, m².

    Examples
    --------
    >>> two, C = np.array([[0.0, 0.0], [9.0, 0.0]]), np.tile(np.eye(2), (2, 1, 1))
    >>> agree(two, C, two[::-1] + 1.0, C), agree(two, C, two[:1], C[:1])
    (True, False)
    """
    if not len(x) or not len(other_x):
        return len(x) == len(other_x)
    near = squared_distances(x[:, None] - other_x, C[:, None] + other_C) < SAME
    return bool(near.any(axis=1).all() and near.any(axis=0).all())


def tidied(tracks: Tracks, layout: StateLayout, size: float) -> Tracks:
    """Return the tracks, older by a step, without improbable, vague and duplicate ones.

    Parameters
    ----------
    tracks : Tracks
        Of one hypothesis.
    layout : StateLayout
    size : float
        Longer side of the area, m.

    Returns
    -------
    Tracks
        By falling existence, with a bonus for age.
    """
    i, j = layout.position
    spread = tracks.P[:, i, i] + tracks.P[:, j, j]
    keep = (tracks.existence > MIN_EXISTENCE) & (spread < (MAX_SPREAD * size) ** 2)
    rank = tracks.existence * (1 + 0.01 * np.minimum(tracks.age, MAX_AGE))
    order = np.argsort(-rank, kind="stable")
    tracks = tracks.select(order[keep[order]])
    is_young = tracks.age < YOUNG
    if tracks.n_tracks > 1 and is_young.any():
        tracks = tracks.select(~_duplicates(tracks, layout))
    return tracks._replace(age=tracks.age + 1)


def _duplicates(tracks: Tracks, layout: StateLayout) -> Bool:
    """Return True for tracks so near to one with a smaller index that both are one source."""
    d, P = tracks.x[:, None] - tracks.x, tracks.P[:, None] + tracks.P
    place = list(layout.position)
    near = squared_distances(d[..., place], P[..., place, :][..., place]) < DUPLICATE[0]
    near &= np.minimum(tracks.age[:, None], tracks.age) < YOUNG
    is_duplicate: Bool = np.zeros(tracks.n_tracks, dtype=np.bool_)
    if not np.triu(near, 1).any():
        return is_duplicate
    entries = [*layout.position, *(layout.velocity or ())]
    near &= squared_distances(d[..., entries], P[..., entries, :][..., entries]) < DUPLICATE[1]
    for k in range(1, tracks.n_tracks):
        is_duplicate[k] = (near[k, :k] & ~is_duplicate[:k]).any()
    return is_duplicate


def pruned(
    hypotheses: Sequence[Hypothesis], layout: StateLayout, settings: GlobalHypotheses
) -> list[Hypothesis]:
    """Return the best hypotheses, no two with the same tracks, the best with log weight 0."""
    ordered = sorted(hypotheses, key=lambda each: -each.log_weight)
    top = ordered[0].log_weight
    if len(ordered) == 1:
        return [ordered[0]._replace(log_weight=0.0)]
    kept: list[Hypothesis] = []
    likely: list[tuple[Float, Float]] = []
    for each in ordered:
        if each.log_weight < top - MAX_LOSS or len(kept) == settings.max_hypotheses:
            break
        own = _likely(each.tracks, layout)
        if not any(agree(*own, *other) for other in likely):
            kept.append(each._replace(log_weight=each.log_weight - top))
            likely.append(own)
    return kept


def _likely(tracks: Tracks, layout: StateLayout) -> tuple[Float, Float]:
    """Return positions and covariances of the tracks that likely exist."""
    place, rows = list(layout.position), tracks.existence > LIKELY
    return tracks.x[rows][:, place], tracks.P[rows][:, place, :][:, :, place]


@dataclass(frozen=True, eq=False)
class Bank:
    """The hypotheses, and those of a challenger.

    Parameters
    ----------
    hypotheses : tuple of Hypothesis
        The best first.
    challenger : tuple of Hypothesis
        Those that started from nothing; empty between two challenges.
    age : int
        Steps of the challenger, or since the last one ended.
    lead : float
        Log odds of the challenger, nats.
    takeovers : int
        Number of challengers that took over.
    """

    hypotheses: tuple[Hypothesis, ...]
    challenger: tuple[Hypothesis, ...] = ()
    age: int = 0
    lead: float = 0.0
    takeovers: int = 0

    @property
    def every(self) -> tuple[Hypothesis, ...]:
        """All hypotheses, those of the challenger last."""
        return (*self.hypotheses, *self.challenger)

    def with_tracks(self, tracks: Sequence[Tracks]) -> Bank:
        """Return the bank with other tracks, in the order of `every`."""
        moved = [h._replace(tracks=t) for h, t in zip(self.every, tracks, strict=True)]
        n = len(self.hypotheses)
        return replace(self, hypotheses=tuple(moved[:n]), challenger=tuple(moved[n:]))

    def stepped(
        self,
        own: Sequence[Hypothesis],
        others: Sequence[Hypothesis],
        layout: StateLayout,
        settings: GlobalHypotheses,
    ) -> Bank:
        """Return the bank after a step: pruned, with a challenger that starts or takes over.

        Parameters
        ----------
        own, others : sequence of Hypothesis
            The updated hypotheses and those of the challenger.
        layout : StateLayout
        settings : GlobalHypotheses

        Returns
        -------
        Bank
        """
        kept = pruned(own, layout, settings)
        bank = replace(self, hypotheses=tuple(kept))
        if not settings.challenge:
            return replace(bank, challenger=())
        if not others:
            if self.age + 1 < PAUSE:
                return replace(bank, age=self.age + 1)
            nothing = kept[0].tracks.select(slice(0))
            return replace(bank, challenger=(Hypothesis(nothing),), age=0, lead=0.0)
        rivals, age, lead = pruned(others, layout, settings), self.age + 1, self.lead
        if age > BURN_IN:
            lead += rivals[0].evidence - kept[0].evidence
        if age < settings.challenge:
            return replace(bank, challenger=tuple(rivals), age=age, lead=lead)
        bank = replace(bank, challenger=(), age=0, lead=0.0)
        if lead <= settings.margin:
            return bank
        old = kept[0].tracks.select(kept[0].tracks.existence > LIKELY)
        named = [each._replace(tracks=inherited(each.tracks, old, layout)) for each in rivals]
        return replace(bank, hypotheses=tuple(named), takeovers=self.takeovers + 1)


def inherited(tracks: Tracks, old: Tracks, layout: StateLayout) -> Tracks:
    """Return tracks with the labels of old ones at their places, the most likely ones first."""
    place = list(layout.position)
    d = tracks.x[:, None][..., place] - old.x[..., place]
    P = (tracks.P[:, None] + old.P)[..., place, :][..., place]
    distance = squared_distances(d, P)
    label = tracks.label.copy()
    for k in np.argsort(-tracks.existence, kind="stable").tolist():
        if old.n_tracks and distance[k].min() < SAME:
            nearest = int(distance[k].argmin())
            label[k] = old.label[nearest]
            distance[:, nearest] = np.inf
    return tracks.relabelled(label)
