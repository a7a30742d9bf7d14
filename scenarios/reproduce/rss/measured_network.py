"""What the trackers make of a measured network whose transmitters' true positions are known."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from arrivals.measurement_models import LogNormalRSS
from arrivals.motion_models import ConstantVelocity
from arrivals.recordings.network_calibration import Calibration
from arrivals.recordings.networks import Network
from arrivals.trackers import RSSVB
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.inference.map_search import maximum
from arrivals.trackers.rss.inference.variational import VariationalSettings, solve
from arrivals.typing import Float

FLOOR_DB = -97.0  # on which quiet sensors of the shared data sit
GAP = 120.0  # s, after which a track begins anew
POWER_STD = 3 * np.log(10) / 20  # Np


class FramedReadings(NamedTuple):
    """One step of a network: the model with the sensors in place, the readings, and the time."""

    step: int
    model: LogNormalRSS
    z: Float
    time: float


def steps_of(
    network: Network, calibration: Calibration, position: tuple[int, int] = (0, 2)
) -> Iterator[FramedReadings]:
    """Give the steps of a network as a tracker sees them."""
    model = calibration.model(
        np.zeros((len(network.name), 2)), floor_db=FLOOR_DB, position=position
    )
    for step in range(len(network)):
        yield FramedReadings(step, *network.heard(step, model), float(network.time[step]))


def strongest(seen: FramedReadings) -> Float:
    """Return the place of the sensor that hears most, its offset taken off, (2,)."""
    level = np.where(np.isnan(seen.z), -np.inf, seen.z - seen.model.offsets)
    return np.asarray(seen.model.sensors[level.argmax()])


def centre(seen: FramedReadings) -> Float:
    """Return the middle of the sensors that are heard, (2,)."""
    return np.asarray(seen.model.sensors[~np.isnan(seen.z)].mean(axis=0))


def snapshot(
    seen: FramedReadings, calibration: Calibration, theta: Float, method: str = "vb"
) -> Float:
    """Locate transmitters from one step's readings alone.

    Parameters
    ----------
    seen : Seen
    calibration : Calibration
        Tells their power.
    theta : ndarray, shape (n_sources, 2)
        Where the search starts, m.
    method : {"vb", "lm"}

    Returns
    -------
    ndarray, shape (n_sources, 2)
        Positions, m. The prior is that of anywhere among the sensors.
    """
    heard = ~np.isnan(seen.z)
    sensors = seen.model.sensors[heard]
    K = len(theta)
    spread = float(np.sqrt(np.square(sensors - sensors.mean(axis=0)).mean()))
    prior = Prior(
        np.full(K, calibration.log_amplitude),
        np.full(K, 1 / POWER_STD**2),
        np.tile(sensors.mean(axis=0), (K, 1)),
        np.tile(np.eye(2) / spread**2, (K, 1, 1)),
    )
    xi = np.where(heard, seen.model.readings(seen.z), 0.0)
    problem = JointPosterior(seen.model.field, xi, heard / seen.model.variance, prior)
    if method == "lm":
        return maximum(problem, prior.mu, theta).theta
    batch = problem._replace(xi=xi[None], W=problem.W[None], prior=prior.take(None))
    how = VariationalSettings(max_cycles=60, tol_theta=1.0)
    return np.asarray(solve(batch, prior.mu[None], theta[None], how).theta[0])


class Tracked(NamedTuple):
    """Errors over time: distances, m, and normalised squared errors of two degrees of freedom."""

    error: Float
    nees: Float


def track_transmitter(
    network: Network, calibration: Calibration, *, q: float = 0.5, tau: float = 120.0, **params: Any
) -> Tracked:
    """Track one transmitter through a network with `rss_vb`.

    Parameters
    ----------
    network : Network
        With its true positions.
    calibration : Calibration
    q : float
        Of `ConstantVelocity`, m²/s³.
    tau : float
        Correlation time of the shadowing, s.
    **params
        Others of `RSSVB`.
    """
    error, nees = [], []
    tracker, before = None, -np.inf
    for seen in steps_of(network, calibration):
        dt = seen.time - before
        before = seen.time
        if tracker is None or dt > GAP:
            tracker = _started(seen, calibration, q, tau, params)
        else:
            tracker.measurement = seen.model
            tracker.predict(dt=dt)
        tracker.update(seen.z)
        if network.truth is None:
            continue
        estimate = tracker.estimate
        miss = estimate.position[0] - network.truth[seen.step, 0]
        error.append(float(np.hypot(*miss)))
        nees.append(float(miss @ np.linalg.solve(estimate.covariance[0], miss)))
    return Tracked(np.array(error), np.array(nees))


def _started(
    seen: FramedReadings, calibration: Calibration, q: float, tau: float, params: dict[str, Any]
) -> RSSVB:
    """Return a tracker that starts near the strongest sensor, at rest."""
    x, y = strongest(seen) + seen.model.r_min
    return RSSVB(
        ConstantVelocity(q),
        seen.model,
        [[x, 0.0, y, 0.0]],
        np.diag([300.0, 3.0, 300.0, 3.0]) ** 2,
        mu0=calibration.log_amplitude,
        v0=POWER_STD**2,
        correlation_time=tau,
        **params,
    )
