"""Kalman filters of a block of samples: equality with filterpy and with each other."""

from typing import Any

import numpy as np
import pytest
from autoregressive_scenes import DOA, TWO
from filterpy.kalman import KalmanFilter

from arrivals.measurement_models import ArrayManifold, SensorArray
from arrivals.motion_models import AutoregressiveSources
from arrivals.motion_models.autoregressive.companion_form import companion_layout
from arrivals.trackers.autoregressive.steady_state import (
    StateSpace,
    exact_filter,
    fixed_gain,
    steady_filter,
)
from arrivals.typing import Float


def belief(motion: AutoregressiveSources, manifold: ArrayManifold) -> dict[str, Any]:
    layout = companion_layout(motion.orders, lag_by_lag=True)
    return {
        "x": np.zeros((motion.n_parts, layout.dim)),
        "P": np.eye(layout.dim),
        "F": layout.transition(motion.coefficient_matrix),
        "Q": layout.process_noise(np.array(motion.noise)),
        "A": manifold.real_steering(DOA).T,
        "r": np.array([[0.1]]),
    }


def composite_filter(parts: dict[str, Any], y: Float) -> tuple[Float, Float]:
    """Run filterpy's filter on real and imaginary parts."""
    n, (m, k) = len(parts["F"]), parts["A"].shape
    kf, two = KalmanFilter(2 * n, 2 * m), np.eye(2)
    kf.F, kf.Q, kf.P = np.kron(two, parts["F"]), np.kron(two, parts["Q"]) / 2, parts["P"]
    kf.P = np.kron(two, parts["P"]) / 2
    kf.H, kf.R = np.kron(two, parts["A"] @ np.eye(n)[:k]), 0.05 * np.eye(2 * m)
    means = []
    for row in y.reshape(-1, 2 * m):
        kf.predict()
        kf.update(row)
        means.append(kf.x.reshape(2, n))
    return np.reshape(means, (-1, n)), kf.P


def test_exact_filter_of_complex_states_equals_filterpy_on_stacked_parts() -> None:
    parts = belief(TWO, ArrayManifold(SensorArray.symmetric([0.25]), 1.0))
    y = np.random.default_rng(0).standard_normal((40, 3))  # 20 snapshots
    model = StateSpace(*(parts[name] for name in ("F", "Q", "A", "r")))
    X, P = exact_filter(parts["x"], parts["P"], y, model)
    means, covariance = composite_filter(parts, y)
    np.testing.assert_allclose(X, means, atol=1e-12)
    np.testing.assert_allclose(np.kron(np.eye(2), P[-1]) / 2, covariance, atol=1e-12)


def test_steady_filter_from_steady_covariance_equals_exact_filter() -> None:
    parts = belief(TWO, ArrayManifold(SensorArray.symmetric([0.25, 0.5]), 1.0))
    y = np.random.default_rng(0).standard_normal((300, 5))
    model = StateSpace(*(parts[name] for name in ("F", "Q", "A", "r")))
    _, P = steady_filter(parts["x"], parts["P"], y, model)
    _, Ps = exact_filter(parts["x"], parts["P"], y, model)
    np.testing.assert_allclose(P, Ps[-1], atol=1e-4 * np.abs(P).max())
    for _ in range(2):  # continue from the last covariance
        X, P = steady_filter(parts["x"], P, y, model)
    exact, Ps = exact_filter(parts["x"], P, y, model)
    np.testing.assert_allclose(P, Ps[-1], atol=1e-10)
    np.testing.assert_allclose(X[-1], exact[-1], atol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 5, 30])
def test_fixed_gain_equals_the_recursion(n: int) -> None:
    rng = np.random.default_rng(n)
    Phi, b, x = rng.standard_normal((3, 3)) / 3, rng.standard_normal((n, 3)), np.ones((1, 3))
    step, expected = x[0], []
    for row in b:
        step = Phi @ step + row
        expected.append(step)
    np.testing.assert_allclose(fixed_gain(x, Phi, b), expected, atol=1e-13)


def test_exact_filter_without_valid_data_only_predicts() -> None:
    parts = belief(TWO, ArrayManifold(SensorArray.symmetric([0.25]), 1.0))
    parts["x"] = np.ones((2, 6))
    y = np.full((2, 3), np.nan)
    model = StateSpace(*(parts[name] for name in ("F", "Q", "A", "r")))
    X, P = exact_filter(parts["x"], parts["P"], y, model)
    np.testing.assert_allclose(X, parts["x"] @ parts["F"].T)
    np.testing.assert_allclose(P[0], parts["F"] @ parts["F"].T + parts["Q"])
