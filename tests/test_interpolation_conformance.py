"""The trackers of the third paper through the checks that every tracker passes."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import DelayDrift
from arrivals.scenarios.interpolation import (
    InterpolationBand,
    InterpolationScenario,
    InterpolationTone,
)
from arrivals.trackers import MVDR, InterpolationEKF
from arrivals.trackers.conformance import CHECKS, Check, MakeTracker, Measurements

SNAPSHOT = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.1)
CIRCLE = ArraySnapshot(SensorArray.uca(7, radius=0.5), wavelength=1.0, noise=0.1)


def spoilt(scenario: InterpolationScenario) -> Measurements:
    """A trial with one sample missing, and one snapshot."""
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
            f"interpolation_ekf-{v}",
            lambda v=v: InterpolationEKF(TONE.measurement, variant=v, doa=0.9, acquisition=6),
            spoilt(TONE),
        )
        for v in ("B", "Bw", "C", "D", "E", "E2", "phasor")
    ],
    *[
        (
            f"interpolation_ekf-{v}-band",
            lambda v=v: InterpolationEKF(
                LEARNED, DelayDrift(1e-8), variant=v, doa=0.9, acquisition=6
            ),
            spoilt(BAND),
        )
        for v in ("C", "D", "E", "E2")
    ],
    ("mvdr", lambda: MVDR(SNAPSHOT), complex_snapshots(SNAPSHOT)),
    ("mvdr-circle", lambda: MVDR(CIRCLE, max_sources=2), complex_snapshots(CIRCLE)),
]


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize(("name", "make", "z"), TRACKERS, ids=[name for name, _, _ in TRACKERS])
def test_conforms(name: str, make: MakeTracker, z: Measurements, check: Check) -> None:
    check(make, z)
