"""Tracks that start at crossings of bearings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.fusion.births.crossing_sets import BirthModel, CrossingSets, Detections
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.typing import Float, Int

MIN_EXISTENCE = 0.05  # of a new track
MAX_EXISTENCE = 0.99
MAX_OF_PAIR = 0.45, 0.6  # of a crossing of two bearings: with more stations active, with two
WIDER = 400.0  # variance of a start over that of its crossing, before the errors are updated
KNOWN = 0.9  # existence of tracks whose estimates of the errors are used
MIN_VARIANCE = 1e-12


class ErrorBelief(NamedTuple):
    """Mean and covariance of the errors of the stations, (n_errors,), (n_errors, n_errors)."""

    mean: Float
    covariance: Float

    @classmethod
    def best_of(cls, tracks: Tracks, layout: StateLayout) -> ErrorBelief:
        """Return those of the track that knows them best, or the prior ones."""
        first = layout.first_error
        prior = layout.variance[first:]
        known = np.flatnonzero(tracks.existence > KNOWN)
        if not len(known) or not len(prior):
            return cls(layout.mean[first:], np.diag(prior))
        P = tracks.P[known, first:, first:]
        spread = P.diagonal(axis1=-2, axis2=-1) / np.maximum(prior, MIN_VARIANCE)
        best = known[spread.sum(axis=-1).argmin()]
        return cls(tracks.x[best, first:], tracks.P[best, first:, first:])


def existence_of(sets: CrossingSets, n_active: int) -> Float:
    """Return the probabilities that sets of bearings are sources, (n_sets,).

    Examples
    --------
    >>> one = np.zeros(1)
    >>> pair = CrossingSets(one, np.array([[0, 1, -1]]), one + 9, np.zeros((1, 2)), one)
    >>> existence_of(pair, n_active=3)
    array([0.45])
    """
    r = 1 / (1 + np.exp(-np.clip(sets.log_weight, -30, 30)))
    is_pair = (sets.members >= 0).sum(axis=1) == 2
    limit = MAX_OF_PAIR[0] if n_active > 2 else MAX_OF_PAIR[1]
    return np.asarray(np.minimum(np.where(is_pair, np.minimum(r, limit), r), MAX_EXISTENCE))


def new_tracks(
    sets: CrossingSets, label: Int, known: ErrorBelief, layout: StateLayout, model: BirthModel,
    detections: Detections,
) -> Tracks:  # fmt: skip
    """Return a track for each set of bearings whose existence is not below 0.05.

    Parameters
    ----------
    sets : CrossingSets
        Of one hypothesis.
    label : ndarray of int, shape (n_sets,)
        Labels of the tracks.
    known : ErrorBelief
        Errors of the stations.
    layout : StateLayout
    model : BirthModel
    detections : Detections

    Returns
    -------
    Tracks
    """
    r = existence_of(sets, len(detections.active))
    likely = r >= MIN_EXISTENCE
    sets, label, r = sets.select(likely), label[likely], r[likely]
    x, P = start(sets.position, sets.covariance, known, layout)
    if len(known.mean):
        place = np.ix_(layout.position, layout.position)
        P[:, place[0], place[1]] *= WIDER
        n_stations = len(model.stations)
        for s in (*range(1, n_stations), 0):  # another order changes deviations by up to 0.5 %
            station, entries, j = model.stations[s], layout.of_station(s), sets.members[:, s]
            # one Kalman step a member correlates the place with the errors of the stations
            H = np.where((j >= 0)[:, None], station.slope(x, entries), 0.0)
            PH = (P @ H[..., None])[..., 0]
            S = (H * PH).sum(axis=-1) + detections.variance[j]
            d = wrap(detections.azimuth[j] - station.azimuth(x, entries))
            x = x + PH * (d / S)[:, None]
            P = P - PH[:, :, None] * PH[:, None, :] / S[:, None, None]
    n = len(r)
    received = (sets.members >= 0).astype(np.float64)
    return Tracks(x, P, r, label, np.zeros(n, dtype=np.int64), received)


def start(
    position: Float, covariance: Float, known: ErrorBelief, layout: StateLayout
) -> tuple[Float, Float]:
    """Return states (..., n) and covariances (..., n, n) of new tracks at positions."""
    n, first = layout.n, layout.first_error
    x = np.empty((*position.shape[:-1], n))
    x[...] = layout.mean
    P = np.zeros((*x.shape, n))
    P[...] = np.diag(layout.variance)
    x[..., layout.position] = position
    i, j = layout.position
    P[..., i, i], P[..., j, j] = covariance[..., 0, 0], covariance[..., 1, 1]
    P[..., i, j] = P[..., j, i] = covariance[..., 0, 1]
    x[..., first:], P[..., first:, first:] = known.mean, known.covariance
    return x, P
