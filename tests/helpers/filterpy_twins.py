"""Filters of this library and of filterpy on one system, for the tests of the contract."""

from typing import Any

import numpy as np
from filterpy.kalman import (
    KalmanFilter,
)

from arrivals.measurement_models import Bearing, LinearMeasurement
from arrivals.motion_models import (
    ConstantVelocity,
    LinearMotion,
)
from arrivals.trackers import GaussianFilter, Kalman
from arrivals.typing import Float

PLACES = [[0.0, 0.0], [20.0, 0.0], [5.0, 15.0]]
X = np.array([8.0, 0.3, 6.0, -0.2])
P = np.diag([1.0, 0.1, 1.0, 0.1])
WALK = ConstantVelocity(q=0.05)
BEARING = Bearing(PLACES, noise=1e-3)
POSITION = LinearMeasurement(np.eye(4)[::2], [[0.5, 0.1], [0.1, 0.3]])
M = np.array([[0.9, 0.1], [0.2, 0.8]])


def stable_system(rng: np.random.Generator, n: int, m: int) -> tuple[Float, ...]:
    F = rng.normal(size=(n, n))
    F *= 0.95 / np.abs(np.linalg.eigvals(F)).max()
    B, H = rng.normal(size=(n, 1)), rng.normal(size=(m, n))
    A, C, D = rng.normal(size=(n, n)), rng.normal(size=(m, m)), rng.normal(size=(n, n))
    return F, B, H, A @ A.T + 0.1 * np.eye(n), C @ C.T + 0.1 * np.eye(m), D @ D.T


def twins(seed: int, n: int = 3, m: int = 2, column: bool = False) -> tuple[Kalman, Any]:
    rng = np.random.default_rng(seed)
    F, B, H, Q, R, P0 = stable_system(rng, n, m)
    x = rng.normal(size=(n, 1) if column else n)
    kf = KalmanFilter(n, m, 1)
    kf.x, kf.P, kf.F, kf.B, kf.H, kf.Q, kf.R = x, P0, F, B, H, Q, R
    return Kalman(LinearMotion(F, Q, control=B), LinearMeasurement(H, R), x, P0), kf


def assert_twins(ours: Any, theirs: Any, tolerance: float = 1e-12, names: str = "x P") -> None:
    for name in names.split():
        a, b = getattr(ours, name), getattr(theirs, name)
        assert np.shape(a) == np.shape(b), name
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance, err_msg=name)


def plain(q: float = 0.05, kind: type[GaussianFilter] = Kalman) -> GaussianFilter:
    return kind(ConstantVelocity(q), POSITION, X, P)


def theirs(q: float = 0.05, column: bool = False) -> Any:
    kf = KalmanFilter(4, 2)
    kf.x, kf.P = X.reshape(4, 1) if column else X, P
    walk = ConstantVelocity(q)
    kf.F, kf.Q, kf.H, kf.R = walk.F(), walk.Q(), POSITION.H(), POSITION.R
    return kf


def track(n: int = 12, seed: int = 0) -> Float:
    return np.random.default_rng(seed).normal([8.0, 6.0], 1.0, (n, 2))
