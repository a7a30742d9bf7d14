"""A valid tracker, and variants with one fault each that a conformance check finds."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurements import is_missing, real_numbers
from arrivals.motion_models import BernoulliVonMises
from arrivals.trackers import DirectionEstimate, Run, Tracker
from arrivals.validation import no_control, time_step


class Smoother(Tracker):
    """A valid tracker: exponential mean of measurements (2,), reported as one direction."""

    def __init__(self, gain: float = 0.5, motion: BernoulliVonMises | None = None) -> None:
        if not 0 < gain <= 1:
            raise ValueError(f"gain must lie in (0, 1]; got {gain}")
        self.gain, self.motion = gain, motion
        self.x, self.P = np.zeros(2), np.eye(2)
        self.label = np.zeros(1, dtype=np.int64)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        no_control(u)
        self.P = self.P + time_step(dt) * np.eye(2)

    def update(self, z: ArrayLike | None) -> None:
        if is_missing(z):
            return
        z = real_numbers("z", z)
        if z.shape != (2,):
            raise ValueError(f"z must have shape (2,); got {z.shape}")
        self.correct(np.where(np.isnan(z), self.x, z) if np.isnan(z).any() else z)

    def correct(self, z: Any) -> None:
        self.x = self.x + self.gain * (z - self.x)
        self.P = (1 - self.gain) * self.P

    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        return DirectionEstimate(self.x[:1].copy(), one, one, np.ones(1, complex), self.label)


class WritesIntoItsArrays(Smoother):
    def correct(self, z: Any) -> None:
        self.x += self.gain * (z - self.x)


class WritesIntoTheMeasurement(Smoother):
    def correct(self, z: Any) -> None:
        z -= self.x
        self.x = self.x + self.gain * z


class KeepsTheMeasurement(Smoother):
    def correct(self, z: Any) -> None:
        self.x = z


class CountsInAGlobal(Smoother):
    calls = 0

    def correct(self, z: Any) -> None:
        CountsInAGlobal.calls += 1
        self.x = self.x + z / CountsInAGlobal.calls


class ChangesBeforeItChecks(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        self.P = self.P / 2 if z is not None else self.P
        super().update(z)


class AcceptsText(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        if not isinstance(z, str):
            super().update(z)


class RaisesKeyError(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        if isinstance(z, str):
            raise KeyError(z)
        super().update(z)


class AcceptsUnnamedParameters(Smoother):
    def __init__(self, gain: float = 0.5, **others: Any) -> None:
        super().__init__(gain)


class RenamesItsParameter(Smoother):
    def __init__(self, alpha: float = 0.5) -> None:
        super().__init__(alpha)


class HalvesItsParameter(Smoother):
    def __init__(self, gain: float = 0.5) -> None:
        super().__init__(gain)
        self.gain = gain / 2


class ResetsOnSetParams(Smoother):
    def set_params(self, **params: Any) -> "ResetsOnSetParams":
        super().set_params(**params)
        self.x = np.zeros(2)
        return self


class IgnoresUnknownNames(Smoother):
    def set_params(self, **params: Any) -> "IgnoresUnknownNames":
        return super().set_params(**{k: v for k, v in params.items() if k == "gain"})


class SetsBeforeItChecks(Smoother):
    def set_params(self, **params: Any) -> "SetsBeforeItChecks":
        self.x = self.x + 1e-9
        return super().set_params(**params)


class ChangesWhenMissing(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        super().update(z)
        if z is None:
            self.P = 2 * self.P


class AddsNaN(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        if z is not None and np.ndim(z) == 1:
            self.correct(z)
        else:
            super().update(z)


class NegativeVariance(Smoother):
    def correct(self, z: Any) -> None:
        self.P = np.diag([1.0, -1e-3])


class AsymmetricCovariance(Smoother):
    def correct(self, z: Any) -> None:
        self.P = np.array([[1.0, 0.1], [0.0, 1.0]])


class ComplexMean(Smoother):
    def correct(self, z: Any) -> None:
        self.x = z + 0j


class GrowsItsState(Smoother):
    def correct(self, z: Any) -> None:
        self.x, self.P = np.zeros(3), np.eye(3)


class CannotBePickled(Smoother):
    def correct(self, z: Any) -> None:
        super().correct(z)
        self.squared = lambda: z**2


class PickleLosesTheMean(Smoother):
    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"x": np.zeros(2)}

    def __deepcopy__(self, memo: Any) -> "PickleLosesTheMean":
        copied = PickleLosesTheMean(self.gain)
        copied.x, copied.P = self.x, self.P
        return copied


class CopiesAreAliases(Smoother):
    def __deepcopy__(self, memo: Any) -> "CopiesAreAliases":
        return self


class RunsFromScratch(Smoother):
    def run(self, measurements: Any, dt: float = 1.0) -> Run:
        self.x, self.P = np.ones(2), np.eye(2)
        return super().run(measurements, dt)


class BatchMovesTheTracker(Smoother):
    def run_batch(self, measurements: Any, dt: float = 1.0) -> list[Run]:
        return [self.run(sequence, dt) for sequence in measurements]


class DropsTheLastOfABatch(Smoother):
    def run_batch(self, measurements: Any, dt: float = 1.0) -> list[Run]:
        return super().run_batch(measurements, dt)[:-1]


class RepeatsALabel(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        two = np.ones(2)
        return DirectionEstimate(two, two, two, np.ones(2, complex), np.zeros(2, dtype=np.int64))


class ExistenceAboveOne(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        return DirectionEstimate(one, one, 1.2 * one, np.ones(1, complex), self.label)


class FieldsDiffer(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        return DirectionEstimate(one, one, np.ones(2), np.ones(1, complex), self.label)


class OtherKind(DirectionEstimate):
    pass


class ChangesKind(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        kind = OtherKind if self.x.any() else DirectionEstimate
        return kind(one, one, one, np.ones(1, complex), self.label, noise=0.0)


class MutableEstimate(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        return MutableDirectionEstimate(one, one, one, np.ones(1, complex), self.label)


class MutableDirectionEstimate(DirectionEstimate):
    def __setattr__(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)


class DirectionUnknown(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        return DirectionEstimate(np.nan * one, one, one, np.ones(1, complex), self.label)


class HalfARow(DirectionEstimate):
    def rows(self) -> list[tuple[Any, ...]]:
        return [row[:2] for row in super().rows()]


class WritesHalfARow(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        return HalfARow(one, one, one, np.ones(1, complex), self.label)


class ReplacesItsModel(Smoother):
    def correct(self, z: Any) -> None:
        super().correct(z)
        self.motion = BernoulliVonMises(kappa=3.0)


class HasSlowProperty(Smoother):
    @property
    def gain_matrix(self) -> Any:
        if not self.x.any():
            raise AttributeError("not yet")
        return np.eye(2)


class KeepsARaggedHistory(Smoother):
    def correct(self, z: Any) -> None:
        super().correct(z)
        self.history = [*getattr(self, "history", []), z]


class NotJSON(Smoother):
    def to_dict(self) -> dict[str, Any]:
        return super().to_dict() | {"gain": {0.5}}


class DropsAParameter(Smoother):
    def to_dict(self) -> dict[str, Any]:
        return {"type": super().to_dict()["type"]}


class CannotBeCloned(Smoother):
    def __init__(self, gain: float = 0.5, places: Any = (0.0,)) -> None:
        super().__init__(gain)
        self.places = np.array(places)  # a copy: sklearn requires the argument itself


NUMBERS = np.random.default_rng(0).normal(size=(4, 2))
FAULTS: list[tuple[Callable[[], Tracker], str, str]] = [
    (WritesIntoItsArrays, "earlier_results_are_not_modified", "half step.*x"),
    (WritesIntoTheMeasurement, "measurement_is_neither_modified_nor_kept", "measurement 1: "),
    (KeepsTheMeasurement, "measurement_is_neither_modified_nor_kept", "array was reused"),
    (CountsInAGlobal, "same_input_gives_same_output", "step 0 .*x"),
    (
        ChangesBeforeItChecks,
        "invalid_measurement_changes_nothing",
        "value too many.*P|P.*became",
    ),
    (AcceptsText, "invalid_measurement_changes_nothing", "text was accepted"),
    (RaisesKeyError, "invalid_measurement_changes_nothing", "raised KeyError"),
    (AcceptsUnnamedParameters, "constructor_accepts_its_parameters", "must name its parameters"),
    (RenamesItsParameter, "constructor_accepts_its_parameters", "no attribute 'alpha'"),
    (HalvesItsParameter, "constructor_accepts_its_parameters", "gain: 0.25 became 0.125"),
    (ResetsOnSetParams, "setting_own_parameters_changes_nothing", "after set_params"),
    (IgnoresUnknownNames, "unknown_parameter_is_refused", "no_such_parameter=1. was accepted"),
    (SetsBeforeItChecks, "unknown_parameter_is_refused", "after set_params"),
    (ChangesWhenMissing, "missing_measurement_keeps_belief", "update.None.*P"),
    (AddsNaN, "missing_measurement_keeps_belief", "nan"),
    (NegativeVariance, "belief_has_mean_and_covariance", "negative eigenvalue -0.001"),
    (AsymmetricCovariance, "belief_has_mean_and_covariance", "not symmetric"),
    (ComplexMean, "belief_has_mean_and_covariance", "array of floats"),
    (GrowsItsState, "belief_has_mean_and_covariance", "shapes"),
    (CannotBePickled, "pickled_tracker_continues_like_the_original", "raised"),
    (PickleLosesTheMean, "pickled_tracker_continues_like_the_original", "after pickling"),
    (CopiesAreAliases, "deep_copy_is_independent", "after steps of its copy|after copying"),
    (RunsFromScratch, "run_equals_the_predict_update_loop", "x of step 0"),
    (BatchMovesTheTracker, "batch_equals_single_runs", "after run_batch"),
    (DropsTheLastOfABatch, "batch_equals_single_runs", "number of runs"),
    (RepeatsALabel, "estimate_is_a_frozen_record", "must be unique"),
    (ExistenceAboveOne, "estimate_is_a_frozen_record", r"existence must lie in \[0, 1\]"),
    (FieldsDiffer, "estimate_is_a_frozen_record", "differ in length"),
    (ChangesKind, "estimate_is_a_frozen_record", "DirectionEstimate.* became .*OtherKind"),
    (MutableEstimate, "estimate_is_a_frozen_record", "MutableDirectionEstimate is not frozen"),
    (DirectionUnknown, "estimate_is_a_frozen_record", "doa must be finite"),
    (WritesHalfARow, "estimate_is_a_frozen_record", "row"),
    (ReplacesItsModel, "models_are_not_modified", "motion was replaced"),
    (HasSlowProperty, "filterpy_saver_works", "not yet"),
    (KeepsARaggedHistory, "filterpy_saver_works", "could not convert|history"),
    (NotJSON, "configuration_survives_json", "not JSON serializable"),
    (DropsAParameter, "configuration_survives_json", "the rebuilt one"),
    (CannotBeCloned, "sklearn_clone_is_equal", "places"),
]
