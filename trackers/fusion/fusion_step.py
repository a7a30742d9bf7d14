"""Prediction and update of all hypotheses: bearings, births, signal strength, challenger."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models import Station
from arrivals.trackers.fusion.births.area import Area
from arrivals.trackers.fusion.births.crossing_sets import BirthModel, Detections
from arrivals.trackers.fusion.births.initiation import Initiation, Labels, initiate
from arrivals.trackers.fusion.births.rays import free_bearings, tracks_on_rays
from arrivals.trackers.fusion.hypotheses import Bank, Hypothesis, tidied
from arrivals.trackers.fusion.settings import BearingDetection, GlobalHypotheses
from arrivals.trackers.fusion.signal_strength import ValidReadings, update_by_levels
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.trackers.fusion.stations.station_update import StationBearings, update_by_station
from arrivals.trackers.fusion.tracks import stacked, unstacked
from arrivals.typing import Float

OUTSIDE = 0.1  # beyond the area, over its size; the existence of tracks farther out is halved


@dataclass(frozen=True, eq=False)
class FusionModel:
    """Models and settings of a step.

    Parameters
    ----------
    stations : tuple of Station
    layout : StateLayout
    area : Area
    detection : BearingDetection
    settings : GlobalHypotheses
    """

    stations: tuple[Station, ...]
    layout: StateLayout
    area: Area
    detection: BearingDetection
    settings: GlobalHypotheses

    @property
    def births(self) -> BirthModel:
        """What the weights of new crossings depend on."""
        return BirthModel(self.stations, self.area, self.detection)


def predicted_bank(bank: Bank, model: FusionModel, dt: float) -> Bank:
    """Return the hypotheses after `dt`.

    Parameters
    ----------
    bank : Bank
    model : FusionModel
    dt : float
        Time step.
    """
    sizes = [h.tracks.n_tracks for h in bank.every]
    tracks = stacked([h.tracks for h in bank.every])
    # x = f(x), P = F P F' + Q, r = p_S r
    x, P = model.layout.predicted(tracks.x, tracks.P, dt)
    inside = model.area.contains(x[..., model.layout.position], OUTSIDE)
    r = tracks.existence * model.detection.p_survive**dt * np.where(inside, 1.0, 0.5)
    received = np.zeros_like(tracks.received)
    moved = tracks._replace(x=x, P=P, existence=r, received=received)
    return bank.with_tracks(unstacked(moved, sizes))


def fused_step(
    bank: Bank,
    found: Sequence[StationBearings | None],
    readings: ValidReadings | None,
    model: FusionModel,
    labels: Labels,
) -> Bank:
    """Return the hypotheses after an update by bearings of the stations, and by readings.

    Parameters
    ----------
    bank : Bank
    found : sequence of (StationBearings or None)
        One a station; None where it has no data.
    readings : ValidReadings or None
    model : FusionModel
    labels : Labels
        Of new tracks.

    Returns
    -------
    Bank
    """
    own = len(bank.hypotheses)
    moved, unexplained = by_stations(bank.every, found, model)
    detections = Detections.of(found)
    begun = initiate(
        moved, unexplained, detections, model.births, model.layout, model.settings, labels, own
    )
    if readings is not None:
        begun = by_readings(begun, readings, detections, unexplained, model, labels)
    layout, size = model.layout, model.area.size
    after: tuple[list[Hypothesis], list[Hypothesis]] = ([], [])
    for each in begun:
        tracks = tidied(each.hypothesis.tracks, layout, size)
        after[each.row >= own].append(each.hypothesis._replace(tracks=tracks))
    return bank.stepped(*after, layout, model.settings)


def by_stations(
    hypotheses: Sequence[Hypothesis], found: Sequence[StationBearings | None], model: FusionModel
) -> tuple[list[Hypothesis], Float]:
    """Update hypotheses by the bearings of all stations, one after the other.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
    found : sequence of (StationBearings or None)
    model : FusionModel

    Returns
    -------
    hypotheses : list of Hypothesis
    unexplained : ndarray, shape (n_hypotheses, n_detections)
        Probability that each bearing, as `Detections` lists them, is of none of the tracks.
    """
    batch, n = stacked([h.tracks for h in hypotheses]), len(hypotheses)
    evidence, left = np.zeros(n), [np.zeros((n, 0))]
    for s, bearings in enumerate(found):
        if bearings is None:
            continue
        batch, unexplained, gain = update_by_station(
            batch, bearings, model.stations[s], model.layout.of_station(s), model.detection, s
        )
        evidence = evidence + gain
        left.append(np.repeat(unexplained, bearings.azimuth.shape[1], axis=-1))
    tracks = unstacked(batch, [h.tracks.n_tracks for h in hypotheses])
    moved = [
        h._replace(tracks=t, evidence=0.0).gained(float(gain))
        for h, t, gain in zip(hypotheses, tracks, evidence, strict=True)
    ]
    return moved, np.concatenate(left, axis=-1)


def by_readings(
    begun: Sequence[Initiation],
    readings: ValidReadings,
    detections: Detections,
    unexplained: Float,
    model: FusionModel,
    labels: Labels,
) -> list[Initiation]:
    """Update hypotheses with their births by readings; start tracks on bearings left over.

    Parameters
    ----------
    begun : sequence of Initiation
    readings : ValidReadings
    detections : Detections
    unexplained : ndarray, shape (n_hypotheses, n_detections)
    model : FusionModel
    labels : Labels

    Returns
    -------
    list of Initiation
    """
    sizes = [each.hypothesis.tracks.n_tracks for each in begun]
    batch = stacked([each.hypothesis.tracks for each in begun])
    updated, evidence = update_by_levels(batch, readings, model.layout)
    after = []
    for each, tracks, gain in zip(begun, unstacked(updated, sizes), evidence, strict=True):
        left = unexplained[each.row]
        rows = free_bearings(tracks, detections, left, each.used, model.layout, model.births)
        if len(rows) and tracks.n_tracks < model.settings.max_tracks:
            new = tracks_on_rays(
                tracks, rows, readings, detections, left, model.layout, model.births
            )
            new = new.select(slice(model.settings.max_tracks - tracks.n_tracks))
            numbered = np.array([labels.new() for _ in range(new.n_tracks)], dtype=np.int64)
            tracks = tracks.joined(new.relabelled(numbered))
        after.append(
            each._replace(hypothesis=each.hypothesis._replace(tracks=tracks).gained(float(gain)))
        )
    return after
