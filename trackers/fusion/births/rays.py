"""Births on a bearing that no other station crosses, at the range that signal strength supports."""

from __future__ import annotations

import numpy as np

from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.fusion.births.crossing_sets import FIRST_DETECTION, BirthModel, Detections
from arrivals.trackers.fusion.births.new_tracks import ErrorBelief, start
from arrivals.trackers.fusion.signal_strength import (
    MIN_EXISTENCE,
    ValidReadings,
    linearized_levels,
)
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.typing import Bool, Float, Int

MIN_UNEXPLAINED = 0.6  # probability that the bearing is of no track
MAX_BEARING_STD = np.deg2rad(6.0)
NEAR = np.deg2rad(4.0)  # from a track, plus three standard deviations
POSSIBLE = 0.1  # existence of such tracks
RANGES = np.geomspace(0.03, 1.2, 30)  # over the size of the area
MIN_RANGE, MIN_RANGE_STD = 0.02, 0.03  # of a new track, over the size
EXISTENCE = 0.2, 0.5  # least and largest of a new track


def free_bearings(
    tracks: Tracks, detections: Detections, unexplained: Float, used: Bool,
    layout: StateLayout, model: BirthModel,
) -> Int:  # fmt: skip
    """Return the detections that neither a track nor a crossing of a hypothesis explains."""
    free = ~used & (unexplained >= MIN_UNEXPLAINED)
    free &= detections.variance <= MAX_BEARING_STD**2
    x = tracks.x[tracks.existence > POSSIBLE]
    for s, station in enumerate(model.stations):
        here = free & (detections.station == s)
        if here.any() and len(x):
            d = detections.azimuth[:, None] - station.azimuth(x, layout.of_station(s))
            far = np.abs(wrap(d)) >= (3 * np.sqrt(detections.variance) + NEAR)[:, None]
            free &= ~here | far.all(axis=1)
    return np.flatnonzero(free)


def tracks_on_rays(
    tracks: Tracks, rows: Int, readings: ValidReadings, detections: Detections,
    unexplained: Float, layout: StateLayout, model: BirthModel,
) -> Tracks:  # fmt: skip
    """Return tracks on bearings, at the mean range of those that the readings support.

    Parameters
    ----------
    tracks : Tracks
        Of one hypothesis.
    rows : ndarray of int
        Detections from `free_bearings`.
    readings : ValidReadings
    detections : Detections
    unexplained : ndarray, shape (n_detections,)
    layout : StateLayout
    model : BirthModel

    Returns
    -------
    Tracks
        With the label -1.
    """
    size, n_stations = model.area.size, len(model.stations)
    azimuth, variance = detections.azimuth[rows], detections.variance[rows]
    direction = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    origin = np.array([model.stations[s].position for s in detections.station[rows]])
    origin = origin.reshape(-1, 2)
    r = RANGES * size
    place = origin[:, None] + r[:, None] * direction[:, None]
    log_ratio = _log_ratio(tracks, place, readings, layout)
    log_ratio = np.where(model.area.contains(place, 0.0), log_ratio, -np.inf)
    top = log_ratio.max(axis=1)
    possible = np.isfinite(top)
    relative = np.exp(log_ratio - np.where(possible, top, 0.0)[:, None])
    # ranges are as likely as their area: weights times r
    w = relative * r
    w /= np.maximum(w.sum(axis=1, keepdims=True), np.finfo(np.float64).tiny)
    mean = (w * r).sum(axis=1)
    std = np.sqrt((w * (r - mean[:, None]) ** 2).sum(axis=1))
    std = np.maximum(std, MIN_RANGE_STD * size)
    with np.errstate(divide="ignore"):
        odds = (
            model.detection.births * FIRST_DETECTION * unexplained[rows] / model.detection.clutter
        )
        gain = top + np.log(relative.mean(axis=1) * odds)
    existence = np.minimum(1 / (1 + np.exp(-np.clip(gain, -30, 30))), EXISTENCE[1])
    keep = possible & (existence >= EXISTENCE[0]) & (mean >= MIN_RANGE * size)
    across = np.stack([-direction[:, 1], direction[:, 0]], axis=-1)
    C = _outer(direction, std**2) + _outer(across, variance * mean**2)
    center = origin + mean[:, None] * direction
    x, P = start(center[keep], C[keep], ErrorBelief.best_of(tracks, layout), layout)
    n = int(keep.sum())
    new = Tracks.empty(layout.n, n_stations, n) if n else Tracks.empty(layout.n, n_stations)
    received = new.received.copy()
    received[np.arange(n), detections.station[rows][keep]] = 1.0
    return new._replace(x=x, P=P, existence=existence[keep], received=received)


def _log_ratio(tracks: Tracks, place: Float, readings: ValidReadings, layout: StateLayout) -> Float:
    """Return log likelihood ratios of a source at places (..., 2) against none, (...)."""
    likely = tracks.existence > MIN_EXISTENCE
    known = tracks.x[likely]
    amplitude = layout.amplitude
    added = np.empty((*place.shape[:-1], layout.n))
    added[...] = layout.mean
    added[..., layout.position] = place
    x = np.empty((*place.shape[:-1], len(known) + 1, layout.n))
    x[..., :-1, :], x[..., -1, :] = known, added
    H, level = linearized_levels(x, np.ones(x.shape[:-1], dtype=np.bool_), readings, layout)
    _, without = linearized_levels(known, np.ones(len(known), dtype=np.bool_), readings, layout)
    # S = R + σ_u² h h', by the lemma of Sherman and Morrison
    h, R = H[..., -1, :, amplitude], readings.variance
    e, e0 = readings.xi - level, readings.xi - without
    variance = layout.variance[amplitude]
    gain = 1 + variance * (h * h / R).sum(axis=-1)
    misfit = (e * e / R).sum(axis=-1) - variance * (h * e / R).sum(axis=-1) ** 2 / gain
    return np.asarray(0.5 * ((e0 * e0 / R).sum() - misfit - np.log(gain)))


def _outer(direction: Float, variance: Float) -> Float:
    return np.asarray(variance[:, None, None] * direction[:, :, None] * direction[:, None, :])
