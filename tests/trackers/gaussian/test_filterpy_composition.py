"""The filterpy contract, D7, D9 to D11 and D13: filters of each library inside the other."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from filterpy.common import Saver
from filterpy.kalman import (
    EnsembleKalmanFilter,
    IMMEstimator,
    KalmanFilter,
    MMAEFilterBank,
)
from filterpy_twins import (
    POSITION,
    WALK,
    M,
    P,
    X,
    assert_twins,
    plain,
    stable_system,
    theirs,
    track,
    twins,
)

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import (
    ConstantVelocity,
    LinearMotion,
    VonMisesWalk,
)
from arrivals.trackers import EKF, IMM, UKF, Filter, Kalman, Particle, as_filterpy

# D7


@pytest.mark.parametrize("mixed", [False, True])
def test_d7_tracker_works_inside_filterpy_imm(mixed: bool) -> None:
    bank = IMMEstimator([plain(), theirs(2.0) if mixed else plain(2.0)], [0.5, 0.5], M)
    right = IMMEstimator([theirs(), theirs(2.0)], [0.5, 0.5], M)
    for z in track():
        for f in (bank, right):
            f.predict()
            f.update(z)
        assert_twins(bank, right, names="x P mu")


@pytest.mark.parametrize("mixed", [False, True])
def test_d7_tracker_works_inside_filterpy_mmae(mixed: bool) -> None:
    bank = MMAEFilterBank([plain(), theirs(2.0) if mixed else plain(2.0)], [0.5, 0.5], 4)
    right = MMAEFilterBank([theirs(), theirs(2.0)], [0.5, 0.5], 4)
    for z in track():
        for f in (bank, right):
            f.predict()
            f.update(z)
        assert_twins(bank, right, names="x P p")


# D9


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("update_first", [False, True])
def test_d9_batch_filter_and_smoother_equal_filterpy(column: bool, update_first: bool) -> None:
    tracker, kf = twins(3, column=column)
    rng = np.random.default_rng(5)
    zs: list[Any] = list(rng.normal(size=(8, 2, 1) if column else (8, 2)))
    zs[3] = None
    systems = [stable_system(rng, 3, 2) for _ in zs]
    Fs, Bs, Hs, Qs, Rs, _ = (list(matrices) for matrices in zip(*systems, strict=True))
    us = list(rng.normal(size=(8, 1, 1) if column else (8, 1)))
    matrices: dict[str, Any] = {"Fs": Fs, "Qs": Qs, "Hs": Hs, "Rs": Rs, "Bs": Bs, "us": us}
    for chosen in ({"us": us}, {"Fs": Fs, "Qs": Qs, "us": us}, matrices):
        ours = tracker.batch_filter(zs, update_first=update_first, **chosen)
        for a, b in zip(
            ours, kf.batch_filter(zs, update_first=update_first, **chosen), strict=True
        ):
            assert a.shape == b.shape
            np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)
        both: dict[str, Any] = {key: value for key, value in chosen.items() if key in ("Fs", "Qs")}
        smooth = tracker.rts_smoother(ours[0], ours[1], **both)
        for a, b in zip(smooth, kf.rts_smoother(ours[0], ours[1], **both), strict=True):
            assert a.shape == b.shape
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


def test_d9_batch_filter_calls_the_saver() -> None:
    tracker = plain()
    saver = Saver(tracker)
    means = tracker.batch_filter(track(5), saver=saver)[0]
    saver.to_array()
    np.testing.assert_array_equal(saver.x, means)


# D10


@pytest.mark.parametrize("column", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_d10_kalman_equals_filterpy_kalman_filter(seed: int, column: bool) -> None:
    tracker, kf = twins(seed, n=2 + seed % 3, m=1 + seed % 2, column=column)
    rng = np.random.default_rng(100 + seed)
    m = tracker.dim_z
    for step in range(30):
        z = None if step % 7 == 3 else rng.normal(size=(m, 1) if column else m)
        u = rng.normal(size=(1, 1) if column else 1) if step % 2 else None
        tracker.predict(u)
        kf.predict(u)
        tracker.update(z)
        kf.update(z)
        assert_twins(tracker, kf, 1e-12, "x P x_prior P_prior x_post P_post")
        if z is not None:
            assert_twins(tracker, kf, 1e-10, "y S SI K log_likelihood mahalanobis")


def test_d10_filterpy_manoeuvre_scenario_runs_with_kalman() -> None:
    """Manoeuvre of filterpy's IMM test (Bar-Shalom): velocity, then acceleration, in 2-D."""
    F_cv = np.kron(np.eye(2), [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    F_ca = np.kron(np.eye(2), [[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    H, x = np.eye(6)[::3], np.array([[2000.0], [0], [0], [1e4], [-15], [0]])
    q = np.array([0.25, 0.5, 1.0])
    Q, R, P0 = np.kron(np.eye(2), np.outer(q, q) * 1e-3), np.diag([1e4, 1e4]), np.eye(6) * 1e3

    def filters(ours: bool) -> list[Any]:
        made: list[Any] = []
        for F in (F_cv, F_ca):
            if ours:
                made.append(Kalman(LinearMotion(F, Q), LinearMeasurement(H, R), x, P0))
            else:
                made.append(KalmanFilter(6, 2))
                made[-1].x, made[-1].P, made[-1].F = x, P0, F
                made[-1].Q, made[-1].H, made[-1].R = Q, H, R
        return made

    switch = np.array([[0.97, 0.03], [0.03, 0.97]])
    banks: list[Callable[[list[Any]], Any]] = [
        lambda fs: IMMEstimator(fs, [0.5, 0.5], switch),
        lambda fs: MMAEFilterBank(fs, [0.5, 0.5], 6, H),
    ]
    for make in banks:
        one, other = make(filters(True)), make(filters(False))
        rng = np.random.default_rng(0)
        for step in range(60):
            z = np.array([[2000.0 + max(step - 40, 0) ** 2], [1e4 - 15 * step]])
            z += rng.normal(size=(2, 1)) * 100
            for bank in (one, other):
                bank.predict()
                bank.update(z)
        np.testing.assert_allclose(one.x, other.x, rtol=1e-9)
        np.testing.assert_allclose(one.P, other.P, rtol=1e-9)


# D11


class Constant:
    """A filter with the five names of `Filter` alone."""

    def __init__(self, value: float) -> None:
        self.x, self.P, self.likelihood = np.array([value]), np.eye(1), 1.0

    def predict(self, u: Any = None) -> None:
        pass

    def update(self, z: Any) -> None:
        self.likelihood = float(np.exp(-0.5 * (z - self.x[0]) ** 2))


def test_d11_imm_accepts_any_object_with_the_five_names() -> None:
    for member in (Constant(0.0), plain(), theirs(), Particle(WALK, POSITION, X, P, rng=0)):
        assert isinstance(member, Filter)
    bank = IMM([Constant(0.0), Constant(1.0)], [0.5, 0.5], np.eye(2))
    bank.predict()
    bank.update(1.0)
    assert bank.mu[1] == pytest.approx(1 / (1 + np.exp(-0.5)))
    with pytest.raises(TypeError, match="got EnsembleKalmanFilter without likelihood"):
        IMM([EnsembleKalmanFilter(X, P, 2, 1.0, 5, None, None)] * 2, [0.5, 0.5], M)


def test_d11_imm_accepts_filters_of_filterpy() -> None:
    ukf = as_filterpy(WALK, POSITION, "ukf", x=X, P=P)
    mixed = IMM([theirs(), ukf, plain(1.0)], np.ones(3), np.full((3, 3), 1 / 3))
    right = IMM([plain(), plain(), plain(1.0)], np.ones(3) / 3, np.full((3, 3), 1 / 3))
    for z in track():
        for bank in (mixed, right):
            bank.predict()
            bank.update(z)
        assert_twins(mixed, right, 1e-9, "x P mu log_likelihood")
    with pytest.raises(ValueError, match=r"dt must be 1 for .*, which has a step length"):
        mixed.predict(dt=0.5)


# D13


@pytest.mark.parametrize("column", [False, True])
def test_d13_imm_equals_filterpy_imm_where_that_is_right(column: bool) -> None:
    x = X.reshape(4, 1) if column else X
    ours = IMM([Kalman(ConstantVelocity(q), POSITION, x, P) for q in (0.05, 2.0)], [0.6, 0.4], M)
    other = IMMEstimator([theirs(0.05, column), theirs(2.0, column)], [0.6, 0.4], M)
    for z in track(30):
        for bank in (ours, other):
            bank.predict()
            bank.update(z.reshape(2, *x.shape[1:]))
        assert_twins(ours, other, 1e-12, "x P x_post P_post mu likelihood")


def test_d13_imm_averages_angles_of_nonlinear_filters_on_the_circle() -> None:
    position = LinearMeasurement([[1.0]], [[0.01]])
    bank = IMM(
        [
            EKF(VonMisesWalk(50.0), position, [np.pi - 0.05], [[0.01]]),
            UKF(VonMisesWalk(50.0), position, [-np.pi + 0.05], [[0.01]]),
        ],
        [0.5, 0.5],
        M,
    )
    assert abs(bank.x[0]) == pytest.approx(np.pi)
    assert bank.P[0, 0] == pytest.approx(0.01 + 0.05**2)
    bank.predict()
    bank.update(None)
    assert abs(bank.x[0]) > 3.0


def test_d13_probabilities_are_finite_for_impossible_measurements() -> None:
    ours = IMM([plain(1e-6), plain(1.0)], [0.5, 0.5], np.eye(2))
    other = IMMEstimator([theirs(1e-6), theirs(1.0)], [0.5, 0.5], np.eye(2))
    for bank in (ours, other):
        bank.predict()
        bank.update([300.0, 300.0])
    np.testing.assert_allclose(other.mu, [0.5, 0.5])  # both likelihoods are at their floor
    assert ours.mu[1] > 1 - 1e-12
