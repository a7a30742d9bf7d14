"""Every tracker through the same checks, and the checks themselves put to the test."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conformance_cases.autoregressive import TRACKERS as AR_TRACKERS
from conformance_cases.gaussian import TRACKERS as KALMAN_TRACKERS
from conformance_cases.interpolation import TRACKERS as DELAY_TRACKERS
from conformance_cases.rss import TRACKERS as RSS_TRACKERS
from conformance_cases.subspace import TRACKERS as SUBSPACE_TRACKERS
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.motion_models import BernoulliVonMises
from arrivals.parameters import FrozenModel
from arrivals.trackers import (
    CBF,
    SBL,
    SSBL,
    SVALSE,
    VALSE,
    CoordinateSolver,
    DirectionEstimate,
    NewtonSolver,
    PeaksGNN,
    Run,
    Tracker,
    available,
    find,
)
from arrivals.trackers.conformance import (
    CHECKS,
    Check,
    MakeTracker,
    Measurements,
    check_tracker,
    difference,
)

LINE = ArraySnapshot(SensorArray.ula(9, spacing=0.5), wavelength=1.0, noise=1e-3)
CIRCLE = ArraySnapshot(SensorArray.uca(7, radius=0.5), wavelength=1.0, noise=1e-3)
LOOKS = CIRCLE.replace(wavelength=[1.0, 1.4], n_snapshots=2)
SLOWNESS = LOOKS.replace(slowness=[0.9, 1.0, 1.1], response=ElementResponse.first_order([0.3] * 7))
GAPS = ArraySnapshot(SensorArray.ula(10, 0.4, missing=[2]), wavelength=1.0, noise=1e-3)


def two_sources(model: ArraySnapshot, n_steps: int = 4) -> Measurements:
    """Two sources, one of which starts late; one sensor fails, and once there is silence."""
    on = np.arange(n_steps) > 0
    doa = np.stack([0.5 + 0.02 * np.arange(n_steps), np.where(on, -0.4, np.nan)], axis=-1)
    z = model.simulate(doa, [1.0, 0.8j], np.random.default_rng(5))
    z[1, ..., 3] = np.nan
    z[-1] = 0.0
    return z


GRIDLESS: list[tuple[str, MakeTracker, Measurements]] = [
    ("cbf", lambda: CBF(LINE, n_directions=91), two_sources(LINE)),
    ("cbf", lambda: CBF(CIRCLE, n_directions=90, max_sources=2), two_sources(CIRCLE)),
    ("valse", lambda: VALSE(LINE), two_sources(LINE)),
    ("valse", lambda: VALSE(GAPS, solver=NewtonSolver(max_components=3)), two_sources(GAPS)),
    ("sbl", lambda: SBL(LINE, n_directions=91), two_sources(LINE)),
    ("sbl", lambda: SBL(CIRCLE, n_directions=90, max_sources=2), two_sources(CIRCLE)),
    ("ssbl", lambda: SSBL(GAPS, n_directions=91), two_sources(GAPS)),
    ("ssbl", lambda: SSBL(CIRCLE, n_directions=90, n_neighbours=1), two_sources(CIRCLE)),
    ("peaks_gnn", lambda: PeaksGNN(LINE), two_sources(LINE)),
    ("peaks_gnn", lambda: PeaksGNN(CIRCLE, detector="mvdr", confirm_steps=1), two_sources(CIRCLE)),
    ("peaks_gnn", lambda: PeaksGNN(LINE, detector=CBF(LINE, threshold_db=6.0)), two_sources(LINE)),
    ("valse", lambda: VALSE(LINE, engine="coordinate"), two_sources(LINE)),
    ("svalse", lambda: SVALSE(LINE), two_sources(LINE)),
    ("svalse", lambda: SVALSE(GAPS, BernoulliVonMises(kappa=50.0)), two_sources(GAPS)),
    ("svalse", lambda: SVALSE(GAPS, engine="coordinate"), two_sources(GAPS)),
    (
        "svalse",
        lambda: SVALSE(
            LINE,
            solver=CoordinateSolver(posterior="mixture", tolerance=1e-6),
            reference="first",
        ),
        two_sources(LINE, n_steps=3),
    ),
    ("cbf", lambda: CBF(SLOWNESS, n_directions=90), two_sources(SLOWNESS)),
    (
        "valse",
        lambda: VALSE(LOOKS, solver=NewtonSolver(tempering=2.0, max_snr_db=25.0)),
        two_sources(LOOKS),
    ),
    ("svalse", lambda: SVALSE(CIRCLE), two_sources(CIRCLE)),
    (
        "svalse",
        lambda: SVALSE(SLOWNESS, BernoulliVonMises(sigma_doa=0.05), memory="posterior"),
        two_sources(SLOWNESS),
    ),
]
# A new tracker gets its line here, or in the list that is about its kind.
TRACKERS = [
    *GRIDLESS,
    *KALMAN_TRACKERS,
    *DELAY_TRACKERS,
    *AR_TRACKERS,
    *SUBSPACE_TRACKERS,
    *RSS_TRACKERS,
]
IDS = [f"{name}-{n}" for n, (name, _, _) in enumerate(TRACKERS)]

every_check = pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
every_tracker = pytest.mark.parametrize(("name", "make", "measurements"), TRACKERS, ids=IDS)


@every_check
@every_tracker
def test_conforms(name: str, make: MakeTracker, measurements: Measurements, check: Check) -> None:
    check(make, measurements)


@every_tracker
def test_measurements_give_the_checks_something_to_see(
    name: str, make: MakeTracker, measurements: Measurements
) -> None:
    assert type(make()) is find(name)
    sources = 2 if make in [line[1] for line in GRIDLESS] else 1
    assert make().run(measurements).n_found.max() >= sources


def test_every_built_in_tracker_is_in_the_list() -> None:
    ours = {name for name in available() if find(name).__module__.startswith("arrivals.")}
    assert ours == {name for name, _, _ in TRACKERS}


# The checks can fail. A sound tracker, and one fault at a time.


class Smoother(Tracker):
    """An exponential mean of numbers, shown as one direction."""

    def __init__(self, gain: float = 0.5, motion: BernoulliVonMises | None = None) -> None:
        if not 0 < gain <= 1:
            raise ValueError(f"gain must lie in (0, 1]; got {gain}")
        self.gain, self.motion = gain, motion
        self.x, self.P = np.zeros(2), np.eye(2)
        self.label = np.zeros(1, dtype=np.int64)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        self.P = self.P + dt * np.eye(2)

    def update(self, z: ArrayLike | None) -> None:
        if z is None or np.isnan(np.asarray(z, dtype=float)).all():
            return
        z = np.asarray(z, dtype=float)
        if z.shape != (2,):
            raise ValueError(f"z must have shape (2,); got {z.shape}")
        self.correct(z)

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


class ForgetsToRestore(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        self.P = self.P / 2 if z is not None else self.P
        super().update(z)


class SwallowsText(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        if not isinstance(z, str):
            super().update(z)


class RaisesKeyError(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        if isinstance(z, str):
            raise KeyError(z)
        super().update(z)


class TakesAnything(Smoother):
    def __init__(self, gain: float = 0.5, **others: Any) -> None:
        super().__init__(gain)


class RenamesItsParameter(Smoother):
    def __init__(self, alpha: float = 0.5) -> None:
        super().__init__(alpha)


class HalvesItsParameter(Smoother):
    def __init__(self, gain: float = 0.5) -> None:
        super().__init__(gain)
        self.gain = gain / 2


class ForgetsOnSetParams(Smoother):
    def set_params(self, **params: Any) -> "ForgetsOnSetParams":
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


class MovesWhenMissed(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        super().update(z)
        if z is None:
            self.P = 2 * self.P


class ChokesOnNaN(Smoother):
    def update(self, z: ArrayLike | None) -> None:
        if z is not None and np.ndim(z) == 1:
            self.correct(z)
        else:
            super().update(z)


class NegativeVariance(Smoother):
    def correct(self, z: Any) -> None:
        self.P = np.diag([1.0, -1e-3])


class LopsidedCovariance(Smoother):
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


class ForgetsTheLastOfABatch(Smoother):
    def run_batch(self, measurements: Any, dt: float = 1.0) -> list[Run]:
        return super().run_batch(measurements, dt)[:-1]


class LabelsTwice(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        two = np.ones(2)
        return DirectionEstimate(two, two, two, np.ones(2, complex), np.zeros(2, dtype=np.int64))


class MoreLikelyThanSure(Smoother):
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


class NotFrozen(Smoother):
    @property
    def estimate(self) -> DirectionEstimate:
        one = np.ones(1)
        return Thawed(one, one, one, np.ones(1, complex), self.label)


class Thawed(DirectionEstimate):
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
        self.places = np.array(places)  # a copy: sklearn wants what it gave


NUMBERS = np.random.default_rng(0).normal(size=(4, 2))
FAULTS: list[tuple[Callable[[], Tracker], str, str]] = [
    (WritesIntoItsArrays, "earlier_results_are_not_modified", "half step.*x"),
    (WritesIntoTheMeasurement, "measurement_is_neither_modified_nor_kept", "measurement 1: "),
    (KeepsTheMeasurement, "measurement_is_neither_modified_nor_kept", "array was reused"),
    (CountsInAGlobal, "same_input_gives_same_output", "step 0 .*x"),
    (ForgetsToRestore, "invalid_measurement_changes_nothing", "one value too many.*P|P.*became"),
    (SwallowsText, "invalid_measurement_changes_nothing", "text was accepted"),
    (RaisesKeyError, "invalid_measurement_changes_nothing", "raised KeyError"),
    (TakesAnything, "constructor_accepts_its_parameters", "must name its parameters"),
    (RenamesItsParameter, "constructor_accepts_its_parameters", "no attribute 'alpha'"),
    (HalvesItsParameter, "constructor_accepts_its_parameters", "gain: 0.25 became 0.125"),
    (ForgetsOnSetParams, "setting_own_parameters_changes_nothing", "after set_params"),
    (IgnoresUnknownNames, "unknown_parameter_is_refused", "no_such_parameter=1. was accepted"),
    (SetsBeforeItChecks, "unknown_parameter_is_refused", "after set_params"),
    (MovesWhenMissed, "missing_measurement_keeps_belief", "update.None.*P"),
    (ChokesOnNaN, "missing_measurement_keeps_belief", "nan"),
    (NegativeVariance, "belief_has_mean_and_covariance", "negative eigenvalue -0.001"),
    (LopsidedCovariance, "belief_has_mean_and_covariance", "not symmetric"),
    (ComplexMean, "belief_has_mean_and_covariance", "array of floats"),
    (GrowsItsState, "belief_has_mean_and_covariance", "shapes"),
    (CannotBePickled, "pickled_tracker_continues_like_the_original", "raised"),
    (PickleLosesTheMean, "pickled_tracker_continues_like_the_original", "after pickling"),
    (CopiesAreAliases, "deep_copy_is_independent", "after steps of its copy|after copying"),
    (RunsFromScratch, "run_equals_the_predict_update_loop", "x of step 0"),
    (BatchMovesTheTracker, "batch_equals_single_runs", "after run_batch"),
    (ForgetsTheLastOfABatch, "batch_equals_single_runs", "number of runs"),
    (LabelsTwice, "estimate_is_a_frozen_record", "must be unique"),
    (MoreLikelyThanSure, "estimate_is_a_frozen_record", r"existence must lie in \[0, 1\]"),
    (FieldsDiffer, "estimate_is_a_frozen_record", "differ in length"),
    (ChangesKind, "estimate_is_a_frozen_record", "DirectionEstimate.* became .*OtherKind"),
    (NotFrozen, "estimate_is_a_frozen_record", "Thawed is not frozen"),
    (DirectionUnknown, "estimate_is_a_frozen_record", "doa must be finite"),
    (WritesHalfARow, "estimate_is_a_frozen_record", "row"),
    (ReplacesItsModel, "models_are_not_modified", "motion was replaced"),
    (HasSlowProperty, "filterpy_saver_works", "not yet"),
    (KeepsARaggedHistory, "filterpy_saver_works", "could not convert|history"),
    (NotJSON, "configuration_survives_json", "not JSON serializable"),
    (DropsAParameter, "configuration_survives_json", "the rebuilt one"),
    (CannotBeCloned, "sklearn_clone_is_equal", "places"),
]


def test_every_check_has_a_fault_that_it_finds() -> None:
    assert {name for _, name, _ in FAULTS} == {check.__name__ for check in CHECKS}


@pytest.mark.parametrize(
    ("make", "name", "message"), FAULTS, ids=[fault[0].__name__ for fault in FAULTS]
)
def test_fault_is_found_and_named(make: Callable[..., Tracker], name: str, message: str) -> None:
    check = next(check for check in CHECKS if check.__name__ == name)
    params: dict[str, Any] = {"gain": 0.25} if make is DropsAParameter else {}
    params |= {"motion": BernoulliVonMises()} if make is ReplacesItsModel else {}
    with pytest.raises(AssertionError, match=f"(?s)^{name}: .*({message})"):
        check(lambda: make(**params), NUMBERS)


def test_sound_tracker_passes() -> None:
    check_tracker(Smoother, NUMBERS)
    check_tracker(lambda: Smoother(0.3, BernoulliVonMises()), list(NUMBERS))


def test_check_tracker_runs_the_checks() -> None:
    with pytest.raises(AssertionError, match=r"^earlier_results_are_not_modified"):
        check_tracker(WritesIntoItsArrays, NUMBERS)


def test_one_measurement_is_not_enough() -> None:
    with pytest.raises(AssertionError, match="requires at least two measurements"):
        CHECKS[0](Smoother, NUMBERS[:1])


class Part(FrozenModel):
    def __init__(self, number: float) -> None:
        self.number = number


def test_difference_goes_into_everything() -> None:
    a = {"parts": [Part(1.0), (np.nan, "text")], "rng": np.random.default_rng(1)}
    b = {"parts": [Part(1.0), (np.nan, "text")], "rng": np.random.default_rng(1)}
    assert difference(a, b) is None
    b["rng"].random()  # type: ignore[attr-defined]
    assert "rng.state" in str(difference(a, b))
    assert difference([Part(1.0)], [Part(2.0)]) == "value.0.number: 1.0 became 2.0"
    assert difference(np.zeros(2), np.zeros(3)) is not None
    assert difference(np.zeros(2), np.zeros(2, dtype=int)) is not None
    assert difference(1, 1.0) == "value: 1 became 1.0"
    assert difference({"a": 1}, {"b": 1}) == "value: ['a'] became ['b']"


def test_difference_survives_circles() -> None:
    a, b = Part(1.0), Part(1.0)
    a.other, b.other = b, a  # type: ignore[attr-defined]
    assert difference(a, b) is None
