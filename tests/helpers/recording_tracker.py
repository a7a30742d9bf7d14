"""A tracker that reports its measurements as directions, for tests of the base classes."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import VonMisesWalk
from arrivals.trackers import DirectionEstimate, Tracker

ARRAY = SensorArray.ula(5, spacing=0.5)
SNAPSHOTS = ArraySnapshot(ARRAY, wavelength=1.0)


class EchoTracker(Tracker):
    """Reports the measurement z as directions, rad."""

    def __init__(self, motion: VonMisesWalk | None = None, inner: Tracker | None = None) -> None:
        self.motion, self.inner = motion, inner
        self.x, self.P = np.zeros(1), np.eye(1)
        self.doa = np.zeros(0)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        self.x = self.x + dt

    def update(self, z: ArrayLike | None) -> None:
        self.doa = np.asarray([] if z is None else z, dtype=float)

    @property
    def estimate(self) -> DirectionEstimate:
        return directions(self.doa)


def directions(doa: ArrayLike, **per_step: Any) -> DirectionEstimate:
    doa = np.asarray(doa, dtype=float)
    label = np.arange(len(doa))
    amplitude = np.asarray(10.0**label, dtype=np.complex128)
    return DirectionEstimate(doa, 0.1 * doa, 0 * doa + 0.5, amplitude, label, **per_step)
