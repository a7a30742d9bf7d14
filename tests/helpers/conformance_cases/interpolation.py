"""Conformance cases of the trackers of the interpolation paper."""

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import DelayDrift
from arrivals.scenarios.simulations.sampled_source import (
    InterpolationBand,
    InterpolationScenario,
    InterpolationTone,
)
from arrivals.trackers import MVDR, InterpolationEKF
from arrivals.trackers.conformance import MakeTracker, Measurements

SNAPSHOT = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
CIRCLE = ArraySnapshot(SensorArray.uca(7, radius=0.5), wavelength=1.0, noise=0.1)


def with_gaps(scenario: InterpolationScenario) -> Measurements:
    """Draw a trial with one sample missing, and one snapshot."""
    z = scenario.sample(np.random.default_rng(0)).measurements
    z[5, 2], z[7] = np.nan, np.nan
    return z


def complex_snapshots(model: ArraySnapshot) -> Measurements:
    z = model.simulate(np.full((5, 1), 0.4), 1.0, np.random.default_rng(0))
    z[2, 3] = np.nan
    return z


TONE, BAND = InterpolationTone(n_steps=12), InterpolationBand(n_steps=12, n_sensors=5)
LEARNED = BAND.measurement.replace(power=None)

TRACKERS: list[tuple[str, MakeTracker, Measurements]] = [
    *[
        (
            "interpolation_ekf",
            lambda v=v: InterpolationEKF(TONE.measurement, variant=v, doa=0.9, acquisition=6),
            with_gaps(TONE),
        )
        for v in ("literal", "B", "C", "D", "E2", "phasor")
    ],
    *[
        (
            "interpolation_ekf",
            lambda v=v: InterpolationEKF(
                LEARNED, DelayDrift(1e-8), variant=v, doa=0.9, acquisition=6
            ),
            with_gaps(BAND),
        )
        for v in ("D", "E")
    ],
    ("mvdr", lambda: MVDR(SNAPSHOT), complex_snapshots(SNAPSHOT)),
    ("mvdr", lambda: MVDR(CIRCLE, max_sources=2), complex_snapshots(CIRCLE)),
]
