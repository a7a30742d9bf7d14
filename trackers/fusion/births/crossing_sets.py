"""Sets of bearings from several stations that cross: candidates for new tracks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from arrivals.measurement_models import Station, StationEntries
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.fusion.births.area import Area
from arrivals.trackers.fusion.births.crossings import crossing
from arrivals.trackers.fusion.settings import BearingDetection
from arrivals.trackers.fusion.stations.station_update import StationBearings
from arrivals.typing import Bool, Float, Int

MIN_UNEXPLAINED = 0.3  # probability that a bearing is of no track, for a birth
MIN_ANGLE = np.deg2rad(6.0)  # between two bearings that cross
FIRST_DETECTION = 0.8  # probability that a station with data has a bearing of a new source
MAX_RESIDUAL = 9.0  # squared residual of a bearing, over its variance
MAX_MISFIT = 4.0, 5.0  # sum of these: of one bearing, and for each further one
MAX_GATE = 12.0  # the same of a bearing that may join a set, with the variance of the crossing
MAX_SPREAD = 0.25  # standard deviation of a crossing, over the size of the area
MIN_RANGE = 0.005  # of a crossing from a station of the set, over the size of the area
MARGIN = 0.05  # beyond the area, over its size
PLACE = StationEntries((0, 1), None)  # of a position alone


class Detections(NamedTuple):
    """Bearings of a step as one list; the images of a line's bearing are two entries.

    Parameters
    ----------
    station, bearing : ndarray of int, shape (n_detections,)
        Number of the station, and of the bearing at it.
    azimuth, variance : ndarray, shape (n_detections,)
        On the map, rad, rad².
    active : ndarray of int
        Stations that have data in the step.
    """

    station: Int
    bearing: Int
    azimuth: Float
    variance: Float
    active: Int

    @classmethod
    def of(cls, bearings: Sequence[StationBearings | None]) -> Detections:
        """Return the list of the bearings of all stations; None where there are no data."""
        active = [s for s, each in enumerate(bearings) if each is not None]
        parts = [(s, each) for s, each in enumerate(bearings) if each is not None]
        station = [np.full(each.azimuth.size, s) for s, each in parts]
        bearing = [np.repeat(np.arange(len(b.variance)), b.azimuth.shape[1]) for _, b in parts]
        variance = [np.repeat(each.variance, each.azimuth.shape[1]) for _, each in parts]
        azimuth = [each.azimuth.ravel() for _, each in parts]
        return cls(
            _joined(station, np.int64), _joined(bearing, np.int64), _joined(azimuth, np.float64),
            _joined(variance, np.float64), np.array(active, dtype=np.int64),
        )  # fmt: skip


class CrossingSets(NamedTuple):
    """Sets of bearings, at most one a station.

    Parameters
    ----------
    hypothesis : ndarray of int, shape (n_sets,)
        Hypothesis that the set is a candidate of.
    members : ndarray of int, shape (n_sets, n_stations)
        Detection of each station; -1 for none.
    log_weight : ndarray, shape (n_sets,)
        Log odds of "a new source" against "false bearings".
    position, covariance : ndarray, shape (n_sets, 2), (n_sets, 2, 2)
        Crossing, m, m².
    """

    hypothesis: Int
    members: Int
    log_weight: Float
    position: Float
    covariance: Float

    def select(self, rows: Int | Bool | slice) -> CrossingSets:
        """Return some of the sets."""
        parts: list[Any] = [part[rows] for part in self]
        return CrossingSets(*parts)


class BirthModel(NamedTuple):
    """What the weights of crossings depend on.

    Parameters
    ----------
    stations : tuple of Station
    area : Area
    detection : BearingDetection
    """

    stations: tuple[Station, ...]
    area: Area
    detection: BearingDetection

    def crossing_sets(self, detections: Detections, unexplained: Float) -> CrossingSets:
        """Return the sets of crossing bearings that may be new sources, for each hypothesis.

        Every pair that meets in front of both stations takes from each further station, in their
        order, the bearing that raises its weight most.

        Parameters
        ----------
        detections : Detections
        unexplained : ndarray, shape (n_hypotheses, n_detections)
            Probability that a bearing is of none of the tracks of a hypothesis.

        Returns
        -------
        CrossingSets
            Without duplicates.
        """
        sets = self._scored(*self._pairs(detections, unexplained), detections, unexplained)
        sets = sets.select(np.isfinite(sets.log_weight))
        for s in detections.active:
            if len(sets.members):
                sets = self._grown(sets, int(s), detections, unexplained)
        keys = np.column_stack([sets.hypothesis, sets.members])
        return sets.select(np.unique(keys, axis=0, return_index=True)[1])

    def _pairs(self, detections: Detections, unexplained: Float) -> tuple[Int, Int]:
        """Return hypotheses and members of the pairs that meet in front of both stations."""
        n, place = len(detections.station), self._positions
        first, second = np.triu_indices(n, 1)
        apart = detections.station[first] != detections.station[second]
        first, second = first[apart], second[apart]
        b1, b2 = detections.azimuth[first], detections.azimuth[second]
        base = place[detections.station[second]] - place[detections.station[first]]
        sine = np.sin(b2 - b1)
        with np.errstate(divide="ignore", invalid="ignore"):
            r1 = (base[:, 0] * np.sin(b2) - base[:, 1] * np.cos(b2)) / sine
            r2 = (base[:, 0] * np.sin(b1) - base[:, 1] * np.cos(b1)) / sine
            meets = (np.abs(sine) >= np.sin(MIN_ANGLE)) & (r1 > 0) & (r2 > 0)
        free = unexplained > MIN_UNEXPLAINED
        hypothesis, pair = np.nonzero(free[:, first] & free[:, second] & meets)
        members = np.full((len(pair), len(self.stations)), -1)
        index = np.arange(len(pair))
        for each in (first[pair], second[pair]):
            members[index, detections.station[each]] = each
        return hypothesis, members

    def _grown(
        self, sets: CrossingSets, s: int, detections: Detections, unexplained: Float
    ) -> CrossingSets:
        """Return the sets with the bearing of station `s` that raises the weight most, if any."""
        here = np.flatnonzero(detections.station == s)
        if not len(here):
            return sets
        station = self.stations[s]
        slope = station.slope(sets.position, PLACE)
        spread = np.einsum("si,sij,sj->s", slope, sets.covariance, slope)
        spread = spread + station.position_std**2 * (slope * slope).sum(axis=-1)
        e = wrap(detections.azimuth[here] - station.azimuth(sets.position, PLACE)[:, None])
        S = spread[:, None] + self._variance(detections)[here]
        joins = (e * e < MAX_GATE * S) & (sets.members[:, s] < 0)[:, None]
        joins &= unexplained[sets.hypothesis[:, None], here] > MIN_UNEXPLAINED
        row, j = np.nonzero(joins)
        if not len(row):
            return sets
        members = sets.members[row]
        members[:, s] = here[j]
        larger = self._scored(sets.hypothesis[row], members, detections, unexplained)
        gain = np.full(e.shape, -np.inf)
        gain[row, j] = larger.log_weight
        best, place = gain.argmax(axis=1), np.full(e.shape, -1)
        place[row, j] = np.arange(len(row))
        rises = np.flatnonzero(gain.max(axis=1) > sets.log_weight)
        parts: list[Any] = [part.copy() for part in sets]
        chosen = larger.select(place[rises, best[rises]])
        grown = CrossingSets(*parts)
        for whole, new in zip(grown, chosen, strict=True):
            whole[rises] = new
        return grown

    def _scored(
        self, hypothesis: Int, members: Int, detections: Detections, unexplained: Float
    ) -> CrossingSets:
        """Return sets with their crossings and weights; -inf where a set is refused."""
        if not len(members):
            none = np.zeros(len(members))
            return CrossingSets(hypothesis, members, none, np.zeros((0, 2)), np.zeros((0, 2, 2)))
        is_member, size = members >= 0, self.area.size
        variance = np.where(is_member, self._variance(detections)[members], np.inf)
        azimuth = detections.azimuth[members]
        spread = np.array([station.position_std**2 for station in self.stations])
        x, C, e = crossing(self._positions, azimuth, variance, position_variance=spread)
        d = x[:, None] - self._positions
        square = (d * d).sum(axis=-1)
        with np.errstate(invalid="ignore", divide="ignore"):
            R = variance + spread / square
            misfit = np.where(is_member, e * e / R, 0.0)
            n = is_member.sum(axis=1)
            det = C[:, 0, 0] * C[:, 1, 1] - C[:, 0, 1] ** 2
            half = (C[:, 0, 0] + C[:, 1, 1]) / 2
            largest = half + np.sqrt(np.maximum(half**2 - det, 0.0))
            is_valid = self.area.contains(x, MARGIN) & (misfit <= MAX_RESIDUAL).all(axis=1)
            is_valid &= ~(is_member & (square < (MIN_RANGE * size) ** 2)).any(axis=1)
            is_valid &= misfit.sum(axis=1) <= MAX_MISFIT[0] + MAX_MISFIT[1] * (n - 1)
            is_valid &= largest <= (MAX_SPREAD * size) ** 2
            # ln w = ln(births 2π/area) + ½ ln det C + Σ ln(0.8 left 2π/clutter) + ln N(e; 0, R)
            clutter = self.detection.clutter / (2 * np.pi)
            left = np.where(is_member, unexplained[hypothesis[:, None], members], 1.0)
            each = np.log(FIRST_DETECTION * left / clutter) - 0.5 * (misfit + np.log(2 * np.pi * R))
            weight = np.log(self.detection.births / self.area.square * 2 * np.pi) + 0.5 * np.log(
                det
            )
            weight += np.where(is_member, each, 0.0).sum(axis=1)
        weight += np.log(1 - FIRST_DETECTION) * (len(detections.active) - n)
        return CrossingSets(hypothesis, members, np.where(is_valid, weight, -np.inf), x, C)

    def _variance(self, detections: Detections) -> Float:
        """Return the variances of bearings with the errors of the headings, rad²."""
        heading = np.array([station.heading_std**2 for station in self.stations])
        return np.asarray(detections.variance + heading[detections.station])

    @property
    def _positions(self) -> Float:
        return np.array([station.position for station in self.stations])


def _joined(parts: list[Any], kind: type) -> Any:
    return np.concatenate(parts) if parts else np.zeros(0, dtype=kind)
