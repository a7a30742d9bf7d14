"""Assigned and written matrices, unknown attributes, numbers as covariances."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from filterpy.common import Saver
from filterpy_twins import BEARING, WALK, P, X, assert_twins, plain, twins

from arrivals.measurement_models import (
    ArraySamples,
    FunctionMeasurement,
    LinearMeasurement,
    SensorArray,
    Tones,
)
from arrivals.motion_models import CoordinatedTurn, LinearMotion, RandomWalk, VonMisesWalk
from arrivals.trackers import EKF, IMM, UKF, GaussianFilter, InterpolationEKF, Kalman, Particle

KINDS: list[type[GaussianFilter]] = [Kalman, EKF, UKF]
ZS = np.random.default_rng(5).normal(size=(4, 2))


def steps(*filters: Any) -> None:
    for z in ZS:
        for f in filters:
            f.predict()
            f.update(z)


ASSIGNED: dict[str, Any] = {
    "F": lambda f: 1.1 * f.F,
    "Q": lambda f: 3.0 * f.Q,
    "H": lambda f: f.H[::-1].copy(),
    "R": lambda f: 2.0 * f.R,
    "B": lambda f: -f.B,
    "x": lambda f: 2.0 * f.x,
    "P": lambda f: 5.0 * f.P,
    "alpha": lambda f: 1.3,
    "inv": lambda f: np.linalg.pinv,
}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ASSIGNED)
def test_assigned_attribute_works_as_in_filterpy(name: str, seed: int) -> None:
    ours, theirs = twins(seed, n=2 + seed, column=bool(seed % 2))
    steps(*([] if seed else [ours, theirs]))
    for f in (ours, theirs):
        setattr(f, name, ASSIGNED[name](f))
        for z in ZS:
            f.predict(np.array([0.5]) if np.ndim(f.x) == 1 else np.array([[0.5]]))
            f.update(z[:, None] if np.ndim(f.x) == 2 else z)
    assert_twins(ours, theirs, names="x P F Q H R B" if name != "inv" else "x P")


def write_element(f: Any) -> None:
    f.F[0, 1] = 0.25


def write_view(f: Any) -> None:
    np.fill_diagonal(f.Q, 4.0)
    f.H[1][:] = 0.5


def write_in_place(f: Any) -> None:
    f.R *= 2
    f.Q += np.eye(3)
    f.B /= 2
    f.P *= 10
    f.x[0] = 3.0


def write_kept_array(f: Any) -> None:
    F = np.eye(3)
    f.F = F
    f.predict()
    F[0, 2] = 0.75


WRITES = [write_element, write_view, write_in_place, write_kept_array]


@pytest.mark.parametrize("write", WRITES)
def test_written_element_holds_from_the_next_step_on(write: Callable[[Any], None]) -> None:
    ours, theirs = twins(3)
    for _ in range(2):
        for f in (ours, theirs):
            write(f)
        steps(ours, theirs)
        assert_twins(ours, theirs, names="x P F Q H R B")
    copies = [copy.deepcopy(ours), pickle.loads(pickle.dumps(ours))]
    ours.F[1, 0] = 9.0
    assert all(f.F[1, 0] != 9.0 for f in copies)


def test_written_element_is_in_models_and_parameters() -> None:
    tracker = Kalman(LinearMotion(np.eye(2), np.eye(2)), LinearMeasurement([[1.0, 0.0]], [[1.0]]),
                     [0.0, 0.0], 1.0)  # fmt: skip
    tracker.F[0, 1], tracker.R[0, 0] = 0.5, 7.0
    assert tracker.motion == LinearMotion([[1.0, 0.5], [0.0, 1.0]], np.eye(2))
    assert tracker.get_params()["measurement"].noise == 7.0
    assert tracker.F is tracker.F
    tracker.motion = LinearMotion(np.eye(2), np.zeros((2, 2)))
    assert not tracker.Q.any()


@pytest.mark.parametrize("kind", KINDS)
def test_number_is_a_covariance_in_all_directions(kind: type[GaussianFilter]) -> None:
    tracker, same = plain(kind=kind), plain(kind=kind)
    tracker.P, tracker.Q, tracker.R = 50.0, 2.0, 3.0  # type: ignore[assignment]
    same.P, same.Q, same.R = 50.0 * np.eye(4), 2.0 * np.eye(4), 3.0 * np.eye(2)
    steps(tracker, same)
    assert_twins(tracker, same, 0)
    assert kind(WALK, same.measurement, X, 4).P.tolist() == (4 * np.eye(4)).tolist()


@pytest.mark.parametrize("kind", [EKF, UKF])
def test_assigned_noise_keeps_a_nonlinear_model(kind: type[GaussianFilter]) -> None:
    turn, x = CoordinatedTurn(0.1, 0.1), [*X, 0.1]
    tracker = kind(turn, BEARING, x, np.eye(5))
    Q, R = turn.Q(0.5) + 0.1 * np.eye(5), 4 * BEARING.R
    tracker.Q, tracker.R = Q, R
    for _ in range(2):  # steps of any length
        tracker.predict(dt=0.5)
        tracker.update(BEARING.h(X))
    other = kind(turn, BEARING, x, np.eye(5))
    for _ in range(2):
        other.predict(dt=0.5, Q=Q)
        other.update(BEARING.h(X), R=R)
    assert_twins(tracker, other, 1e-12)
    tracker.F = np.eye(5)
    assert isinstance(tracker.motion, LinearMotion)
    with pytest.raises(ValueError, match="dt must be 1"):
        tracker.predict(dt=0.5)


def test_written_transition_keeps_the_noise_of_the_last_step() -> None:
    tracker = plain()
    tracker.predict(dt=0.5)
    assert (WALK.Q(0.5) == tracker.Q).all()
    tracker.F[0, 1] = 0.7
    assert tracker.motion == LinearMotion(tracker.F, WALK.Q(0.5), names=WALK.state_names)


def test_matrices_read_at_another_step_length_are_read_again() -> None:
    tracker = plain()
    for dt in (1.0, 0.5, 0.5, 2.0):
        tracker.predict(dt=dt)
        assert (WALK.F(dt=dt) == tracker.F).all()
        assert (WALK.Q(dt) == tracker.Q).all()


def test_filter_with_a_longer_state_refuses_matrices_with_the_cure() -> None:
    array = ArraySamples(SensorArray.ula(4, 0.1, speed=340.0), rate=4000.0, correlation=Tones(0.25))
    joint = InterpolationEKF(array, variant="E", std=0.01)
    for name in ("F", "Q", "H", "R"):
        with pytest.raises(AttributeError, match=f"{name} of InterpolationEKF cannot be assigned"):
            setattr(joint, name, np.eye(2))
    with pytest.raises(ValueError, match="follow the state"):
        joint.F[0, 0] = 2.0
    assert joint.alpha == 1.0


def test_assigned_matrices_keep_angles() -> None:
    tracker = EKF(VonMisesWalk(30.0), LinearMeasurement([[1.0]], [[0.1]]), [3.1], [[0.1]])
    tracker.F, tracker.Q = [[2.0]], 0.1
    tracker.predict()
    assert tracker.x == pytest.approx(6.2 - 2 * np.pi)
    assert tracker.motion.is_linear


@pytest.mark.parametrize("name", ["F", "H"])
def test_jacobian_of_a_nonlinear_model_is_read_only_with_the_cure(name: str) -> None:
    tracker = EKF(CoordinatedTurn(0.1, 0.1), BEARING, [*X, 0.1], np.eye(5))
    with pytest.raises(ValueError, match=r"follow the state: assign a matrix, tracker\.F = "):
        getattr(tracker, name)[0, 0] = 1.0
    changed = getattr(tracker, name).copy()
    changed[0, 0] = 7.0
    setattr(tracker, name, changed)
    assert getattr(tracker, name)[0, 0] == 7.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("F", np.eye(3), r"F must have shape \(4, 4\); got \(3, 3\)"),
        ("F", np.full((4, 4), np.nan), "F must be finite"),
        ("Q", -np.eye(4), "Q must have no negative eigenvalue"),
        ("R", np.eye(3), r"R must have shape \(2, 2\)"),
        ("H", np.eye(4), r"H must have shape \(2, 4\)"),
        ("B", np.eye(3), r"B must have shape \(4, dim_u\)"),
        ("R", "loud", "R must hold real numbers"),
    ],
)
def test_invalid_matrix_raises_where_it_is_assigned(
    kind: type[GaussianFilter], name: str, value: Any, message: str
) -> None:
    tracker = plain(kind=kind)
    before = tracker.motion, tracker.measurement
    with pytest.raises((ValueError, TypeError), match=message):
        setattr(tracker, name, value)
    assert (tracker.motion, tracker.measurement) == before


def test_invalid_written_element_raises_at_the_next_step_until_it_is_mended() -> None:
    tracker = plain()
    tracker.Q[0, 0] = np.nan
    with pytest.raises(ValueError, match="Q must be finite"):
        tracker.predict()
    np.testing.assert_array_equal(tracker.x, X)
    tracker.Q[0, 0] = 1.0
    tracker.predict()


# Attributes that do not exist


def members() -> list[Any]:
    walk, position = RandomWalk(1.0), LinearMeasurement(np.eye(2), np.eye(2))
    particle = Particle(walk, position, [0.0, 0.0], 1.0, n_particles=9, rng=0)
    bank = IMM([Kalman(walk, position, [0.0, 0.0], 1.0)] * 2, [0.5, 0.5], np.eye(2))
    return [*(kind(walk, position, [0.0, 0.0], 1.0) for kind in KINDS), particle, bank]


@pytest.mark.parametrize("tracker", members(), ids=lambda each: type(each).__name__)
def test_misspelt_attribute_raises_with_a_suggestion(tracker: Any) -> None:
    with pytest.raises(AttributeError, match="no attribute 'likelihod': did you mean likelihood"):
        tracker.likelihod = 1.0
    with pytest.raises(AttributeError, match="no attribute 'zzzzz'"):
        tracker.zzzzz = 1.0
    with pytest.raises(AttributeError):
        _ = tracker.likelihod
    with pytest.raises(AttributeError, match="estimate"):
        tracker.estimate = 1.0
    assert "likelihod" not in vars(tracker)


def test_derived_attribute_raises_with_the_cure() -> None:
    with pytest.raises(AttributeError, match="dim_x of Kalman cannot be assigned: assign motion"):
        plain().dim_x = 3  # type: ignore[misc]
    plain().u = 0.0
    with pytest.raises(AttributeError, match="u must be passed to each step, predict"):
        plain().u = 1.0


class OwnKalman(Kalman):
    gain_log: list[Any]

    def __init__(self, *models: Any) -> None:
        super().__init__(*models)
        self.n_steps = 0
        for name in ("first", "second"):
            setattr(self, name, 0.0)

    def predict(self, *arguments: Any, **named: Any) -> None:
        super().predict(*arguments, **named)
        self.n_steps += 1
        self.last_input = arguments
        self.P = self.P * 1.01


def test_subclass_may_have_attributes_of_its_own() -> None:
    tracker = OwnKalman(WALK, plain().measurement, X, P)
    tracker.gain_log = []
    tracker.first = 2.0
    saver = Saver(tracker)
    for each in (tracker, copy.deepcopy(tracker), pickle.loads(pickle.dumps(tracker))):
        each.predict()
        each.update([8.0, 6.0])
        saver.save()
    saver.to_array()
    assert tracker.n_steps == 1
    with pytest.raises(AttributeError, match="did you mean n_steps"):
        tracker.n_stepz = 1


def tune(kf: Any) -> None:
    kf.aplha = 2.0


def test_function_of_a_user_is_not_a_method() -> None:
    with pytest.raises(AttributeError, match="did you mean alpha"):
        tune(plain())


def test_residual_of_a_model_is_kept_with_another_noise() -> None:
    ring = FunctionMeasurement(
        lambda x: x[:1], R=1.0, residual=lambda a, b: (np.subtract(a, b) + 1) % 2 - 1
    )
    tracker = EKF(RandomWalk(1.0), ring, [0.9, 0.0], 1.0)
    tracker.R = 0.5
    tracker.update(-0.9)
    assert tracker.y == pytest.approx(0.2)
    assert tracker.measurement.for_state(("x", "y")) is tracker.measurement
