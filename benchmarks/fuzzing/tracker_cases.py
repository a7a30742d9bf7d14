"""Small valid trackers of every registered name, and measurements for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from arrivals.measurement_models import (
    ArraySamples,
    ArraySnapshot,
    Bearing,
    LinearMeasurement,
    LogNormalRSS,
    SensorArray,
    Station,
    Tones,
    db_to_neper,
)
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
from arrivals.motion_models import (
    AutoregressiveSources,
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    RandomWalk,
    VonMisesFisherWalk,
    VonMisesWalk,
)
from arrivals.trackers import (
    EKF,
    IMM,
    UKF,
    GridSearch,
    Kalman,
    MixtureSettings,
    Particle,
    Tracker,
    VariationalSolver,
    create,
)
from arrivals.typing import Float

Case = tuple[Callable[[], Tracker], list[Any]]

X, P = np.array([5.0, 0.1, 4.0, -0.1]), np.diag([1.0, 0.1, 1.0, 0.1])
POSITION = LinearMeasurement(np.eye(4)[::2], [[0.2, 0.05], [0.05, 0.1]])
POINT = LinearMeasurement(np.eye(2), 0.01 * np.eye(2))
STATIONS = [[0.0, 0.0], [10.0, 0.0], [3.0, 9.0]]
BEARING = Bearing(STATIONS, noise=1e-3)
BEARING_XY = Bearing(STATIONS, noise=1e-3, position=(0, 1))
SOUNDING = Bearing([[0.0, 0.0, 0.0], [9.0, 1.0, 2.0]], noise=1e-3)
NORMAL = LinearMeasurement(np.eye(3), 1e-3 * np.eye(3))
ANGLE = LinearMeasurement([[1.0]], [[0.01]])
STEERED = LinearMotion(0.9 * np.eye(2), 0.1 * np.eye(2), control=[[0.0], [1.0]], names=["x", "y"])
LINE = ArraySnapshot(SensorArray.ula(6, spacing=0.5), wavelength=1.0, noise=0.01)
CIRCLE = ArraySnapshot(
    SensorArray.uca(5, radius=0.5), wavelength=[1.0, 1.3], noise=0.01, n_snapshots=2
)
SPHERE = CIRCLE.replace(wavelength=1.0, n_snapshots=1, unknowns="sphere")
SPACE = CIRCLE.replace(array=SensorArray(0.4 * fibonacci_sphere(6)), unknowns="sphere")
RANGE = LINE.replace(unknowns="range")
SINGLE = CIRCLE.replace(wavelength=1.0, n_snapshots=1)
NEAR = LINE.replace(unknowns="range", nearest=1.0)
NEWTON = ("svalse", "valse")
ON_SPHERE = ("cbf", "mvdr", "music", "peaks_gnn", *NEWTON)
BANDS = CIRCLE.replace(wavelength=list(np.linspace(1.0, 3.0, 12)), n_snapshots=4)
BLOCK = LINE.replace(wavelength=[1.0, 1.3], n_snapshots=2)
PAIRS = ArraySnapshot(SensorArray.symmetric([0.25, 0.5]), wavelength=1.0, noise=0.1)
SOUND = ArraySamples(SensorArray.ula(4, spacing=0.5, speed=1.0), 4.0, Tones(0.2), snr_db=20.0)
RNG = np.random.default_rng(3)
PLACES = RNG.uniform(-20.0, 20.0, (8, 2))
RECEIVED = LogNormalRSS(PLACES, log_noise=float(db_to_neper(40.0)), position=(0, 1))


def positions() -> list[Any]:
    return list(RNG.normal([5.0, 4.0], 0.4, (4, 2)))


def bearings() -> list[Any]:
    return [BEARING_XY.sample([5.0, 4.0], RNG) for _ in range(4)]


def soundings() -> list[Any]:
    return [SOUNDING.sample([5.0, 4.0, 7.0], RNG) for _ in range(4)]


def snapshots(model: ArraySnapshot, n_steps: int = 6) -> list[Any]:
    elevation = np.full((n_steps, 2), [0.3, 1.0]) if model.unknowns == "sphere" else None
    distance = np.full((n_steps, 2), [2.0, np.inf]) if model.unknowns == "range" else None
    doa = np.full((n_steps, 2), [0.5, -0.4])
    return list(model.simulate(doa, [1.0, 0.7j], RNG, elevation, distance))


def at_stations() -> list[Any]:
    """Return snapshots of two sources on the map at all stations, (n_stations, n_sensors)."""
    steps = []
    for _ in range(5):
        d = np.array([[5.0, 4.0], [2.0, 7.0]]) - np.array(STATIONS)[:, None]
        doa = np.arctan2(d[..., 1], d[..., 0])
        steps.append(np.array([SINGLE.simulate(each, [1.0, 0.7j], RNG) for each in doa]))
    return steps


def samples() -> list[Any]:
    phase = 0.8 * np.pi * np.arange(8)[:, None] * 0.5 + 0.3 * np.arange(4)
    return list(np.cos(phase) + 0.05 * RNG.standard_normal((8, 4)))


def readings() -> list[Any]:
    return [RECEIVED.draw(db_to_neper([81.0]), np.array([[3.0, 4.0]]), RNG) for _ in range(3)]


def imm() -> IMM:
    walk = Kalman(RandomWalk(0.01), POINT, X[::2], np.eye(2))
    turning = EKF(
        RandomWalk(0.1), BEARING_XY.replace(sensor_positions=STATIONS[:2]), X[::2], np.eye(2)
    )
    return IMM([walk, turning], [0.6, 0.4], [[0.9, 0.1], [0.2, 0.8]])


def direction(name: str, **params: Any) -> list[Case]:
    """Return a tracker of directions on a line, on bins of a circle, on the sphere, with ranges.

    The latter three where it works there.
    """
    models = [LINE, BLOCK if name in ("root_music", "esprit", "ssbl") else CIRCLE]
    if name in ON_SPHERE:
        models += [SPHERE, SPACE]
    if name in NEWTON:
        models += [RANGE, NEAR]
    return [
        (lambda model=model: create(name, measurement=model, **params), snapshots(model))  # type: ignore[misc]
        for model in models
    ]


WALK = RandomWalk(1.0)
START: dict[str, Any] = {"x0": np.array([[4.0, 5.0]]), "P0": 20.0 * np.eye(2)}
FAST = GridSearch(max_sources=2, grid_step=10.0)

CASES: dict[str, list[Case]] = {
    "kalman": [
        (lambda: Kalman(ConstantVelocity(0.01), POSITION, X, P), positions()),
        (lambda: Kalman(STEERED, POINT, X[::2, None], np.eye(2)), positions()),
    ],
    "ekf": [
        (lambda: EKF(RandomWalk(0.1, 3), SOUNDING, [5.0, 4.0, 6.0], np.eye(3)), soundings()),
        (lambda: EKF(CoordinatedTurn(0.01, 0.01), BEARING, [*X, 0.1], np.eye(5)), bearings()),
        (lambda: EKF(VonMisesWalk(50.0), ANGLE, [3.1], [[0.1]]), [np.array([3.1])] * 4),
    ],
    "ukf": [
        (lambda: UKF(VonMisesFisherWalk(50.0), NORMAL, [0.0, 0.6, 0.8], 0.1 * np.eye(3)),
         [np.array([0.0, 0.6, 0.8])] * 4),
        (lambda: UKF(RandomWalk(0.01), BEARING_XY, X[::2], np.eye(2)), bearings()),
    ],
    "imm": [(imm, positions())],
    "particle": [
        (
            lambda: Particle(RandomWalk(0.1), BEARING_XY, X[::2], np.eye(2), n_particles=50, rng=1),
            bearings(),
        ),
        (
            lambda: Particle(VonMisesWalk(50.0), LINE, [0.2], [[0.1]], n_particles=50, rng=2),
            snapshots(LINE),
        ),
    ],
    **{
        name: direction(name, n_directions=61)
        for name in ("cbf", "mvdr", "music", "sbl", "ssbl")
    },
    "past": direction("past", n_directions=61, method="music"),
    **{name: direction(name) for name in ("root_music", "esprit", "peaks_gnn", "valse", "svalse")},
    "wideband_mixture": [
        (lambda: create("wideband_mixture", measurement=BANDS), snapshots(BANDS)),
        (
            lambda: create(
                "wideband_mixture",
                measurement=BANDS.replace(unknowns="sphere"),
                settings=MixtureSettings(sphere_step=0.2),
            ),
            snapshots(BANDS.replace(unknowns="sphere")),
        ),
    ],
    "ar_kalman_qrd_rls": [
        (
            lambda: create(
                "ar_kalman_qrd_rls",
                measurement=PAIRS,
                motion=AutoregressiveSources([[0.7, -0.4], [0.9]]).scaled(1.0),
                doa=[-0.4, 0.5],
                interval=3,
            ),
            snapshots(PAIRS),
        ),
    ],
    "interpolation_ekf": [
        (
            lambda v=v: create(  # type: ignore[misc]
                "interpolation_ekf", measurement=SOUND, variant=v, doa=0.3, acquisition=3
            ),
            samples(),
        )
        for v in ("B", "C", "D", "phasor")
    ],
    "fused": [
        (
            lambda: create(
                "fused",
                motion=ConstantVelocity(0.01),
                stations=[Station(SINGLE, place) for place in STATIONS],
            ),
            at_stations(),
        ),
    ],
    "rss_vb": [
        (lambda: create("rss_vb", motion=WALK, measurement=RECEIVED, **START), readings()),
        (
            lambda: create(
                "rss_vb",
                motion=RandomWalk(1.0),
                measurement=RECEIVED,
                search=FAST,
                solver=VariationalSolver(max_iterations=5),
            ),
            readings(),
        ),
    ],
    "rss_ml": [
        (lambda: create("rss_ml", motion=WALK, measurement=RECEIVED, **START), readings()),
    ],
}  # fmt: skip


def is_symmetric_and_positive(P: Float) -> bool:
    """Return whether a covariance is symmetric and has no negative eigenvalue, up to rounding."""
    size = np.abs(P).max(initial=0.0)
    if size == 0.0:
        return True
    scaled = P / size
    return bool(np.abs(scaled - scaled.T).max() < 1e-7 and np.linalg.eigvalsh(scaled)[0] > -1e-7)
