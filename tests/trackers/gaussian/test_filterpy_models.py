"""The filterpy contract, D8 and D12: models of this library inside filters of filterpy."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from filterpy.kalman import (
    CubatureKalmanFilter,
    EnsembleKalmanFilter,
    ExtendedKalmanFilter,
    MerweScaledSigmaPoints,
    UnscentedKalmanFilter,
)
from filterpy_twins import (
    BEARING,
    POSITION,
    WALK,
    P,
    X,
    assert_twins,
    plain,
    track,
)

from arrivals.measurement_models import MeasurementModel
from arrivals.motion_models import (
    CoordinatedTurn,
    MotionModel,
)
from arrivals.trackers import EKF, UKF, as_filterpy
from arrivals.typing import Float

# D8


def ready(made: Any, motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float) -> Any:
    made.x, made.P, made.Q, made.R = x.copy(), P.copy(), motion.Q(), measurement.R
    return made


def test_d8_models_run_in_filterpy_ekf() -> None:
    ekf = ready(ExtendedKalmanFilter(4, 3), WALK, BEARING, X, P)
    ekf.F = WALK.F()
    tracker = EKF(WALK, BEARING, X, P)
    for seed in range(10):
        z = BEARING.sample(X, np.random.default_rng(seed))
        ekf.predict()
        ekf.update(z, BEARING.H, BEARING.h, residual=BEARING.residual)
        tracker.predict()
        tracker.update(z)
        assert_twins(tracker, ekf, 1e-12, "x P K S y log_likelihood mahalanobis")


@pytest.mark.parametrize(
    ("motion", "x"), [(WALK, X), (CoordinatedTurn(0.05, 0.01), np.array([*X, 0.05]))]
)
def test_d8_models_run_in_filterpy_ukf(motion: MotionModel, x: Float) -> None:
    points = MerweScaledSigmaPoints(len(x), alpha=0.5, beta=2.0, kappa=0.0)
    made = UnscentedKalmanFilter(len(x), 3, 1.0, BEARING.h, motion.f, points)
    ukf = ready(made, motion, BEARING, x, np.eye(len(x)) * 0.1)
    tracker = UKF(motion, BEARING, x, np.eye(len(x)) * 0.1)
    for seed in range(10):
        z = BEARING.sample(x, np.random.default_rng(seed))
        ukf.predict()
        ukf.update(z)
        tracker.predict()
        tracker.update(z)
        assert_twins(tracker, ukf, 1e-9, "x P K S y log_likelihood")


def test_d8_models_run_in_filterpy_ckf() -> None:
    made = CubatureKalmanFilter(4, 3, 1.0, BEARING.h, WALK.f)
    ckf, tracker = ready(made, WALK, BEARING, X, P), EKF(WALK, BEARING, X, P)
    for seed in range(5):
        z = BEARING.sample(X, np.random.default_rng(seed))
        ckf.predict()
        ckf.update(z[:, None])  # it needs columns
        tracker.predict()
        tracker.update(z)
    np.testing.assert_allclose(ckf.x.ravel(), tracker.x, atol=0.1)


def test_d8_models_run_in_filterpy_enkf() -> None:
    np.random.seed(0)  # noqa: NPY002  # filterpy draws from the global generator
    made = EnsembleKalmanFilter(X, P, 3, 1.0, 500, BEARING.h, WALK.f)
    made.Q, made.R = WALK.Q(), BEARING.R
    tracker = EKF(WALK, BEARING, X, P)
    for seed in range(5):
        for f in (made, tracker):
            f.predict()
            f.update(BEARING.sample(X, np.random.default_rng(seed)))
    np.testing.assert_allclose(made.x, tracker.x, atol=0.3)


def test_d8_arguments_are_unchanged_and_columns_rejected_with_the_cure() -> None:
    x = X.copy()
    for call in (WALK.f, WALK.F, BEARING.h, BEARING.H, POSITION.h, POSITION.H):
        call(x)
        np.testing.assert_array_equal(x, X)
    for refuses in (WALK.f, BEARING.h, BEARING.H, POSITION.h):
        with pytest.raises(ValueError, match=r"column \(4, 1\): pass x.ravel\(\)"):
            refuses(X.reshape(4, 1))


@pytest.mark.parametrize("kind", ["ekf", "ukf", "ckf", "enkf"])
def test_d8_as_filterpy_returns_a_filter_that_runs(kind: Any) -> None:
    np.random.seed(1)  # noqa: NPY002
    f = as_filterpy(WALK, BEARING, kind, x=X, P=P, n_members=400)
    tracker = EKF(WALK, BEARING, X, P)
    for seed in range(5):
        z = BEARING.sample(X, np.random.default_rng(seed))
        for each in (f, tracker):
            each.predict()
            each.update(z)
    tolerance = 1e-12 if kind == "ekf" else 0.3
    np.testing.assert_allclose(np.ravel(f.x), tracker.x, atol=tolerance)
    again = copy.deepcopy(f)
    again.update(z)
    np.testing.assert_allclose(np.ravel(f.x), tracker.x, atol=tolerance)


def test_d8_as_filterpy_kf_equals_kalman_filter() -> None:
    kf = as_filterpy(WALK, POSITION, "kf", x=X, P=P, dt=0.5)
    tracker = plain()
    for z in track():
        kf.predict()
        kf.update(z)
        tracker.predict(dt=0.5)
        tracker.update(z)
    assert_twins(tracker, kf)


def test_d8_as_filterpy_ekf_equals_ekf_on_a_turn() -> None:
    turn = CoordinatedTurn(0.05, 0.01)
    ekf = as_filterpy(turn, BEARING, "ekf", x=[*X, 0.3], P=np.eye(5))
    tracker = EKF(turn, BEARING, [*X, 0.3], np.eye(5))
    ekf = pickle.loads(pickle.dumps(ekf))
    for f in (ekf, tracker):
        f.predict()
        f.update([0.6, 2.7, -1.2])
    assert_twins(tracker, ekf, names="x P")


def test_d12_as_filterpy_ekf_is_copied_and_pickled() -> None:
    ekf = as_filterpy(WALK, BEARING, "ekf", x=X, P=P)
    copies = copy.deepcopy(ekf), pickle.loads(pickle.dumps(ekf))
    for each in (ekf, *copies):
        each.predict()
        each.update(BEARING.h(X))
    for each in copies:
        assert isinstance(each, ExtendedKalmanFilter)
        np.testing.assert_array_equal(each.x, ekf.x)
