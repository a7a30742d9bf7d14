"""Faults of filterpy 2.0.0 that this library does not inherit, and the right results."""

from typing import Any

import numpy as np
import pytest
from filterpy.kalman import (
    IMMEstimator,
    KalmanFilter,
    MMAEFilterBank,
)
from filterpy.monte_carlo import systematic_resample as their_resample
from filterpy_twins import (
    POSITION,
    WALK,
    M,
    P,
    X,
    assert_twins,
    plain,
    theirs,
    track,
)

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import (
    RandomWalk,
)
from arrivals.trackers import IMM, UKF, Kalman, as_filterpy
from arrivals.trackers.gaussian.particle import systematic_resample


def test_fault_mmae_covariance() -> None:
    """Means (0, 0) and (2, 0): variances 0.78 and 2 by moments; filterpy has 1.61 and 2.5."""

    def two() -> list[Any]:
        filters = [KalmanFilter(2, 1) for _ in range(2)]
        for f, x in zip(filters, ([0.0, 0.0], [2.0, 0.0]), strict=True):
            f.x, f.P, f.H, f.R = np.array(x), np.eye(2), np.array([[1.0, 0.0]]), np.eye(1)
        return filters

    bank = MMAEFilterBank(two(), [0.5, 0.5], 2)
    bank.predict()
    bank.update(1.0)
    np.testing.assert_allclose(bank.P, [[1.6111, 0.1667], [0.1667, 2.5]], atol=1e-4)
    right = sum(
        p * (f.P + np.outer(f.x - bank.x, f.x - bank.x))
        for p, f in zip(bank.p, bank.filters, strict=True)
    )
    np.testing.assert_allclose(right, [[0.7778, 0.0], [0.0, 2.0]], atol=1e-4)
    ours = IMM(two(), [0.5, 0.5], np.eye(2))  # an MMAE is an IMM that never switches
    ours.predict()
    ours.update(1.0)
    np.testing.assert_allclose(ours.P, right)


def test_fault_imm_averages_angles_to_their_opposite() -> None:
    members = [KalmanFilter(1, 1), KalmanFilter(1, 1)]
    for f, x in zip(members, (np.pi - 0.05, -np.pi + 0.05), strict=True):
        f.x = np.array([x])
    assert IMMEstimator(members, [0.5, 0.5], M).x == pytest.approx(0.0)
    ours = IMM(members, [0.5, 0.5], M, angles=(0,))
    assert abs(ours.x[0]) == pytest.approx(np.pi)


def test_fault_ukf_smoother_ignores_qs() -> None:
    zs = track(6)
    Qs = [WALK.Q() * scale for scale in (1.0, 1.0, 50.0, 1.0, 1.0, 1.0)]
    ukf = as_filterpy(WALK, POSITION, "ukf", x=X, P=P)
    kalman, tracker = plain(), plain(kind=UKF)
    xs, Ps = kalman.batch_filter(zs, Qs=Qs)[:2]
    np.testing.assert_array_equal(ukf.rts_smoother(xs, Ps, Qs=Qs)[0], ukf.rts_smoother(xs, Ps)[0])
    right = theirs().rts_smoother(xs, Ps, Qs=Qs)
    for ours in (kalman, tracker):
        for a, b in zip(ours.rts_smoother(xs, Ps, Qs=Qs), right, strict=True):
            np.testing.assert_allclose(a, b, atol=1e-9)


def test_fault_complex_h_gives_negative_variances() -> None:
    kf = KalmanFilter(1, 1)
    kf.x, kf.H = np.array([1.0]), np.array([[2j]])
    kf.update(np.array([1j]))
    assert kf.P.real < 0 or kf.P.real > 1  # no error, and no covariance any more
    with pytest.raises(TypeError, match=r"must hold real numbers.*\[Re; Im\]"):
        LinearMeasurement([[1j]], [[1.0]])
    tracker = Kalman(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[1.0]]), [1.0], [[1.0]])
    with pytest.raises(TypeError, match="H must hold real numbers; got complex128"):
        tracker.update(1.0, H=[[1j]])
    with pytest.raises(TypeError, match=r"real numbers.*composite\(z\)"):
        tracker.update([1j])


def test_fault_second_update_uses_stale_sigma_points() -> None:
    """Two updates by linear measurements are two Kalman updates; filterpy's UKF and CKF differ."""
    right, ours = plain(), plain(kind=UKF)
    stale = [as_filterpy(WALK, POSITION, kind, x=X, P=P) for kind in ("ukf", "ckf")]
    for f in (right, ours, *stale):
        f.predict()
        for z in track(2):
            f.update(z)
    assert_twins(ours, right, 1e-9)
    for f in stale:
        assert np.abs(np.ravel(f.x) - right.x).max() > 0.01


def test_fault_resampling_draws_from_the_global_generator() -> None:
    weights = np.random.default_rng(0).dirichlet(np.ones(50))
    draws = []
    for _ in range(2):
        np.random.seed(3)  # noqa: NPY002
        draws.append(their_resample(weights))
    np.testing.assert_array_equal(*draws)
    before = np.random.get_state()[1].copy()  # type: ignore[index]  # noqa: NPY002
    ours = systematic_resample(weights, np.random.default_rng(1))
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # type: ignore[index]  # noqa: NPY002
    assert np.abs(np.bincount(ours, minlength=50) - 50 * weights).max() < 1
