"""Joint update of the tracks of hypotheses by readings of signal strength."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.signal_strength.path_loss import PropagationModel, slopes
from arrivals.trackers.fusion.state_layout import StateLayout
from arrivals.trackers.fusion.stations.station_update import MAX_EXISTENCE
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.typing import Bool, Float

MIN_EXISTENCE = 0.3  # of tracks that are updated and explain the readings
MAX_LOG_ODDS = 3.0  # nats by which the readings of a step change the odds of a track


class ValidReadings(NamedTuple):
    """Readings of the sensors with data in a step.

    Parameters
    ----------
    xi : ndarray, shape (n_sensors,)
        log σ_y plus noise, Np.
    variance : ndarray, shape (n_sensors,)
        Np².
    propagation : PropagationModel
        Of these sensors.
    """

    xi: Float
    variance: Float
    propagation: PropagationModel


class LevelUpdate(NamedTuple):
    """Tracks after the update by readings, and the log evidence, nats, (n_hypotheses,)."""

    tracks: Tracks
    log_evidence: Float


def update_by_levels(tracks: Tracks, readings: ValidReadings, layout: StateLayout) -> LevelUpdate:
    """Update all likely tracks of each hypothesis together, and their existence.

    Parameters
    ----------
    tracks : Tracks
        One leading axis of hypotheses.
    readings : ValidReadings
    layout : StateLayout
        With a log amplitude.

    Returns
    -------
    LevelUpdate

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (1)-(3), for the readings.
    """
    likely = tracks.existence > MIN_EXISTENCE
    n_hypotheses, K = likely.shape
    n = layout.n
    # S = H P H' + R, with P of all tracks in blocks
    H, predicted = linearized_levels(tracks.x, likely, readings, layout)
    PH = np.einsum("hkij,hkmj->hkim", tracks.P, H)
    parts = np.einsum("hkmi,hkin->hkmn", H, PH)
    R = np.diag(readings.variance)
    S = parts.sum(axis=1) + R
    e = readings.xi - predicted
    weights, log_likelihood = _gaussian(e, S)
    # without track k
    odds_change = np.zeros(likely.shape)
    if K:
        others = likely[:, None] & ~np.eye(K, dtype=np.bool_)
        x = np.broadcast_to(tracks.x[:, None], (n_hypotheses, K, K, n))
        H_without, without = linearized_levels(x, others, readings, layout)
        PH_without = np.einsum("hkij,hlkmj->hlkim", tracks.P, H_without)
        S_without = np.einsum("hlkmi,hlkin->hlmn", H_without, PH_without) + R
        _, each = _gaussian(readings.xi - without, S_without)
        odds_change = np.clip(log_likelihood[:, None] - each, -MAX_LOG_ODDS, MAX_LOG_ODDS)
    odds = tracks.existence / (1 - tracks.existence) * np.exp(odds_change)
    existence = np.where(likely, np.minimum(odds / (1 + odds), MAX_EXISTENCE), tracks.existence)
    # x = x + P H' S⁻¹ e, P = P - P H' S⁻¹ H P, of each block
    x = tracks.x + np.einsum("hkim,hm->hki", PH, weights)
    gain = np.swapaxes(np.linalg.solve(S[:, None], np.swapaxes(PH, -1, -2)), -1, -2)
    P = tracks.P - gain @ np.swapaxes(PH, -1, -2)
    P = (P + np.swapaxes(P, -1, -2)) / 2
    return LevelUpdate(tracks._replace(x=x, P=P, existence=existence), log_likelihood)


def linearized_levels(
    x: Float, likely: Bool, readings: ValidReadings, layout: StateLayout
) -> tuple[Float, Float]:
    """Return Jacobians of log levels, (..., n_tracks, n_sensors, n), and levels (..., n_sensors).

    Parameters
    ----------
    x : ndarray, shape (..., n_tracks, n)
        States.
    likely : ndarray of bool, shape (..., n_tracks)
        Tracks that exist.
    readings : ValidReadings
    layout : StateLayout
    """
    u = np.where(likely, x[..., layout.amplitude], -np.inf)
    levels = readings.propagation.levels(u, x[..., layout.position])
    K = x.shape[-2]
    G = slopes(levels, readings.propagation.alpha)
    H = np.zeros((*x.shape[:-1], G.shape[-2], x.shape[-1]))
    i, j = layout.position
    H[..., layout.amplitude] = np.swapaxes(G[..., :K], -1, -2)
    H[..., i] = np.swapaxes(G[..., K::2], -1, -2)
    H[..., j] = np.swapaxes(G[..., K + 1 :: 2], -1, -2)
    return H, levels.log_sigma


def _gaussian(e: Float, S: Float) -> tuple[Float, Float]:
    """Return S⁻¹ e and -½ (e' S⁻¹ e + ln det S)."""
    solved = np.linalg.solve(S, e[..., None])[..., 0]
    log_det = np.linalg.slogdet(S)[1]
    return solved.astype(np.float64), np.asarray(-0.5 * ((e * solved).sum(axis=-1) + log_det))
