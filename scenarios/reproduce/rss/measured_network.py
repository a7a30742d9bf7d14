"""Localization and tracking in a measured network with known transmitter positions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from arrivals.measurement_models import LogNormalRSS
from arrivals.motion_models import ConstantVelocity
from arrivals.recordings.networks import Calibration, Network
from arrivals.trackers import RSSVB, AmplitudePrior, VariationalSolver
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.rss_vb import variational_posterior
from arrivals.typing import Float

FLOOR_DB = -97.0  # noise floor of the shared data
MAX_GAP = 120.0  # s; after a longer gap a new track begins
POWER_STD = 3 * np.log(10) / 20  # of the transmitter, Np


class FramedReadings(NamedTuple):
    """One step of a network: the model with the sensors in place, the readings, and the time."""

    step: int
    model: LogNormalRSS
    z: Float
    time: float


def steps_of(
    network: Network, calibration: Calibration, position: tuple[int, int] = (0, 2)
) -> Iterator[FramedReadings]:
    """Yield the steps of a network with the model of their readings."""
    model = calibration.model(
        np.zeros((len(network.name), 2)), floor_db=FLOOR_DB, position=position
    )
    for step in range(len(network)):
        yield FramedReadings(step, *network.readings_at(step, model), float(network.time[step]))


def strongest(readings: FramedReadings) -> Float:
    """Return the position of the sensor with the largest level without its offset, (2,)."""
    level = np.where(np.isnan(readings.z), -np.inf, readings.z - readings.model.gains.offsets)
    return np.asarray(readings.model.sensors[level.argmax()])


def centre(readings: FramedReadings) -> Float:
    """Return the mean position of the sensors with a reading, (2,)."""
    return np.asarray(readings.model.sensors[~np.isnan(readings.z)].mean(axis=0))


def snapshot(
    readings: FramedReadings, calibration: Calibration, theta: Float, method: str = "vb"
) -> Float:
    """Locate transmitters by the readings of one step.

    Parameters
    ----------
    readings : FramedReadings
    calibration : Calibration
        Its log amplitude is the prior mean.
    theta : ndarray, shape (n_sources, 2)
        Starting point, m.
    method : {"vb", "lm"}

    Returns
    -------
    ndarray, shape (n_sources, 2)
        Positions, m. The prior covers the area of the sensors.
    """
    valid = ~np.isnan(readings.z)
    sensors = readings.model.sensors[valid]
    K = len(theta)
    spread = float(np.sqrt(np.square(sensors - sensors.mean(axis=0)).mean()))
    prior = Prior(
        np.full(K, calibration.log_amplitude),
        np.full(K, 1 / POWER_STD**2),
        np.tile(sensors.mean(axis=0), (K, 1)),
        np.tile(np.eye(2) / spread**2, (K, 1, 1)),
    )
    model = readings.model
    xi = np.where(valid, model.readings(readings.z), 0.0)
    problem = JointPosterior(model.propagation, xi, valid / model.variance, prior)
    if method == "lm":
        return maximize(problem, prior.mu, theta).theta
    solver = VariationalSolver(max_iterations=60, tol_theta=1.0)
    q = variational_posterior(problem.select(None), prior.mu[None], theta[None], solver)
    return np.asarray(q.theta[0])


class TrackErrors(NamedTuple):
    """Errors over time: distances, m, and normalised squared errors of two degrees of freedom."""

    error: Float
    nees: Float


def track_transmitter(
    network: Network, calibration: Calibration, *, q: float = 0.5, tau: float = 120.0, **params: Any
) -> TrackErrors:
    """Track one transmitter through a network with `rss_vb`.

    Parameters
    ----------
    network : Network
        With the true positions of the transmitter.
    calibration : Calibration
    q : float
        Acceleration noise of `ConstantVelocity`, m²/s³.
    tau : float
        Correlation time of the shadowing, s.
    **params
        Other parameters of `RSSVB`.
    """
    error, nees = [], []
    tracker, before = None, -np.inf
    for readings in steps_of(network, calibration):
        dt = readings.time - before
        before = readings.time
        if tracker is None or dt > MAX_GAP:
            tracker = _initial_tracker(readings, calibration, q, tau, params)
        else:
            tracker.measurement = readings.model
            tracker.predict(dt=dt)
        tracker.update(readings.z)
        if network.truth is None:
            continue
        estimate = tracker.estimate
        miss = estimate.position[0] - network.truth[readings.step, 0]
        error.append(float(np.hypot(*miss)))
        nees.append(float(miss @ np.linalg.solve(estimate.covariance[0], miss)))
    return TrackErrors(np.array(error), np.array(nees))


def _initial_tracker(
    readings: FramedReadings, calibration: Calibration, q: float, tau: float, params: dict[str, Any]
) -> RSSVB:
    """Return a tracker that starts near the strongest sensor, at rest."""
    x, y = strongest(readings) + readings.model.r_min
    return RSSVB(
        ConstantVelocity(q),
        readings.model,
        [[x, 0.0, y, 0.0]],
        np.diag([300.0, 3.0, 300.0, 3.0]) ** 2,
        amplitude=AmplitudePrior(mean=calibration.log_amplitude, variance=POWER_STD**2),
        correlation_time=tau,
        **params,
    )
