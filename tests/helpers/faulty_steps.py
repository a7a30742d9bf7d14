"""Trackers with one fault each in their missing data, time steps or control inputs."""

from collections.abc import Callable
from typing import Any

import numpy as np
from faulty_trackers import Smoother
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import Tracker


class UsesMaskedNumbers(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        super().update(z if z is None else np.asarray(z))


PAIR = ArraySnapshot(SensorArray.ula(2, spacing=0.5), wavelength=1.0)


class TakesZerosAsData(Smoother):
    def __init__(self, measurement: ArraySnapshot = PAIR) -> None:
        super().__init__()
        self.measurement = measurement

    def correct(self, z: Any) -> None:
        super().correct(z + 1.0)


class KeepsItsVariance(Smoother):
    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        super().predict(u, dt=dt)
        self.P = self.P - dt * np.eye(2)


class IgnoresItsTimeStep(Smoother):
    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        super().predict(u)


class IgnoresItsControl(Smoother):
    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        super().predict(dt=dt)


STEP_FAULTS: list[tuple[Callable[[], Tracker], str, str]] = [
    (UsesMaskedNumbers, "masked_and_huge_numbers_are_missing", "masked in place of NaN"),
    (TakesZerosAsData, "channel_of_zeros_is_missing", "zero in place of NaN"),
    (TakesZerosAsData, "missing_channel_equals_array_without_it", "shape"),
    (KeepsItsVariance, "estimate_widens_or_ends_in_a_gap", "after 200 missing steps"),
    (IgnoresItsTimeStep, "invalid_time_step_changes_nothing", "predict.dt=nan. was accepted"),
    (IgnoresItsControl, "invalid_control_changes_nothing", "predict.nan. was accepted"),
]
