"""Filters and smoothers against the joint Gaussian of all steps; angles; refusals; batches."""

import copy
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, Bearing, LinearMeasurement, SensorArray
from arrivals.motion_models import (
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    RandomWalk,
    VonMisesWalk,
)
from arrivals.trackers import EKF, IMM, UKF, GaussianFilter, Kalman, as_filterpy, create
from arrivals.trackers.conformance import difference
from arrivals.trackers.gaussian.linalg import JITTER
from arrivals.typing import Float

KINDS: list[type[GaussianFilter]] = [Kalman, EKF, UKF]
every_kind = pytest.mark.parametrize("kind", KINDS)
WALK = ConstantVelocity(q=0.3, n_dims=1)
SEEN = LinearMeasurement([[1.0, 0.0], [1.0, 1.0]], [[0.5, 0.1], [0.1, 0.4]])
X, P = np.array([1.0, -0.5]), np.array([[1.0, 0.2], [0.2, 0.5]])
ZS = np.array([[1.0, 0.2], [np.nan, 0.7], [0.4, np.nan]])
FAR, P5 = Bearing([[9.0, 9.0], [-9.0, 5.0]], noise=0.5), 0.1 * np.eye(5)
ANGLE = LinearMeasurement([[1.0]], [[0.01]])


def joint(zs: Float, dts: Sequence[float]) -> tuple[Float, Float]:
    """Means and covariances of all states given all measurements: one big linear regression."""
    T, n = len(zs), 2
    dts = dts[:T]
    A = np.zeros((T, n, (T + 1) * n))  # states as maps of start and noises
    A_last = np.hstack([np.eye(n), np.zeros((n, T * n))])
    noise = [P]
    for t, dt in enumerate(dts):
        A_last = WALK.F(dt=dt) @ A_last
        A_last[:, (t + 1) * n : (t + 2) * n] += np.eye(n)
        A[t] = A_last
        noise.append(WALK.Q(dt))
    prior = np.zeros(((T + 1) * n,) * 2)
    for t, block in enumerate(noise):
        prior[t * n : (t + 1) * n, t * n : (t + 1) * n] = block
    states = A.reshape(T * n, -1)
    mean = states[:, :n] @ X
    C = states @ prior @ states.T
    H = np.kron(np.eye(T), SEEN.H())
    R = np.kron(np.eye(T), SEEN.R)
    heard = ~np.isnan(zs.ravel())
    H, R = H[heard], R[np.ix_(heard, heard)]
    K = C @ H.T @ np.linalg.inv(H @ C @ H.T + R)
    x = mean + K @ (zs.ravel()[heard] - H @ mean)
    V = C - K @ H @ C
    blocks = [V[t * n : (t + 1) * n, t * n : (t + 1) * n] for t in range(T)]
    return x.reshape(T, n), np.array(blocks)


@every_kind
@pytest.mark.parametrize("dts", [(1.0, 1.0, 1.0), (0.5, 2.0, 1.2)])
def test_filter_and_smoother_are_the_joint_gaussian(
    kind: type[GaussianFilter], dts: Sequence[float]
) -> None:
    tracker = kind(WALK, SEEN, X, P)
    xs, Ps, _, _ = tracker.batch_filter(ZS, dts=dts)
    for t in range(3):
        x, V = joint(ZS[: t + 1], dts)
        np.testing.assert_allclose(xs[t], x[-1], atol=1e-12)
        np.testing.assert_allclose(Ps[t], V[-1], atol=1e-12)
    smooth, V_smooth, _, _ = tracker.rts_smoother(xs, Ps, dts=dts)
    x, V = joint(ZS, dts)
    np.testing.assert_allclose(smooth, x, atol=1e-12)
    np.testing.assert_allclose(V_smooth, V, atol=1e-12)


@every_kind
def test_log_likelihoods_add_up_to_that_of_all_measurements(kind: type[GaussianFilter]) -> None:
    tracker = kind(WALK, SEEN, X, P)
    total = 0.0
    for z in ZS:
        tracker.predict()
        tracker.update(z)
        total += tracker.log_likelihood
    one = LinearMotion(np.eye(8), np.zeros((8, 8)))
    A = np.zeros((8, 8))  # start, then three noises
    F = WALK.F()
    for t in range(4):
        for s in range(t + 1):
            A[2 * t : 2 * t + 2, 2 * s : 2 * s + 2] = np.linalg.matrix_power(F, t - s)
    V = A @ np.kron(np.diag([0.0, 1, 1, 1]), WALK.Q()) @ A.T
    V += A[:, :2] @ P @ A[:, :2].T
    H = np.kron(np.eye(4)[1:], SEEN.H())
    whole = Kalman(one, LinearMeasurement(H, np.kron(np.eye(3), SEEN.R)), A[:, :2] @ X, V)
    whole.update(ZS.ravel())
    assert whole.log_likelihood == pytest.approx(total, abs=1e-10)


@every_kind
def test_partly_missing_is_the_update_by_the_rest(kind: type[GaussianFilter]) -> None:
    tracker, other = kind(WALK, SEEN, X, P), kind(WALK, SEEN, X, P)
    tracker.update([np.nan, 0.3])
    other.update([0.3], R=SEEN.R[1:, 1:], H=SEEN.H()[1:])
    np.testing.assert_allclose(tracker.x, other.x, atol=1e-13)
    np.testing.assert_allclose(tracker.P, other.P, atol=1e-13)
    assert tracker.log_likelihood == pytest.approx(other.log_likelihood)
    assert tracker.mahalanobis == pytest.approx(other.mahalanobis)
    assert tracker.y[0] == 0
    assert not tracker.K[:, 0].any()


@every_kind
def test_two_looks_in_one_update_are_two_updates(kind: type[GaussianFilter]) -> None:
    apart = LinearMeasurement(SEEN.H(), np.diag([0.5, 0.4]))
    both, each = kind(WALK, apart, X, P), kind(WALK, apart, X, P)
    both.update([0.1, 0.2])
    for z in ([0.1, np.nan], [np.nan, 0.2]):
        each.update(z)
    np.testing.assert_allclose(both.x, each.x, atol=1e-12)
    np.testing.assert_allclose(both.P, each.P, atol=1e-12)


def test_smoother_takes_the_control_into_account() -> None:
    B = np.array([[0.0], [1.0]])
    pushed = Kalman(LinearMotion(WALK.F(), WALK.Q(), control=B), SEEN, X, P)
    us = [[0.0], [5.0], [-3.0]]
    xs, Ps, _, _ = pushed.batch_filter(ZS, us=us)
    plain = Kalman(WALK, SEEN, X, P)
    drift, shift = np.zeros(2), []
    for u in us:
        drift = WALK.F() @ drift + B @ u
        shift.append(drift)
    zs = ZS - np.array(shift) @ SEEN.H().T
    ys, Vs, _, _ = plain.batch_filter(zs)
    expected = plain.rts_smoother(ys, Vs)[0] + shift
    np.testing.assert_allclose(pushed.rts_smoother(xs, Ps, us=us)[0], expected, atol=1e-12)


# Angles


@pytest.mark.parametrize("kind", [EKF, UKF])
@given(turn=st.floats(-10, 10))
def test_turning_all_angles_turns_the_answer(kind: type[GaussianFilter], turn: float) -> None:
    def answer(turn: float) -> tuple[Float, Float, Float]:
        tracker = kind(VonMisesWalk(30.0), AngleSeen(), [0.3 + turn], [[0.2]])
        xs, Ps, _, _ = tracker.batch_filter(np.array([[0.5], [-0.2], [0.1]]) + turn)
        return xs, Ps, tracker.rts_smoother(xs, Ps)[0]

    for a, b in zip(answer(turn), answer(0.0), strict=True):
        d = a - b
        if a.shape[1:] == (1,):
            d = (d - turn + np.pi) % (2 * np.pi) - np.pi
        np.testing.assert_allclose(d, 0, atol=1e-9)


class AngleSeen(LinearMeasurement):
    """An angle, seen directly."""

    def __init__(self) -> None:
        super().__init__([[1.0]], [[0.05]])

    def residual(self, z: Any, z_pred: Any) -> Float:
        return np.asarray((np.subtract(z, z_pred) + np.pi) % (2 * np.pi) - np.pi)


def test_means_stay_on_the_circle() -> None:
    tracker = UKF(VonMisesWalk(10.0), AngleSeen(), [3.1], [[0.3]])
    for z in (-3.1, -3.0, -2.9):
        tracker.predict()
        tracker.update(z)
        assert -np.pi <= tracker.x[0] < np.pi
    assert tracker.x[0] == pytest.approx(-3.0, abs=0.1)


# Numerics


def test_joseph_form_keeps_a_covariance_a_covariance() -> None:
    sharp = LinearMeasurement([[1.0, 1.0]], [[1e-14]])
    tracker = Kalman(LinearMotion(np.eye(2), np.zeros((2, 2))), sharp, [0.0, 0.0], 1e6 * np.eye(2))
    for _ in range(50):
        tracker.update([1.0])
        assert (tracker.P == tracker.P.T).all()
        assert np.linalg.eigvalsh(tracker.P)[0] > -1e-9


def test_singular_residual_covariance_is_jittered_and_counted() -> None:
    known = Kalman(WALK, LinearMeasurement([[1.0, 0.0]], [[0.0]]), X, np.zeros((2, 2)))
    known.update([1.0])
    assert known.jitter_count == 1
    assert pytest.approx(JITTER) == known.S
    np.testing.assert_array_equal(known.x, X)


def test_another_inverse_is_used() -> None:
    tracker = Kalman(WALK, SEEN, X, P)
    tracker.inv = lambda S: np.zeros_like(S)
    tracker.update([9.0, 9.0])
    np.testing.assert_array_equal(tracker.x, X)


# Batches and runs


@pytest.mark.parametrize(
    "make",
    [
        lambda: Kalman(WALK, SEEN, X, P),
        lambda: UKF(WALK, SEEN, X, P),
        lambda: EKF(CoordinatedTurn(0.1, 0.1), FAR, np.ones(5), P5),
        lambda: UKF(CoordinatedTurn(0.1, 0.1), FAR, np.ones(5), P5),
    ],
)
def test_a_batch_is_its_single_runs(make: Any) -> None:
    tracker = make()
    zs = np.random.default_rng(0).normal(0.5, 0.3, (7, 9, 2))
    zs[2, 3], zs[4, 5, 0] = np.nan, np.nan
    for dt in (1.0, 0.3):
        runs = tracker.run_batch(zs, dt)
        lists = [[None if np.isnan(z).all() else z.tolist() for z in row] for row in zs]
        for sequence, run, same in zip(zs, runs, tracker.run_batch(lists, dt), strict=True):
            single = copy.deepcopy(tracker).run(sequence, dt)
            np.testing.assert_allclose(run.x, single.x, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(run.P, single.P, rtol=1e-12, atol=1e-12)
            np.testing.assert_array_equal(run.x, same.x)
            np.testing.assert_array_equal(run.time, single.time)


def test_sequences_of_unequal_lengths_are_run_one_by_one() -> None:
    tracker = Kalman(WALK, SEEN, X, P)
    runs = tracker.run_batch([ZS, ZS[:2], []])
    assert [len(run) for run in runs] == [3, 2, 0]
    assert tracker.run_batch([]) == []
    np.testing.assert_array_equal(runs[0].x[:2], runs[1].x)


def test_a_run_has_means_and_covariances_and_writes_them(tmp_path: Path) -> None:
    run = Kalman(WALK, SEEN, X, P).run(ZS)
    assert run.x.shape == (3, 2)
    assert run.P.shape == (3, 2, 2)
    last: Any = run.estimate(1)
    np.testing.assert_array_equal(last.P, run.P[1])
    run.to_csv(tmp_path / "x.csv")
    lines = (tmp_path / "x.csv").read_text().splitlines()
    assert lines[0] == "step,time_s,entry,x,std"
    assert lines[-1] == f"2,2,1,{run.x[2, 1]:.9g},{np.sqrt(run.P[2, 1, 1]):.9g}"
    assert Kalman(WALK, SEEN, X, P).run([]).x.size == 0


def test_a_column_runs_too() -> None:
    run = Kalman(WALK, SEEN, X[:, None], P).run(ZS)
    np.testing.assert_array_equal(run.x, Kalman(WALK, SEEN, X, P).run(ZS).x)


def test_create_by_name() -> None:
    for name, kind in (("kalman", Kalman), ("ekf", EKF), ("ukf", UKF)):
        tracker: Any = create(name, motion=WALK, measurement=SEEN, x=X, P=P)
        assert type(tracker) is kind
        tracker.set_params(motion__q=0.9)
        assert tracker.get_params()["motion__q"] == 0.9


def test_a_replaced_motion_is_used_at_the_next_step() -> None:
    tracker = EKF(WALK, SEEN, X, P)
    tracker.motion = ConstantVelocity(q=0.0, n_dims=1)
    tracker.predict()
    np.testing.assert_allclose(tracker.P, WALK.F() @ P @ WALK.F().T)


# Refusals

TWO = LinearMeasurement(np.eye(2), np.eye(2))
BAD_PARTS: list[tuple[Any, type[Exception], str]] = [
    (lambda: Kalman("walk", SEEN, X, P), TypeError, "motion must be a MotionModel; got 'walk'"),  # type: ignore[arg-type]
    (lambda: EKF(WALK, WALK, X, P), TypeError, "measurement must be a MeasurementModel"),  # type: ignore[arg-type]
    (
        lambda: EKF(WALK, SEEN, [1.0], P),
        ValueError,
        r"x must have shape \(2,\) or \(2, 1\); got \(1,\)",
    ),
    (lambda: EKF(WALK, SEEN, [1.0, np.nan], P), ValueError, "x must be finite"),
    (
        lambda: EKF(WALK, SEEN, X, np.eye(3)),
        ValueError,
        r"P must have shape \(2, 2\); got \(3, 3\)",
    ),
    (lambda: EKF(WALK, SEEN, X, [[1.0, 0.5], [0.0, 1.0]]), ValueError, "P must be symmetric"),
    (
        lambda: EKF(WALK, SEEN, X, [[1.0, 2.0], [2.0, 1.0]]),
        ValueError,
        "P must have no negative eigenvalue",
    ),
    (lambda: EKF(WALK, SEEN, X, np.full((2, 2), np.nan)), ValueError, "P must be finite"),
    (
        lambda: EKF(RandomWalk(1.0, 3), SEEN, np.zeros(3), np.eye(3)),
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
    (lambda: UKF(WALK, SEEN, X, P, alpha=0.0), ValueError, "alpha must be finite and positive"),
    (lambda: UKF(WALK, SEEN, X, P, kappa=-2.0), ValueError, "kappa must be above -2"),
    (lambda: IMM([], [], []), ValueError, "filters must have at least two entries; got 0"),
]


@pytest.mark.parametrize(("make", "error", "message"), BAD_PARTS)
def test_bad_parts_are_refused(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


SNAPSHOT = ArraySnapshot(SensorArray.ula(4, 0.5), 1.0)
BAD_CALLS: list[tuple[Any, type[Exception], str]] = [
    (lambda f: f.update([1.0]), ValueError, r"z must have shape \(2,\) or \(2, 1\); got \(1,\)"),
    (lambda f: f.update(1.0), ValueError, r"z must have shape \(2,\)"),
    (lambda f: f.update([[1.0, 2.0], [3.0, 4.0]]), ValueError, r"z must have shape"),
    (lambda f: f.update([1.0, np.inf]), ValueError, "z must be finite, or NaN where missing"),
    (lambda f: f.update("text"), TypeError, "z must hold real numbers"),
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
    (lambda f: f.predict(1.0), ValueError, "motion must have a control matrix where u is given"),
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
def test_refused_calls_leave_everything(
    kind: type[GaussianFilter], call: Any, error: type[Exception], message: str
) -> None:
    tracker = kind(WALK, SEEN, X, P)
    tracker.update([1.0, 1.0])
    before = copy.deepcopy(vars(tracker))
    with pytest.raises(error, match=message):
        call(tracker)
    assert difference(before, vars(tracker)) is None


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
def test_bad_assigned_beliefs_are_refused_at_the_next_call(
    kind: type[GaussianFilter], name: str, value: Any, message: str
) -> None:
    tracker = kind(WALK, SEEN, X, P)
    setattr(tracker, name, value)
    with pytest.raises(ValueError, match=message):
        tracker.predict()
    with pytest.raises(ValueError, match=message):
        tracker.update([1.0, 1.0])


def test_raw_snapshots_are_refused_with_the_cure() -> None:
    source = LinearMotion(np.eye(3), np.eye(3))
    tracker = EKF(source, SNAPSHOT, np.ones(3), np.eye(3))
    with pytest.raises(TypeError, match=r"composite\(z\)"):
        tracker.update(np.ones(4, dtype=complex))


@pytest.mark.parametrize("kind", ["ekf", "ukf", "ckf", "enkf"])
def test_angles_in_filterpy_are_warned_of(kind: Any) -> None:
    with pytest.warns(UserWarning, match="IMMEstimator.*to 0.*arrivals.trackers wrap them"):
        as_filterpy(VonMisesWalk(9.0), ANGLE, kind, x=[0.0], P=[[1.0]])


def test_their_ukf_takes_the_circle_where_it_can() -> None:
    with pytest.warns(UserWarning, match="average"):
        ukf = as_filterpy(VonMisesWalk(9.0), AngleSeen(), "ukf", x=[3.1], P=[[0.1]])
    ours = UKF(VonMisesWalk(9.0), AngleSeen(), [3.1], [[0.1]])
    for f in (ukf, ours):
        f.predict()
        f.update(np.array([-3.0]))
    np.testing.assert_allclose(ukf.x, ours.x, atol=1e-9)


def test_as_filterpy_refuses_what_does_not_fit() -> None:
    with pytest.raises(ValueError, match=r"kind must be one of 'kf', 'ekf'.*got 'kalman'"):
        as_filterpy(WALK, SEEN, "kalman", x=X, P=P)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="motion must be linear"):
        as_filterpy(CoordinatedTurn(1, 1), SEEN, "kf", x=np.ones(5), P=P5)
    with pytest.raises(ValueError, match=r"x must have shape \(2,\); got \(2, 1\)"):
        as_filterpy(WALK, SEEN, "kf", x=X[:, None], P=P)
