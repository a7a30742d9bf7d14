"""Gaussian filters, particle filter and IMM, for `test_conformance`."""

import numpy as np

from arrivals.measurement_models import ArraySnapshot, Bearing, LinearMeasurement, SensorArray
from arrivals.motion_models import (
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    RandomWalk,
    VonMisesFisherWalk,
    VonMisesWalk,
)
from arrivals.trackers import EKF, IMM, UKF, Kalman, Particle
from arrivals.trackers.conformance import MakeTracker, Measurements

X, P = np.array([5.0, 0.1, 4.0, -0.1]), np.diag([1.0, 0.1, 1.0, 0.1])
MOTION = ConstantVelocity(q=0.01)
POSITION = LinearMeasurement(np.eye(4)[::2], [[0.2, 0.05], [0.05, 0.1]])
DECAY = LinearMotion([[0.9]], [[0.19]], control=[[1.0]])
BEARING = Bearing([[0.0, 0.0], [10.0, 0.0], [3.0, 9.0]], noise=1e-3)
BEARINGS_XY = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=1e-3, position=(0, 1))
SPACE = Bearing([[0.0, 0.0, 0.0], [10.0, 0.0, 2.0]], noise=1e-3)
DIRECTION = LinearMeasurement(np.eye(3), 1e-3 * np.eye(3))
NORTH, SOUTH = [0.0, 0.6, 0.8], [0.0, -0.1, 0.99]
ANGLE = LinearMeasurement([[1.0]], [[0.01]])
LINE = ArraySnapshot(SensorArray.ula(6, spacing=0.5), wavelength=1.0, noise=0.05)


def positions() -> Measurements:
    z = np.random.default_rng(3).normal([5.0, 4.0], 0.4, (5, 2))
    z[2, 1] = np.nan
    return z


def bearings(model: Bearing, position: tuple[float, float] = (5.0, 4.0)) -> Measurements:
    x = np.zeros(5)
    x[list(model.position or (0, 2))] = position
    return np.array([model.sample(x, np.random.default_rng(seed)) for seed in range(5)])


def snapshots() -> Measurements:
    doa = np.linspace(0.2, 0.4, 5)[:, None]
    return LINE.simulate(doa, [1.0], np.random.default_rng(4))


def spatial_bearings() -> Measurements:
    z = np.array([SPACE.sample([5.0, 4.0, 7.0], np.random.default_rng(seed)) for seed in range(5)])
    z[2, 1] = np.nan
    return z


def imm() -> IMM:
    turning = EKF(RandomWalk(0.1), BEARINGS_XY, X[::2], np.eye(2))
    return IMM([Kalman(RandomWalk(0.01), POINT, X[::2], np.eye(2)), turning], [0.6, 0.4], MARKOV)


POINT = LinearMeasurement(np.eye(2), 1e-2 * np.eye(2))
MARKOV = np.array([[0.9, 0.1], [0.2, 0.8]])

TRACKERS: list[tuple[str, MakeTracker, Measurements]] = [
    ("kalman", lambda: Kalman(MOTION, POSITION, X, P), positions()),
    ("kalman", lambda: Kalman(DECAY, ANGLE, [1.0], [[1.0]]), np.array([[0.5], [0.4], [0.6]])),
    ("ekf", lambda: EKF(MOTION, BEARING, X, P), bearings(BEARING)),
    (
        "ekf",
        lambda: EKF(CoordinatedTurn(0.01, 0.01), BEARING, [*X, 0.1], np.eye(5)),
        bearings(BEARING),
    ),
    ("ekf", lambda: EKF(VonMisesWalk(50.0), ANGLE, [3.1], [[0.1]]), np.array([[3.1], [-3.1]])),
    ("ukf", lambda: UKF(RandomWalk(0.01), BEARINGS_XY, X[::2], np.eye(2)), bearings(BEARINGS_XY)),
    ("ukf", lambda: UKF(VonMisesWalk(50.0), ANGLE, [3.1], [[0.1]]), np.array([[3.1], [-3.1]])),
    ("ekf", lambda: EKF(RandomWalk(0.1, 3), SPACE, [5.0, 4.0, 6.0], np.eye(3)), spatial_bearings()),
    (
        "ukf",
        lambda: UKF(VonMisesFisherWalk(50.0), DIRECTION, NORTH, 0.1 * np.eye(3)),
        np.array([NORTH, SOUTH]),
    ),
    (
        "particle",
        lambda: Particle(RandomWalk(0.1), BEARINGS_XY, X[::2], np.eye(2), n_particles=200, rng=1),
        bearings(BEARINGS_XY),
    ),
    (
        "particle",
        lambda: Particle(VonMisesWalk(50.0), LINE, [0.2], [[0.1]], n_particles=100, rng=2),
        snapshots(),
    ),
    ("imm", imm, positions()),
]
