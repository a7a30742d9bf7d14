"""Filters and smoothers against the joint Gaussian of all steps; angles, numerics, batches."""

import copy
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import Bearing, LinearMeasurement
from arrivals.motion_models import (
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    VonMisesWalk,
)
from arrivals.trackers import EKF, UKF, GaussianFilter, Kalman, as_filterpy, create
from arrivals.trackers.gaussian.linalg import JITTER
from arrivals.typing import Float

KINDS: list[type[GaussianFilter]] = [Kalman, EKF, UKF]
every_kind = pytest.mark.parametrize("kind", KINDS)
WALK = ConstantVelocity(q=0.3, n_dims=1)
POSITION = LinearMeasurement([[1.0, 0.0], [1.0, 1.0]], [[0.5, 0.1], [0.1, 0.4]])
X, P = np.array([1.0, -0.5]), np.array([[1.0, 0.2], [0.2, 0.5]])
ZS = np.array([[1.0, 0.2], [np.nan, 0.7], [0.4, np.nan]])
FAR, P5 = Bearing([[9.0, 9.0], [-9.0, 5.0]], noise=0.5), 0.1 * np.eye(5)
ANGLE = LinearMeasurement([[1.0]], [[0.01]])


def joint(zs: Float, dts: Sequence[float]) -> tuple[Float, Float]:
    """Return means and covariances of all states given all measurements, by one regression."""
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
    H = np.kron(np.eye(T), POSITION.H())
    R = np.kron(np.eye(T), POSITION.R)
    valid = ~np.isnan(zs.ravel())
    H, R = H[valid], R[np.ix_(valid, valid)]
    K = C @ H.T @ np.linalg.inv(H @ C @ H.T + R)
    x = mean + K @ (zs.ravel()[valid] - H @ mean)
    V = C - K @ H @ C
    blocks = [V[t * n : (t + 1) * n, t * n : (t + 1) * n] for t in range(T)]
    return x.reshape(T, n), np.array(blocks)


@every_kind
@pytest.mark.parametrize("dts", [(1.0, 1.0, 1.0), (0.5, 2.0, 1.2)])
def test_filter_and_smoother_equal_the_joint_gaussian(
    kind: type[GaussianFilter], dts: Sequence[float]
) -> None:
    tracker = kind(WALK, POSITION, X, P)
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
def test_log_likelihoods_sum_to_that_of_all_measurements(kind: type[GaussianFilter]) -> None:
    tracker = kind(WALK, POSITION, X, P)
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
    H = np.kron(np.eye(4)[1:], POSITION.H())
    whole = Kalman(one, LinearMeasurement(H, np.kron(np.eye(3), POSITION.R)), A[:, :2] @ X, V)
    whole.update(ZS.ravel())
    assert whole.log_likelihood == pytest.approx(total, abs=1e-10)


@every_kind
def test_partly_missing_measurement_equals_update_by_the_valid_entries(
    kind: type[GaussianFilter],
) -> None:
    tracker, other = kind(WALK, POSITION, X, P), kind(WALK, POSITION, X, P)
    tracker.update([np.nan, 0.3])
    other.update([0.3], R=POSITION.R[1:, 1:], H=POSITION.H()[1:])
    np.testing.assert_allclose(tracker.x, other.x, atol=1e-13)
    np.testing.assert_allclose(tracker.P, other.P, atol=1e-13)
    assert tracker.log_likelihood == pytest.approx(other.log_likelihood)
    assert tracker.mahalanobis == pytest.approx(other.mahalanobis)
    assert tracker.y[0] == 0
    assert not tracker.K[:, 0].any()


@every_kind
def test_stacked_measurement_equals_two_updates(kind: type[GaussianFilter]) -> None:
    apart = LinearMeasurement(POSITION.H(), np.diag([0.5, 0.4]))
    both, each = kind(WALK, apart, X, P), kind(WALK, apart, X, P)
    both.update([0.1, 0.2])
    for z in ([0.1, np.nan], [np.nan, 0.2]):
        each.update(z)
    np.testing.assert_allclose(both.x, each.x, atol=1e-12)
    np.testing.assert_allclose(both.P, each.P, atol=1e-12)


def test_smoother_includes_the_control_input() -> None:
    B = np.array([[0.0], [1.0]])
    pushed = Kalman(LinearMotion(WALK.F(), WALK.Q(), control=B), POSITION, X, P)
    us = [[0.0], [5.0], [-3.0]]
    xs, Ps, _, _ = pushed.batch_filter(ZS, us=us)
    plain = Kalman(WALK, POSITION, X, P)
    drift, shift = np.zeros(2), []
    for u in us:
        drift = WALK.F() @ drift + B @ u
        shift.append(drift)
    zs = ZS - np.array(shift) @ POSITION.H().T
    ys, Vs, _, _ = plain.batch_filter(zs)
    expected = plain.rts_smoother(ys, Vs)[0] + shift
    np.testing.assert_allclose(pushed.rts_smoother(xs, Ps, us=us)[0], expected, atol=1e-12)


# Angles


@pytest.mark.parametrize("kind", [EKF, UKF])
@given(turn=st.floats(-10, 10))
def test_rotated_angles_rotate_the_estimate(kind: type[GaussianFilter], turn: float) -> None:
    def answer(turn: float) -> tuple[Float, Float, Float]:
        tracker = kind(VonMisesWalk(30.0), WrappedAngle(), [0.3 + turn], [[0.2]])
        xs, Ps, _, _ = tracker.batch_filter(np.array([[0.5], [-0.2], [0.1]]) + turn)
        return xs, Ps, tracker.rts_smoother(xs, Ps)[0]

    for a, b in zip(answer(turn), answer(0.0), strict=True):
        d = a - b
        if a.shape[1:] == (1,):
            d = (d - turn + np.pi) % (2 * np.pi) - np.pi
        np.testing.assert_allclose(d, 0, atol=1e-9)


class WrappedAngle(LinearMeasurement):
    """Direct measurement of an angle."""

    def __init__(self) -> None:
        super().__init__([[1.0]], [[0.05]])

    def residual(self, z: Any, z_pred: Any) -> Float:
        return np.asarray((np.subtract(z, z_pred) + np.pi) % (2 * np.pi) - np.pi)


def test_means_of_angles_are_in_range() -> None:
    tracker = UKF(VonMisesWalk(10.0), WrappedAngle(), [3.1], [[0.3]])
    for z in (-3.1, -3.0, -2.9):
        tracker.predict()
        tracker.update(z)
        assert -np.pi <= tracker.x[0] < np.pi
    assert tracker.x[0] == pytest.approx(-3.0, abs=0.1)


def test_filterpy_ukf_averages_angles_like_ukf() -> None:
    with pytest.warns(UserWarning, match="average"):
        ukf = as_filterpy(VonMisesWalk(9.0), WrappedAngle(), "ukf", x=[3.1], P=[[0.1]])
    ours = UKF(VonMisesWalk(9.0), WrappedAngle(), [3.1], [[0.1]])
    for f in (ukf, ours):
        f.predict()
        f.update(np.array([-3.0]))
    np.testing.assert_allclose(ukf.x, ours.x, atol=1e-9)


# Numerics


def test_joseph_form_keeps_covariance_positive() -> None:
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


def test_assigned_inverse_is_used() -> None:
    tracker = Kalman(WALK, POSITION, X, P)
    tracker.inv = lambda S: np.zeros_like(S)
    tracker.update([9.0, 9.0])
    np.testing.assert_array_equal(tracker.x, X)


# Batches and runs


@pytest.mark.parametrize(
    "make",
    [
        lambda: Kalman(WALK, POSITION, X, P),
        lambda: UKF(WALK, POSITION, X, P),
        lambda: EKF(CoordinatedTurn(0.1, 0.1), FAR, np.ones(5), P5),
        lambda: UKF(CoordinatedTurn(0.1, 0.1), FAR, np.ones(5), P5),
    ],
)
def test_run_batch_equals_single_runs(make: Any) -> None:
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


def test_run_batch_accepts_sequences_of_unequal_lengths() -> None:
    tracker = Kalman(WALK, POSITION, X, P)
    runs = tracker.run_batch([ZS, ZS[:2], []])
    assert [len(run) for run in runs] == [3, 2, 0]
    assert tracker.run_batch([]) == []
    np.testing.assert_array_equal(runs[0].x[:2], runs[1].x)


def test_run_has_means_and_covariances_and_writes_csv(tmp_path: Path) -> None:
    run = Kalman(WALK, POSITION, X, P).run(ZS)
    assert run.x.shape == (3, 2)
    assert run.P.shape == (3, 2, 2)
    last: Any = run.estimate(1)
    np.testing.assert_array_equal(last.P, run.P[1])
    run.to_csv(tmp_path / "x.csv")
    lines = (tmp_path / "x.csv").read_text().splitlines()
    assert lines[0] == "step,time_s,entry,x,std"
    assert lines[-1] == f"2,2,1,{run.x[2, 1]:.9g},{np.sqrt(run.P[2, 1, 1]):.9g}"
    assert Kalman(WALK, POSITION, X, P).run([]).x.size == 0


def test_run_accepts_a_column_state() -> None:
    run = Kalman(WALK, POSITION, X[:, None], P).run(ZS)
    np.testing.assert_array_equal(run.x, Kalman(WALK, POSITION, X, P).run(ZS).x)


def test_create_makes_filters_by_name() -> None:
    for name, kind in (("kalman", Kalman), ("ekf", EKF), ("ukf", UKF)):
        tracker: Any = create(name, motion=WALK, measurement=POSITION, x=X, P=P)
        assert type(tracker) is kind
        tracker.set_params(motion__q=0.9)
        assert tracker.get_params()["motion__q"] == 0.9


def test_replaced_motion_is_used_at_the_next_step() -> None:
    tracker = EKF(WALK, POSITION, X, P)
    tracker.motion = ConstantVelocity(q=0.0, n_dims=1)
    tracker.predict()
    np.testing.assert_allclose(tracker.P, WALK.F() @ P @ WALK.F().T)
