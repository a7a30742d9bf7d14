"""Files of the package that one warm predict and update enters."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import arrivals
from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import ConstantVelocity
from arrivals.trackers import Kalman, Tracker

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


STEPS: list[tuple[Callable[[], tuple[Tracker, Any]], int]] = [(kalman, 6)]


@pytest.mark.parametrize(("make", "limit"), STEPS)
def test_step_enters_few_files(make: Callable[[], tuple[Tracker, Any]], limit: int) -> None:
    tracker, z = make()
    names = files_entered(tracker, np.asarray(z))
    assert 0 < len(names) <= limit, sorted(names)
