"""Trackers of signal strength for `test_conformance`."""

from typing import Any

import numpy as np

from arrivals.measurement_models import AveragedEnvelope, LogGains, LogNormalRSS, db_to_neper
from arrivals.motion_models import ConstantVelocity, CoordinatedTurn, RandomWalk
from arrivals.trackers import RSSML, RSSVB, BirthDeath, GridSearch, MAPSolver, VariationalSolver
from arrivals.trackers.conformance import MakeTracker, Measurements

RNG = np.random.default_rng(7)
PLACES = RNG.uniform(-60.0, 60.0, (20, 2))
NOISE = float(db_to_neper(40.0))
STILL = LogNormalRSS(PLACES, log_noise=NOISE, position=(0, 1))
MOVING = LogNormalRSS(
    PLACES, AveragedEnvelope(exact_moments=True), log_noise=NOISE, alpha=2.5, gains=LogGains(0.1)
)
TRUTH = np.array([[-25.0, 10.0], [30.0, -5.0]])
X4 = np.insert(TRUTH + 4.0, [1, 2], 0.0, axis=1)
P4 = np.diag([50.0, 2.0, 50.0, 2.0])


def readings(model: LogNormalRSS) -> Measurements:
    """Return readings of two sources at rest; one is missing, and later all of them."""
    u = db_to_neper([81.0, 79.0])
    rng = np.random.default_rng(8)
    z = np.array([model.draw(u, TRUTH, rng) for _ in range(5)])
    z[1, 4], z[3] = np.nan, np.nan
    return z


WALK, DRIVE = RandomWalk(q=1.0), ConstantVelocity(q=0.1)
START: dict[str, Any] = {"x0": TRUTH + 4.0, "P0": 50.0 * np.eye(2)}
X5 = np.insert(X4, 4, 0.01, axis=1)

TRACKERS: list[tuple[str, MakeTracker, Measurements]] = [
    ("rss_vb", lambda: RSSVB(WALK, STILL, **START), readings(STILL)),
    (
        "rss_vb",
        lambda: RSSVB(
            DRIVE, MOVING, X4, P4, correlation_time=4.0, solver=VariationalSolver(sweep="jacobi")
        ),
        readings(MOVING),
    ),
    (
        "rss_vb",
        lambda: RSSVB(
            CoordinatedTurn(0.1, 0.001), MOVING, X5, np.diag([50.0, 2.0, 50.0, 2.0, 0.01])
        ),
        readings(MOVING),
    ),
    (
        "rss_vb",
        lambda: RSSVB(
            WALK,
            STILL,
            **START,
            solver=VariationalSolver(refresh="literal", covariance="factor", max_iterations=5),
        ),
        readings(STILL),
    ),
    ("rss_vb", lambda: RSSVB(WALK, STILL, search=GridSearch(max_sources=4)), readings(STILL)),
    (
        "rss_vb",
        lambda: RSSVB(DRIVE, MOVING, P0=P4, births=BirthDeath(confirm_steps=2)),
        readings(MOVING),
    ),
    ("rss_ml", lambda: RSSML(WALK, STILL, **START), readings(STILL)),
    (
        "rss_ml",
        lambda: RSSML(DRIVE, MOVING, X4, P4, solver=MAPSolver(method="bfgs", prior=False)),
        readings(MOVING),
    ),
    ("rss_ml", lambda: RSSML(WALK, STILL, n_sources=2), readings(STILL)),
]
