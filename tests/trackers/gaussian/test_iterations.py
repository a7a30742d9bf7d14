"""Iterated updates, the warning where they are needed, and vague priors with exact sensors."""

import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from arrivals.measurement_models import Bearing, FunctionMeasurement, LinearMeasurement
from arrivals.motion_models import ConstantVelocity, RandomWalk, VonMisesWalk
from arrivals.trackers import EKF, UKF, GaussianFilter, Kalman, create
from arrivals.typing import Float

KINDS: list[type[GaussianFilter]] = [EKF, UKF]
CROSSED = Bearing([[0.0, 0.0], [60.0, 10.0]], noise=4e-6)
VAGUE = np.diag([4e5, 1.0, 4e5, 1.0])


def vague(kind: Any, seed: int, **options: Any) -> tuple[Any, Float]:
    """Return a filter that starts some 200 m off, and the place of the source."""
    rng = np.random.default_rng(seed)
    place = np.array([rng.uniform(-80, 140), 0.0, rng.uniform(120, 350), 0.0])
    start = place + np.array([200 * rng.normal(), 0, 200 * rng.normal(), 0])
    return kind(ConstantVelocity(q=1e-3), CROSSED, start, VAGUE, **options), place


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", KINDS)
def test_crossed_bearings_from_a_vague_start_find_the_place(kind: Any, seed: int) -> None:
    tracker, place = vague(kind, seed, iterations=10)
    for _ in range(15):
        tracker.predict()
        tracker.update(CROSSED.h(place))
    assert np.hypot(*(tracker.x - place)[[0, 2]]) < 2.0


@pytest.mark.parametrize("kind", KINDS)
def test_single_linearization_of_a_vague_start_warns_once(kind: Any) -> None:
    tracker, place = vague(kind, 0)
    with pytest.warns(UserWarning, match="far from linear over the prior.*set iterations"):
        tracker.update(CROSSED.h(place))
    tracker.update(CROSSED.h(place))


def test_iterated_ekf_update_is_the_maximum_a_posteriori() -> None:
    x, P = np.array([3.0, 4.0]), np.array([[2.0, 0.5], [0.5, 1.0]])
    model = Bearing([[0.0, 0.0], [5.0, 0.0]], noise=0.01, position=(0, 1))
    z = np.array([0.6, 1.9])
    tracker = EKF(RandomWalk(0.0), model, x, P, iterations=50)
    tracker.update(z)

    def cost(c: Float) -> float:
        y, d = model.residual(z, model.h(c)), c - x
        return float(0.5 * (y @ np.linalg.solve(model.R, y) + d @ np.linalg.solve(P, d)))

    np.testing.assert_allclose(tracker.x, minimize(cost, x, tol=1e-12).x, atol=1e-5)
    H = model.H(tracker.x)
    expected = np.linalg.inv(np.linalg.inv(P) + H.T @ np.linalg.inv(model.R) @ H)
    np.testing.assert_allclose(tracker.P, expected, rtol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_iterations_of_a_linear_measurement_change_nothing(kind: Any) -> None:
    model = LinearMeasurement([[1.0, 0.5], [0.0, 1.0]], [[0.5, 0.1], [0.1, 0.4]])
    arguments = (RandomWalk(0.2), model, [1.0, 2.0], np.eye(2))
    once, often = kind(*arguments), kind(*arguments, iterations=7)
    for z in ([1.0, 2.5], [np.nan, 1.0], [0.4, 0.2]):
        for tracker in (once, often):
            tracker.predict()
            tracker.update(z)
        for name in ("x", "P", "K", "y", "log_likelihood"):
            np.testing.assert_allclose(getattr(often, name), getattr(once, name), atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_batch_of_iterated_updates_equals_single_runs(kind: Any) -> None:
    tracker, place = vague(kind, 3, iterations=6)
    rng = np.random.default_rng(1)
    zs = np.array([[CROSSED.sample(place + offset, rng) for _ in range(4)]
                   for offset in ([0, 0, 0, 0], [40, 0, 90, 0], [-60, 0, 20, 0])])  # fmt: skip
    zs[1, 2, 0] = zs[2, 0] = np.nan
    for run, sequence in zip(tracker.run_batch(zs), zs, strict=True):
        single = copy.deepcopy(tracker).run(sequence)
        np.testing.assert_allclose(run.x, single.x, rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(run.P, single.P, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
@given(turn=st.floats(-10, 10))
def test_iterated_update_of_an_angle_rotates_with_it(kind: Any, turn: float) -> None:
    def measured(x: Float) -> Float:
        return np.array([np.cos(x[0]), np.sin(x[0])])

    model = FunctionMeasurement(measured, R=0.01 * np.eye(2))
    means = []
    for shift in (0.0, turn):
        tracker = kind(VonMisesWalk(30.0), model, [0.4 + shift], [[0.3]], iterations=8)
        tracker.update(measured(np.array([-0.2 + shift])))
        means.append(tracker.x[0] - shift)
    assert np.exp(1j * means[0]) == pytest.approx(np.exp(1j * means[1]), abs=1e-4)


@pytest.mark.parametrize("bad", [0, -1, 1.5, True])
@pytest.mark.parametrize("kind", KINDS)
def test_number_of_iterations_is_checked(kind: Any, bad: Any) -> None:
    with pytest.raises((ValueError, TypeError), match="iterations must be"):
        vague(kind, 0, iterations=bad)


def test_iterations_are_a_parameter() -> None:
    tracker, _ = vague(UKF, 0, iterations=4)
    assert tracker.get_params()["iterations"] == 4
    assert tracker.set_params(iterations=2).iterations == 2


@pytest.mark.parametrize("exponent", [0, 8, 16, 20, 24])
@pytest.mark.parametrize("noise", [1e-12, 1e-5, 1.0])
def test_ukf_equals_kalman_from_a_vague_prior_with_an_exact_sensor(
    exponent: int, noise: float
) -> None:
    model = LinearMeasurement([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0, 0.0]], noise * np.eye(2))
    P = noise * 10.0**exponent * np.eye(4)
    ukf, kalman = (
        create(kind, motion=ConstantVelocity(q=0.01), measurement=model, x=np.zeros(4), P=P)
        for kind in ("ukf", "kalman")
    )
    for k in range(1, 12):
        for tracker in (ukf, kalman):
            tracker.predict()
            tracker.update([3.0 * k, -2.0 * k])
            assert np.linalg.eigvalsh(tracker.P)[0] > -1e-9 * np.abs(tracker.P).max()
        np.testing.assert_allclose(ukf.x, kalman.x, rtol=1e-9, atol=1e-9)
    assert isinstance(kalman, Kalman)
