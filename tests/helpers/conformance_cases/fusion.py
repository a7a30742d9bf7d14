"""Tracker of several stations for `test_conformance`."""

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray, Station
from arrivals.motion_models import ConstantVelocity, CoordinatedTurn
from arrivals.trackers import Fused, GlobalHypotheses
from arrivals.trackers.conformance import MakeTracker, Measurements

PLACES = np.array([[0.0, 0.0], [1000.0, 0.0], [500.0, 900.0]])
HEADINGS = (0.3, -1.0, 2.0)
TRUTH = np.array([[400.0, 300.0], [650.0, 500.0]])
MODEL = ArraySnapshot(SensorArray.uca(8, radius=0.65), 1.0, noise=0.01, n_snapshots=5)
LINE = ArraySnapshot(SensorArray.ula(8, spacing=0.5), 1.0, noise=0.01, n_snapshots=5)


def stations(model: ArraySnapshot, heading_std: float = 0.0) -> list[Station]:
    return [
        Station(model, place, heading, heading_std=heading_std)
        for place, heading in zip(PLACES, HEADINGS, strict=True)
    ]


def snapshots(model: ArraySnapshot) -> Measurements:
    """Return snapshots of two sources at rest; a sensor is missing, later a station, later all."""
    rng = np.random.default_rng(4)
    steps = []
    for _ in range(6):
        step = []
        for station in stations(model):
            d = TRUTH - station.position
            doa = station.from_map(np.arctan2(d[:, 1], d[:, 0]))
            amplitude = rng.standard_normal((5, 2)) + 1j * rng.standard_normal((5, 2))
            step.append(model.simulate(doa, amplitude, rng))
        steps.append(step)
    z = np.array(steps)
    z[1, 0, :, 3], z[2, 1], z[4] = np.nan, np.nan, np.nan
    return z


TRACKERS: list[tuple[str, MakeTracker, Measurements]] = [
    ("fused", lambda: Fused(ConstantVelocity(q=0.05), stations(MODEL)), snapshots(MODEL)),
    (
        "fused",
        lambda: Fused(
            CoordinatedTurn(0.05, 1e-4),
            stations(LINE, heading_std=0.01),
            "valse",
            hypotheses=GlobalHypotheses(challenge=2),
            feedback=False,
        ),
        snapshots(LINE),
    ),
]
