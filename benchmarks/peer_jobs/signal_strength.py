"""Positions from signal strength beside one fit by scipy."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from arrivals.measurement_models import LogNormalRSS
from arrivals.motion_models import RandomWalk
from arrivals.trackers import RSSVB
from arrivals.typing import Float
from peer_jobs import Job

TRUTH = np.array([[-40.0, 10.0], [30.0, 50.0], [10.0, -60.0]])
U = np.array([9.2, 9.0, 9.1])


def jobs() -> list[Job]:
    """Return the start of a tracker: number and positions of three sources are not known.

    The peer knows the number, and starts 5 m from the truth. The limit of the start is 4 s, where
    such a fit takes 0.85 s.
    """
    n_sensors = 100_000
    rng = np.random.default_rng(0)
    sensors = rng.uniform(-100.0, 100.0, (n_sensors, 2))
    model = LogNormalRSS(sensors, log_noise=4.6, position=(0, 1))
    z = model.draw(U, TRUTH, rng)

    def start() -> object:
        tracker = RSSVB(RandomWalk(q=1.0), model)
        tracker.predict()
        tracker.update(z)
        return tracker.estimate.position

    def residual(parameters: Float) -> Float:
        u, theta = parameters[:3], parameters[3:].reshape(3, 2)
        square = np.maximum(((theta[:, None] - sensors) ** 2).sum(axis=-1), 1.0)
        power = (np.exp(2 * u)[:, None] / square).sum(axis=0) + np.exp(2 * 4.6)
        return np.asarray(0.5 * np.log(power) - z)

    def fit() -> object:
        return least_squares(residual, np.concatenate([U, (TRUTH + 5.0).ravel()])).x[3:]

    name = f"rss start, {n_sensors} sensors, number of sources unknown"
    return [Job(name, start, fit, "scipy, one fit of three sources", 4.7)]
