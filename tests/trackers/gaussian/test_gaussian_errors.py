"""Errors of Gaussian filters and of `as_filterpy`."""

import copy
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, Bearing, LinearMeasurement, SensorArray
from arrivals.motion_models import (
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    RandomWalk,
    VonMisesWalk,
)
from arrivals.trackers import EKF, IMM, UKF, GaussianFilter, Kalman, as_filterpy
from arrivals.trackers.conformance import difference

KINDS: list[type[GaussianFilter]] = [Kalman, EKF, UKF]
every_kind = pytest.mark.parametrize("kind", KINDS)
WALK = ConstantVelocity(q=0.3, n_dims=1)
POSITION = LinearMeasurement([[1.0, 0.0], [1.0, 1.0]], [[0.5, 0.1], [0.1, 0.4]])
X, P = np.array([1.0, -0.5]), np.array([[1.0, 0.2], [0.2, 0.5]])
ZS = np.array([[1.0, 0.2], [np.nan, 0.7], [0.4, np.nan]])
P5 = 0.1 * np.eye(5)
ANGLE = LinearMeasurement([[1.0]], [[0.01]])


TWO = LinearMeasurement(np.eye(2), np.eye(2))
BAD_PARTS: list[tuple[Any, type[Exception], str]] = [
    (lambda: Kalman("walk", POSITION, X, P), TypeError, "motion must be a MotionModel; got 'walk'"),  # type: ignore[arg-type]
    (lambda: EKF(WALK, WALK, X, P), TypeError, "measurement must be a MeasurementModel"),  # type: ignore[arg-type]
    (
        lambda: EKF(WALK, POSITION, [1.0], P),
        ValueError,
        r"x must have shape \(2,\) or \(2, 1\); got \(1,\)",
    ),
    (lambda: EKF(WALK, POSITION, [1.0, np.nan], P), ValueError, "x must be finite"),
    (
        lambda: EKF(WALK, POSITION, X, np.eye(3)),
        ValueError,
        r"P must have shape \(2, 2\); got \(3, 3\)",
    ),
    (lambda: EKF(WALK, POSITION, X, [[1.0, 0.5], [0.0, 1.0]]), ValueError, "P must be symmetric"),
    (
        lambda: EKF(WALK, POSITION, X, [[1.0, 2.0], [2.0, 1.0]]),
        ValueError,
        "P must have no negative eigenvalue",
    ),
    (lambda: EKF(WALK, POSITION, X, np.full((2, 2), np.nan)), ValueError, "P must be finite"),
    (
        lambda: EKF(RandomWalk(1.0, 3), POSITION, np.zeros(3), np.eye(3)),
        ValueError,
        r"shape \(..., 2\)|must have shape",
    ),
    (
        lambda: Kalman(CoordinatedTurn(1, 1), Bearing([[0, 0]], 1), np.ones(5), P5),
        TypeError,
        "motion must be linear.*ekf or ukf",
    ),
    (
        lambda: Kalman(RandomWalk(1.0), Bearing([[0, 0]], 1, (0, 1)), X, P),
        TypeError,
        "measurement must be linear",
    ),
    (lambda: Kalman(VonMisesWalk(9.0), ANGLE, [0.0], [[1.0]]), TypeError, "motion must be linear"),
    (lambda: UKF(WALK, POSITION, X, P, alpha=0.0), ValueError, "alpha must be finite and positive"),
    (
        lambda: UKF(WALK, POSITION, X, P, kappa=-2.0),
        ValueError,
        "kappa must be finite and above -2",
    ),
    (lambda: IMM([], [], []), ValueError, "filters must have at least two entries; got 0"),
]


@pytest.mark.parametrize(("make", "error", "message"), BAD_PARTS)
def test_invalid_arguments_raise(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


SNAPSHOT = ArraySnapshot(SensorArray.ula(4, 0.5), 1.0)
BAD_CALLS: list[tuple[Any, type[Exception], str]] = [
    (lambda f: f.update([1.0]), ValueError, r"z must have shape \(2,\) or \(2, 1\); got \(1,\)"),
    (lambda f: f.update(1.0), ValueError, r"z must have shape \(2,\)"),
    (lambda f: f.update([[1.0, 2.0], [3.0, 4.0]]), ValueError, r"z must have shape"),
    (lambda f: f.update("text"), TypeError, "z must hold numbers, NaN for a missing one"),
    (lambda f: f.update([[1.0], [2.0, 3.0]]), ValueError, "z must have rows of one length"),
    (lambda f: f.predict(np.nan), ValueError, r"u must be finite; got \[nan\]"),
    (lambda f: f.predict([1.0], B=[[np.inf], [0.0]]), ValueError, "B must be finite"),
    (lambda f: f.predict(F=[[np.inf, 0.0], [0.0, 1.0]]), ValueError, "F must be finite"),
    (lambda f: f.update([1.0, 2.0], H=np.full((2, 2), np.nan)), ValueError, "H must be finite"),
    (
        lambda f: f.update([1.0, 2.0], R=np.eye(3)),
        ValueError,
        r"R must have shape \(2, 2\); got \(3, 3\)",
    ),
    (lambda f: f.update([1.0, 2.0], R=-1.0), ValueError, "R must have no negative eigenvalue"),
    (
        lambda f: f.update([1.0, 2.0], H=np.eye(3)),
        ValueError,
        r"H must have shape \(m, 2\); got \(3, 3\)",
    ),
    (
        lambda f: f.update([1.0], H=[[1.0, 0.0]]),
        ValueError,
        r"R must have shape \(1, 1\); got \(2, 2\)",
    ),
    (lambda f: f.predict(1.0), ValueError, "motion must have a control matrix where u is not zero"),
    (
        lambda f: f.predict([1.0, 2.0], B=np.ones((2, 1))),
        ValueError,
        r"u must have shape \(1,\); got \(2,\)",
    ),
    (
        lambda f: f.predict(F=np.ones((1, 2))),
        ValueError,
        r"F must have shape \(2, 2\); got \(1, 2\)",
    ),
    (lambda f: f.predict(Q=[[1, 0], [5, 1]]), ValueError, "Q must be symmetric"),
    (lambda f: f.predict(dt=-1.0), ValueError, "dt must be finite and not negative"),
    (
        lambda f: f.batch_filter(ZS, Fs=[np.eye(2)]),
        ValueError,
        "Fs must have one entry for each of 3 steps; got 1",
    ),
    (
        lambda f: f.rts_smoother(ZS, [P]),
        ValueError,
        r"Ps must have shape \(3, 2, 2\); got \(1, 2, 2\)",
    ),
    (lambda f: f.run(ZS, dt=0.0), ValueError, "dt must be finite and positive"),
]


@every_kind
@pytest.mark.parametrize(("call", "error", "message"), BAD_CALLS)
def test_invalid_calls_leave_the_filter_unchanged(
    kind: type[GaussianFilter], call: Any, error: type[Exception], message: str
) -> None:
    tracker = kind(WALK, POSITION, X, P)
    tracker.update([1.0, 1.0])
    before = copy.deepcopy(vars(tracker))
    with pytest.raises(error, match=message):
        call(tracker)
    assert difference(before, vars(tracker)) is None


TOO_LONG = "belief must stay finite|dt must be at most"


@every_kind
@pytest.mark.parametrize("dt", [1e110, 1e200, 1e308])
def test_step_that_overflows_raises_and_leaves_the_filter_unchanged(
    kind: type[GaussianFilter], dt: float
) -> None:
    tracker = kind(WALK, POSITION, X, P)
    before = copy.deepcopy(vars(tracker))
    with np.errstate(all="ignore"), pytest.raises(ValueError, match=TOO_LONG):
        tracker.predict(dt=dt)
    assert difference(before, vars(tracker)) is None


@every_kind
def test_infinite_and_masked_numbers_are_missing(kind: type[GaussianFilter]) -> None:
    tracker, other = kind(WALK, POSITION, X, P), kind(WALK, POSITION, X, P)
    other.update([np.nan, 0.3])
    masked = np.ma.array([7.0, 0.3], mask=[True, False])
    partly: list[Any] = [[np.inf, 0.3], [-1e200, 0.3], [None, 0.3], [[None], [0.3]], masked]
    for z in (*partly, masked[:, None]):
        tracker.x, tracker.P = X, P
        tracker.update(z)
        np.testing.assert_array_equal(tracker.x, other.x)
        np.testing.assert_array_equal(tracker.z, other.z)
    nothing: list[Any] = [np.inf, [np.inf, None], np.ma.array([1.0, 2.0], mask=True)]
    for z in nothing:
        tracker.update(z)
        assert np.isnan(tracker.z).all()


@every_kind
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("x", np.zeros(3), "x must have shape"),
        ("x", [np.nan, 0.0], "x must be finite"),
        ("P", np.eye(3), "P must have shape"),
        ("P", [[1.0, 0.5], [0.0, 1.0]], "P must be symmetric"),
        ("P", -np.eye(2), "P must have no negative eigenvalue"),
    ],
)
def test_invalid_assigned_belief_raises_at_the_next_call(
    kind: type[GaussianFilter], name: str, value: Any, message: str
) -> None:
    tracker = kind(WALK, POSITION, X, P)
    setattr(tracker, name, value)
    with pytest.raises(ValueError, match=message):
        tracker.predict()
    with pytest.raises(ValueError, match=message):
        tracker.update([1.0, 1.0])


def test_complex_snapshot_raises_with_the_cure() -> None:
    source = LinearMotion(np.eye(3), np.eye(3))
    tracker = EKF(source, SNAPSHOT, np.ones(3), np.eye(3))
    with pytest.raises(TypeError, match=r"composite\(z\)"):
        tracker.update(np.ones(4, dtype=complex))


@pytest.mark.parametrize("kind", ["ekf", "ukf", "ckf", "enkf"])
def test_as_filterpy_warns_of_angles(kind: Any) -> None:
    with pytest.warns(UserWarning, match="IMMEstimator.*to 0.*arrivals.trackers wrap them"):
        as_filterpy(VonMisesWalk(9.0), ANGLE, kind, x=[0.0], P=[[1.0]])


def test_as_filterpy_invalid_arguments_raise() -> None:
    with pytest.raises(ValueError, match=r"kind must be one of 'kf', 'ekf'.*got 'kalman'"):
        as_filterpy(WALK, POSITION, "kalman", x=X, P=P)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="motion must be linear"):
        as_filterpy(CoordinatedTurn(1, 1), POSITION, "kf", x=np.ones(5), P=P5)
    with pytest.raises(ValueError, match=r"x must have shape \(2,\); got \(2, 1\)"):
        as_filterpy(WALK, POSITION, "kf", x=X[:, None], P=P)
