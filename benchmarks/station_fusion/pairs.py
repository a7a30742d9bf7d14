"""Crossings of all pairs, clustered, before a bank of nearest-neighbour Kalman filters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from arrivals.scenarios.simulations.stations import StationsTrial
from arrivals.trackers import PositionEstimate
from arrivals.typing import Float
from station_fusion.draws import Bearings
from station_fusion.intersections import BearingTable, cross, in_area, positions

MIN_SINE, MAX_RESIDUAL = 0.17, 0.01  # of two bearings; rad
RADIUS = 0.03  # of a cluster, of the size
MIN_COUNT = {2: 1, 3: 3, 4: 4}  # crossings of a cluster, by the number of stations
GATE = 9.0
NO_PAIR = 1e6
XY = np.ix_([0, 2], [0, 2])


@dataclass
class Track:
    """A Kalman filter with its hits and successive misses."""

    x: Float
    P: Float
    label: int
    hits: int = 1
    misses: int = 0


class PairClusters:
    """Clusters of crossings of pairs; tracks begin with two hits and end with three misses."""

    def __init__(self, trial: StationsTrial) -> None:
        self.trial, self.tracks, self.n_labels = trial, list[Track](), 0
        self.F, self.Q = trial.motion.F(), trial.motion.Q()

    def step(self, found: list[Bearings]) -> PositionEstimate:
        """Predict, update, and return the tracks with two hits."""
        for track in self.tracks:
            track.x, track.P = self.F @ track.x, self.F @ track.P @ self.F.T + self.Q
        clusters = self._clusters(found)
        pairs = self._assigned(clusters)
        for track in self.tracks:
            track.misses += 1
        for i, j in pairs:
            self._update(self.tracks[i], *clusters[j])
        new = [each for j, each in enumerate(clusters) if j not in {j for _, j in pairs}]
        kept = [t for t in self.tracks if t.misses < 3 and not (t.hits < 2 and t.misses)]
        self.tracks = kept + [self._new(*each) for each in new]
        on = [track for track in self.tracks if track.hits >= 2]
        return positions(
            np.array([track.x[[0, 2]] for track in on]),
            np.array([track.P[XY] for track in on]),
            np.array([track.label for track in on], dtype=np.int64),
        )

    def _clusters(self, found: list[Bearings]) -> list[tuple[Float, Float]]:
        """Return means and covariances of clusters, the largest first."""
        n_on = sum(each is not None for each in found)
        table = BearingTable.of(found)
        crossings = cross(self.trial, table, table.pairs(MIN_SINE), np.inf)
        pair = np.isfinite(table.of_members(table.pairs(MIN_SINE))[1])
        small = (np.abs(np.where(pair, crossings.residual, 0.0)) <= MAX_RESIDUAL).all(axis=1)
        kept = small & in_area(self.trial, crossings.x, 0.0)
        x, W = crossings.x[kept], np.linalg.inv(crossings.covariance[kept])
        near = np.linalg.norm(x[:, None] - x, axis=2) < RADIUS * self.trial.size
        free = np.ones(len(x), dtype=np.bool_)
        clusters = []
        while free.any():
            count = (near & free & free[:, None]).sum(axis=1)
            i = int(count.argmax())
            if count[i] < MIN_COUNT.get(n_on, n_on):
                break
            members = near[i] & free
            C = np.linalg.inv(W[members].sum(axis=0))
            mean = C @ np.einsum("nij,nj->i", W[members], x[members])
            clusters.append((mean, 2 * C * members.sum() / n_on))  # pairs share bearings
            free &= ~members
        return clusters

    def _assigned(self, clusters: list[tuple[Float, Float]]) -> list[tuple[int, int]]:
        cost = np.full((len(self.tracks), len(clusters)), NO_PAIR)
        for i, track in enumerate(self.tracks):
            for j, (mean, C) in enumerate(clusters):
                e = mean - track.x[[0, 2]]
                cost[i, j] = e @ np.linalg.solve(track.P[XY] + C, e)
        cost[cost >= GATE] = NO_PAIR
        rows, columns = linear_sum_assignment(cost)
        return [(i, j) for i, j in zip(rows, columns, strict=True) if cost[i, j] < NO_PAIR]

    def _update(self, track: Track, mean: Float, C: Float) -> None:
        K = np.linalg.solve(track.P[XY] + C, track.P[[0, 2]]).T
        track.x = track.x + K @ (mean - track.x[[0, 2]])
        track.P = track.P - K @ track.P[[0, 2]]
        track.hits, track.misses = track.hits + 1, 0

    def _new(self, mean: Float, C: Float) -> Track:
        P = np.diag([0.0, self.trial.speed_std**2] * 2)
        P[XY] = C
        self.n_labels += 1
        return Track(np.array([mean[0], 0.0, mean[1], 0.0]), P, self.n_labels - 1)
