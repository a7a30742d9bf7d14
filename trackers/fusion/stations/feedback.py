"""Bearings of a step at a station, also of tracks that its own tracker does not report."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models import Station
from arrivals.measurement_models.station import StationEntries
from arrivals.motion_models.von_mises import wrap
from arrivals.trackers.fusion.stations.single_step_bearings import (
    DirectionFit,
    StepSnapshots,
    fit_directions,
)
from arrivals.trackers.fusion.tracks import Tracks
from arrivals.typing import Float

SURE = 0.9  # existence of tracks that are passed to the stations
MAX_STD = np.deg2rad(6.0)  # of their azimuths
REACH = np.deg2rad(10.0)  # from a track to a direction of the station's tracker, plus two std
MAX_BEARING_STD = np.deg2rad(10.0)  # of an added direction
MAX_MOVE = 3.0  # of an added direction from its track, over both standard deviations


def expected_directions(
    tracks: Tracks, station: Station, entries: StationEntries
) -> tuple[Float, Float]:
    """Return the directions at a station of sure tracks, (n,), rad, and their variances.

    Parameters
    ----------
    tracks : Tracks
        Of one hypothesis.
    station : Station
    entries : StationEntries
        Entries of the state that it reads.
    """
    sure = tracks.existence > SURE
    x, P = tracks.x[sure], tracks.P[sure]
    H = station.slope(x, entries)
    variance = np.einsum("ki,kij,kj->k", H, P, H)
    narrow = variance < MAX_STD**2
    return station.from_map(station.azimuth(x, entries)[narrow]), variance[narrow]


def unmatched(expected: Float, variance: Float, doa: Float) -> np.ndarray:
    """Return True for expected directions without a reported one nearby, one each.

    Examples
    --------
    >>> unmatched(np.array([0.1, 1.0]), np.full(2, 1e-4), np.array([0.12]))
    array([False,  True])
    """
    if not len(doa) or not len(expected):
        return np.ones(len(expected), dtype=np.bool_)
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(wrap(expected[:, None] - doa))
    row, column = linear_sum_assignment(np.minimum(distance, 1.0))
    is_near = distance[row, column] < REACH + 2 * np.sqrt(variance[row])
    missing = np.ones(len(expected), dtype=np.bool_)
    missing[row[is_near]] = False
    return missing


def guided_fit(step: StepSnapshots, doa: Float, expected: Float, variance: Float) -> DirectionFit:
    """Return the fit of reported directions, and of expected ones that explain the snapshots.

    An added direction is kept if the energy that it explains exceeds that of noise clearly, it
    has not moved away from its track, and its standard deviation is below 10 degrees.

    Parameters
    ----------
    step : StepSnapshots
    doa : ndarray, shape (n,)
        Directions of the station's tracker, rad.
    expected, variance : ndarray, shape (n_tracks,)
        Directions of sure tracks, rad, and their variances, rad².

    Returns
    -------
    DirectionFit

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers.fusion.stations.single_step_bearings import step_snapshots
    >>> model = ArraySnapshot(SensorArray.uca(8, 0.65), wavelength=1.0)
    >>> z = model.steering_vector([0.5, 2.0]).sum(axis=0) + 0.1 * np.exp(1j * np.arange(8) ** 2)
    >>> step = step_snapshots(model, z)
    >>> guided_fit(step, np.array([0.5]), np.array([2.02]), np.array([1e-3])).doa.round(1)
    array([0.5, 2. ])
    """
    missing = unmatched(expected, variance, doa)
    extra, spread = expected[missing], variance[missing]
    if not len(extra) or len(doa) + len(extra) >= step.n_sensors - 1:
        return fit_directions(step, doa)
    start = np.concatenate([doa, extra])
    fit = fit_directions(step, start)
    added = slice(len(doa), None)
    own = np.diagonal(fit.covariance)[added]
    n = step.Y.shape[0] * step.n_snapshots
    least = (n + 4 * np.sqrt(n) + 4) * fit.noise
    keep = fit.explained[added] > least
    keep &= np.abs(wrap(fit.doa[added] - extra)) < MAX_MOVE * np.sqrt(spread + own)
    keep &= own < MAX_BEARING_STD**2
    for k in np.flatnonzero(keep):  # the others may take over a part of what it explains
        without = fit_directions(step, np.delete(start, len(doa) + k))
        keep[k] = without.energy - fit.energy > least
    if keep.all():
        return fit
    return fit_directions(step, np.concatenate([doa, extra[keep]]))
