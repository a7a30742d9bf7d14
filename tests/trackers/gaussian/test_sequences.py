"""Whole sequences of linear filters: equal to the steps one by one."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import ConstantVelocity, LinearMotion
from arrivals.trackers import Kalman
from arrivals.trackers.filterpy import KalmanFilter
from arrivals.trackers.gaussian.arguments import has_own_steps
from arrivals.trackers.gaussian.sequences.linear_steps import LinearSteps
from arrivals.typing import Float

X, H = np.array([5.0, 0.1, 4.0, -0.1]), np.eye(4)[::2]
RECORDED = ("x", "P", "x_prior", "P_prior", "x_post", "P_post", "z", "y", "K", "S", "SI",
            "log_likelihood", "mahalanobis", "jitter_count")  # fmt: skip


def kalman(column: bool = False) -> Kalman:
    x = X[:, None] if column else X
    return Kalman(ConstantVelocity(q=0.1), LinearMeasurement(H, np.eye(2)), x, np.eye(4))


def measurements(gaps: str, *lead: int) -> Float:
    rng = np.random.default_rng(0)
    z = rng.normal(X[::2], 1.0, (*lead, 2))
    if gaps == "entries":
        z[rng.random(z.shape) < 0.2] = np.nan
    if gaps == "of all":
        z[..., 7:12, :] = np.nan
    if gaps == "at the end":
        z[..., -5:, :] = np.nan
    if gaps == "everything":
        z[:] = np.nan
    return z


every_gap = pytest.mark.parametrize(
    "gaps", ["none", "entries", "of all", "at the end", "everything"]
)


@every_gap
@pytest.mark.parametrize("column", [False, True])
def test_batch_filter_equals_steps_and_records_the_last_one(gaps: str, column: bool) -> None:
    zs, whole, steps = measurements(gaps, 80), kalman(column), kalman(column)
    means, covariances, means_prior, covariances_prior = whole.batch_filter(zs)
    for k, z in enumerate(zs):
        steps.predict()
        np.testing.assert_allclose(means_prior[k], steps.x, atol=1e-12)
        np.testing.assert_allclose(covariances_prior[k], steps.P, atol=1e-12)
        steps.update(z)
        np.testing.assert_allclose(means[k], steps.x, atol=1e-12)
        np.testing.assert_allclose(covariances[k], steps.P, atol=1e-12)
    for name in RECORDED:
        ours, theirs = (np.asarray(getattr(each, name)) for each in (whole, steps))
        assert ours.shape == theirs.shape
        np.testing.assert_allclose(ours, theirs, atol=1e-12, err_msg=name)


def test_batch_filter_of_an_overridden_update_calls_it() -> None:
    class Counting(Kalman):
        n_updates = 0

        def update(self, z: Any, R: Any = None, H: Any = None) -> None:
            self.n_updates += 1
            super().update(z, R, H)

    tracker = Counting(ConstantVelocity(q=0.1), LinearMeasurement(H, np.eye(2)), X, np.eye(4))
    tracker.batch_filter(measurements("none", 9))
    assert tracker.n_updates == 9
    assert not has_own_steps(tracker, "linear_steps")
    assert has_own_steps(kalman(), "linear_steps")
    assert has_own_steps(KalmanFilter(2, 1), "linear_steps")


def test_batch_filter_overflow_raises_and_keeps_the_belief() -> None:
    growing = LinearMotion(1e60 * np.eye(2), np.eye(2))
    tracker = Kalman(growing, LinearMeasurement(np.eye(2), np.eye(2)), np.ones(2), np.eye(2))
    with pytest.raises(ValueError, match="belief must stay finite"):
        tracker.batch_filter([None] * 9 + [[1.0, 1.0]])
    np.testing.assert_array_equal(tracker.x, np.ones(2))


@every_gap
def test_run_batch_with_equal_gaps_equals_single_runs(gaps: str) -> None:
    zs = np.repeat(measurements(gaps, 1, 40), 3, axis=0)
    zs += np.random.default_rng(1).normal(size=zs.shape)
    for z, run in zip(zs, kalman().run_batch(zs), strict=True):
        expected = copy.deepcopy(kalman()).run(z)
        np.testing.assert_allclose(run.x, expected.x, atol=1e-12)
        np.testing.assert_allclose(run.P, expected.P, atol=1e-12)


def test_run_batch_with_a_gap_of_one_sequence_equals_single_runs() -> None:
    zs = measurements("none", 3, 40)
    zs[1, 20:22], zs[2, 30, 0] = np.nan, np.nan
    runs = kalman().run_batch(zs)
    for z, run in zip(zs, runs, strict=True):
        expected = copy.deepcopy(kalman()).run(z)
        np.testing.assert_allclose(run.x, expected.x, atol=1e-12)
        np.testing.assert_allclose(run.P, expected.P, atol=1e-12)
    runs[0].P[:] = 0.0  # runs do not share covariances
    assert runs[1].P.any()


def test_linear_steps_compute_a_settled_covariance_once() -> None:
    steps, P = LinearSteps(kalman(), 1.0), np.eye(4)
    for _ in range(200):
        P = steps.covariances(P, None).gain.P
    assert steps.covariances(P, None) is steps.covariances(P.copy(), None)


@pytest.mark.parametrize("inv", [np.linalg.inv, np.linalg.pinv])
def test_rts_smoother_with_matrices_per_step_equals_constant_ones(inv: Any) -> None:
    tracker = kalman()
    means, covariances, _, _ = tracker.batch_filter(measurements("entries", 50))
    constant = tracker.rts_smoother(means, covariances, inv=inv)
    per_step = tracker.rts_smoother(means, covariances, Fs=[tracker.F] * 50, Qs=[tracker.Q] * 50)
    for ours, expected in zip(constant, per_step, strict=True):
        np.testing.assert_allclose(ours, expected, atol=1e-10)
    x, P, _, _ = tracker.rts_smoother(means[:1], covariances[:1])
    np.testing.assert_array_equal(x, means[:1])
    np.testing.assert_array_equal(P, covariances[:1])
