"""Update of tracks by the bearings of one station, with unknown association."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models import Station
from arrivals.measurement_models.station import StationEntries
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.fusion.settings import BearingDetection
from arrivals.trackers.fusion.stations.association import associate
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.typing import Float

GATE = 16.0  # largest d²/S of a bearing and a track
MAX_EXISTENCE = 0.9999
MIN_WEIGHT = 1e-3  # tracks with less weight of bearings are not moved


class StationBearings(NamedTuple):
    """Bearings of one station in a step.

    Parameters
    ----------
    azimuth : ndarray, shape (n_bearings, n_images)
        On the map, rad; a line has two images of each.
    variance : ndarray, shape (n_bearings,)
        rad².
    """

    azimuth: Float
    variance: Float


class StationUpdate(NamedTuple):
    """Tracks after the update by a station.

    Parameters
    ----------
    tracks : Tracks
    unexplained : ndarray, shape (..., n_bearings)
        Probability that each bearing is of none of the tracks.
    log_evidence : ndarray, shape (...)
        Logarithm of the likelihood of the bearings, that of none but false ones being 1.
    """

    tracks: Tracks
    unexplained: Float
    log_evidence: Float


def update_by_station(
    tracks: Tracks,
    bearings: StationBearings,
    station: Station,
    entries: StationEntries,
    detection: BearingDetection,
    s: int,
) -> StationUpdate:
    """Update tracks by the bearings of station `s`, each of one track at most.

    Parameters
    ----------
    tracks : Tracks
        With any leading axes.
    bearings : StationBearings
        Bearings of the step; without any, the tracks were missed.
    station : Station
        Its place on the map.
    entries : StationEntries
        Entries of the state that it reads.
    detection : BearingDetection
    s : int
        Number of the station.

    Returns
    -------
    StationUpdate

    References
    ----------
    Musicki and Evans, "Joint integrated probabilistic data association: JIPDA", IEEE T-AES 40,
    2004; Williams and Lau, "Approximate evaluation of marginal association probabilities with
    belief propagation", IEEE T-AES 50, 2014.

    Examples
    --------
    A bearing of 1 degree, 100 m away, moves a track by half of 1.7 m:

    >>> station, none = Station(None, [0.0, 0.0]), Tracks.empty(2, 1, 1)
    >>> x, P = np.array([[100.0, 0.0]]), np.diag([3.0, 3.0])[None]
    >>> tracks = none._replace(x=x, P=P, existence=np.array([0.9]))
    >>> bearings = StationBearings(np.full((1, 1), np.deg2rad(1.0)), np.array([3e-4]))
    >>> after = update_by_station(
    ...     tracks, bearings, station, StationEntries((0, 1), None), BearingDetection(), 0
    ... )
    >>> after.tracks.x.round(2), after.tracks.existence.round(4)
    (array([[100.  ,   0.87]]), array([0.9995]))
    """
    r = tracks.existence
    # h_i, H_i and v_i = H P H'
    h, H = station.azimuth(tracks.x, entries), station.slope(tracks.x, entries)
    PH = (tracks.P @ H[..., None])[..., 0]
    v = (H * PH).sum(axis=-1)
    # neighbours within the resolution may be one bearing, and pull at it
    apart = wrap(h[..., None, :] - h[..., :, None])
    near = (np.abs(apart) < detection.resolution) * r[..., None, :]
    index = np.arange(r.shape[-1])
    near[..., index, index] = 0.0
    p = detection.p_detect * (1 - 0.5 * np.minimum(near.sum(axis=-1), 1.0))
    v = v + detection.attraction**2 * (near * apart**2).sum(axis=-1)
    # S_ij = v_i + R_j, d_ij = b_j - h_i of the likelier image
    S = v[..., None] + bearings.variance
    d = wrap(bearings.azimuth - h[..., None, None])
    likelihood = np.exp(-0.5 * d * d / S[..., None]).mean(axis=-1) / np.sqrt(2 * np.pi * S)
    if d.shape[-1] > 1:
        d = np.take_along_axis(d, np.abs(d).argmin(axis=-1)[..., None], axis=-1)
    d = d[..., 0]
    rate = (detection.clutter + detection.births) / (2 * np.pi)
    rp, within = r * p, d * d <= GATE * S
    odds = np.where(within, likelihood, 0.0) * (rp / (1 - rp))[..., None] / rate
    beta, log_z = associate(odds)
    # r_i = Σ_j β_ij + miss_i
    weight = beta.sum(axis=-1)
    missed = (1 - weight) * r * (1 - p) / (1 - rp)
    existence = np.minimum(weight + missed, MAX_EXISTENCE)
    # K_j = P H'/S_ij: x = x + Σ w K d, P = P + P H'(Σ w d²/S² - (Σ w d/S)² - Σ w/S) H P
    w = beta / np.maximum(weight + missed, np.finfo(np.float64).tiny)[..., None]
    g = d / S
    mean = (w * g).sum(axis=-1)
    spread = (w * (g * g - 1 / S)).sum(axis=-1) - mean * mean
    moves = weight > MIN_WEIGHT
    mean, spread = np.where(moves, mean, 0.0), np.where(moves, spread, 0.0)
    received = tracks.received.copy()
    received[..., s] = w.sum(axis=-1)
    after = tracks._replace(
        x=tracks.x + mean[..., None] * PH,
        P=tracks.P + (spread[..., None] * PH)[..., None] * PH[..., None, :],
        existence=existence,
        received=received,
    )
    log_evidence = log_z + np.log1p(-rp).sum(axis=-1)
    return StationUpdate(after, 1 - beta.sum(axis=-2), log_evidence)
