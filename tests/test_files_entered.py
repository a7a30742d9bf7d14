"""Files of the package that one warm predict and update enters."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import arrivals
from arrivals.measurement_models import (
    ArraySamples,
    ArraySnapshot,
    LinearMeasurement,
    LogNormalRSS,
    SensorArray,
    Tones,
)
from arrivals.motion_models import ConstantVelocity, RandomWalk
from arrivals.trackers import RSSVB, SVALSE, InterpolationEKF, Kalman, Tracker, WidebandMixture

PACKAGE = Path(arrivals.__file__).parent


def files_entered(tracker: Tracker, z: Any) -> set[str]:
    """Return the files of the package whose functions the third step of a tracker calls."""
    for _ in range(2):
        tracker.predict()
        tracker.update(z)
    names: set[str] = set()

    def note(frame: FrameType, event: str, _: Any) -> None:
        if event == "call":
            names.add(frame.f_code.co_filename)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        tracker.predict()
        tracker.update(z)
    finally:
        sys.setprofile(before)
    folders = {PACKAGE, *(path.resolve() for path in PACKAGE.iterdir() if path.is_dir())}
    return {name for name in names if folders & set(Path(name).resolve().parents)}


def kalman() -> tuple[Tracker, Any]:
    position = LinearMeasurement(np.eye(4)[::2], np.eye(2))
    return Kalman(ConstantVelocity(q=0.1), position, np.zeros(4), np.eye(4)), [1.0, 2.0]


def svalse() -> tuple[Tracker, Any]:
    """31: seven of the array and data, five of the motion, twelve of the solver on any chart."""
    model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0, noise=0.05)
    return SVALSE(model), model.simulate([-0.3, 0.4], [1.0, 1.0j], np.random.default_rng(0))


def wideband_mixture() -> tuple[Tracker, Any]:
    wavelengths = list(np.linspace(1.0, 3.0, 24))
    model = ArraySnapshot(SensorArray.uca(7, radius=0.5), wavelengths, noise=1e-3, n_snapshots=6)
    rng = np.random.default_rng(0)
    return WidebandMixture(model), model.simulate([0.5], rng.exponential(size=(24, 6, 1)) ** 3, rng)


def rss_vb() -> tuple[Tracker, Any]:
    rng = np.random.default_rng(0)
    model = LogNormalRSS(rng.uniform(-60, 60, (40, 2)), log_noise=4.6, position=(0, 1))
    places = np.array([[-25.0, 10.0], [30.0, -5.0]])
    tracker = RSSVB(RandomWalk(q=1.0), model, x0=places + 5.0, P0=100 * np.eye(2))
    return tracker, model.draw([9.2, 9.0], places, rng)


def interpolation_ekf() -> tuple[Tracker, Any]:
    array = SensorArray.ula(10, spacing=0.5, speed=1000.0)
    model = ArraySamples(array, rate=4000.0, correlation=Tones(0.25), snr_db=20.0)
    return InterpolationEKF(model, doa=0.5), np.cos(np.pi / 2 * np.arange(10))


STEPS: list[tuple[Callable[[], tuple[Tracker, Any]], int]] = [
    (kalman, 8),
    (svalse, 31),
    (wideband_mixture, 21),
    (rss_vb, 15),
    (interpolation_ekf, 19),
]


@pytest.mark.parametrize(("make", "limit"), STEPS)
def test_step_enters_few_files(make: Callable[[], tuple[Tracker, Any]], limit: int) -> None:
    tracker, z = make()
    names = files_entered(tracker, np.asarray(z))
    assert 0 < len(names) <= limit, sorted(names)
