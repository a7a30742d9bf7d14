"""Positions of each step alone: disjoint sets of bearings of least chi-square."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.scenarios.simulations.stations import StationsTrial
from arrivals.trackers import PositionEstimate
from arrivals.trackers.fusion.births.crossings import crossing
from arrivals.typing import Bool, Float, Int
from station_fusion.draws import Bearings

MIN_SINE = 0.1  # of the angle between two bearings
GATE = 9.0  # of e²/R of each bearing
MARGIN = 0.05  # of the size, around the area


class BearingTable(NamedTuple):
    """Bearings of a step, padded: variances are infinite in unused places.

    Parameters
    ----------
    azimuth, variance : ndarray, shape (n_stations, n_largest)
        rad and rad².
    """

    azimuth: Float
    variance: Float

    @classmethod
    def of(cls, step: list[Bearings]) -> BearingTable:
        """Return the table of a step."""
        n = max((len(each[0]) for each in step if each is not None), default=0)
        table = cls(np.zeros((len(step), n)), np.full((len(step), n), np.inf))
        for row, each in enumerate(step):
            if each is not None:
                table.azimuth[row, : len(each[0])] = each[0]
                table.variance[row, : len(each[0])] = each[1]
        return table

    def pairs(self, min_sine: float) -> Int:
        """Return one index of a bearing for each station, -1 for none, of all pairs that cross."""
        n_stations, n = self.azimuth.shape
        used = np.isfinite(self.variance).ravel()
        i, j = np.triu_indices(n_stations * n, 1)
        azimuth = self.azimuth.ravel()
        crosses = np.abs(np.sin(azimuth[i] - azimuth[j])) >= min_sine
        kept = used[i] & used[j] & (i // max(n, 1) != j // max(n, 1)) & crosses
        members = np.full((int(kept.sum()), n_stations), -1)
        rows = np.arange(len(members))
        for each in (i[kept], j[kept]):
            members[rows, each // n] = each % n
        return members

    def of_members(self, members: Int) -> tuple[Float, Float]:
        """Return azimuths and variances of sets (..., n_stations); infinite where not in a set."""
        station, index = np.arange(len(self.azimuth)), np.maximum(members, 0)
        variance = np.where(members >= 0, self.variance[station, index], np.inf)
        return self.azimuth[station, index], variance


class Crossings(NamedTuple):
    """Crossings of sets of bearings."""

    x: Float
    covariance: Float
    chi_square: Float  # infinite for a set that is refused
    residual: Float


def cross(trial: StationsTrial, table: BearingTable, members: Int, gate: float) -> Crossings:
    """Return the crossings of sets (..., n_stations)."""
    azimuth, variance = table.of_members(members)
    positions = np.stack([station.position for station in trial.stations])
    x, C, e = crossing(positions, azimuth, variance)
    squares = np.where(members >= 0, e * e / variance, 0.0)
    fits = (squares <= gate).all(axis=-1) & np.isfinite(x).all(axis=-1)
    return Crossings(x, C, np.where(fits, squares.sum(axis=-1), np.inf), e)


def in_area(trial: StationsTrial, x: Float, margin: float) -> Bool:
    """Return whether positions (..., 2) are in the area, widened by a share of its size."""
    low, high = np.reshape(trial.area, (2, 2)) + margin * trial.size * np.array([[-1], [1]])
    return np.asarray(((x > low) & (x < high)).all(axis=-1))


class Intersections:
    """Sets of bearings of least chi-square in a step, the largest ones first; no memory.

    Every pair is extended by the best bearing of each further station. A set has at least three
    bearings, or as many as there are stations.
    """

    def __init__(self, trial: StationsTrial) -> None:
        self.trial = trial
        self.n_least = 2 if len(trial.stations) < 3 else 3

    def step(self, found: list[Bearings]) -> PositionEstimate:
        """Return the positions of a step."""
        table = BearingTable.of(found)
        sets = table.pairs(MIN_SINE)
        chi = self._cross(table, sets)[2]
        sets, chi = sets[np.isfinite(chi)], chi[np.isfinite(chi)]
        n = table.azimuth.shape[1]
        for station in range(len(found)):
            tried = np.repeat(sets[:, None], n, axis=1)  # (n_sets, n, n_stations)
            tried[:, :, station] = np.arange(n)
            value = self._cross(table, tried)[2] if tried.size else np.full(tried.shape[:2], np.inf)
            value[:, ~np.isfinite(table.variance[station])] = np.inf
            value[sets[:, station] >= 0] = np.inf
            if not value.size:
                continue
            best = value.argmin(axis=1)
            grows = np.isfinite(value.min(axis=1))
            sets[grows, station] = best[grows]
        return self._disjoint(table, sets, sum(each is not None for each in found))

    def _cross(self, table: BearingTable, members: Int) -> tuple[Float, Float, Float]:
        x, C, chi_square, _ = cross(self.trial, table, members, GATE)
        return x, C, np.where(in_area(self.trial, x, MARGIN), chi_square, np.inf)

    def _disjoint(self, table: BearingTable, sets: Int, n_on: int) -> PositionEstimate:
        """Return the crossings of disjoint sets, by size, then chi-square."""
        sets = np.unique(sets, axis=0)
        x, C, chi_square = self._cross(table, sets)
        size = (sets >= 0).sum(axis=1)
        used: set[tuple[int, int]] = set()
        chosen: list[int] = []
        for k in np.lexsort((chi_square, -size)):
            members = {(s, int(j)) for s, j in enumerate(sets[k]) if j >= 0}
            if size[k] >= min(self.n_least, n_on) and not members & used:
                used |= members
                chosen.append(int(k))
        return positions(x[chosen], C[chosen])


def positions(
    x: Float, covariance: Float, label: Int | None = None, existence: Float | None = None
) -> PositionEstimate:
    """Return an estimate of positions (n, 2); existence NaN and labels -1 if None."""
    n = len(x)
    return PositionEstimate(
        x.reshape(n, 2),
        covariance.reshape(n, 2, 2),
        np.full(n, np.nan),
        np.full(n, np.nan) if existence is None else existence,
        np.full(n, -1) if label is None else label,
    )
