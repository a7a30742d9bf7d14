"""Every shipped motion with every shipped measurement in ekf, ukf, particle and imm.

Pairs whose names fit run on data simulated from the pair itself; all others are TypeErrors.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import (
    ArrayManifold,
    ArraySnapshot,
    Bearing,
    CombinedMeasurement,
    DelayInterpolator,
    DelayLine,
    FunctionMeasurement,
    InterpolationDelay,
    LinearMeasurement,
    LogNormalRSS,
    MeasurementModel,
    Phasor,
    SensorArray,
    Tones,
)
from arrivals.motion_models import (
    AutoregressiveSources,
    BernoulliVonMises,
    CombinedMotion,
    ConstantVelocity,
    CoordinatedTurn,
    DelayDrift,
    DelayWalk,
    DirectionAmplitudeWalk,
    FunctionMotion,
    LinearMotion,
    MotionModel,
    RandomWalk,
    VonMisesFisherWalk,
    VonMisesWalk,
)
from arrivals.trackers import EKF, IMM, UKF, Particle, Tracker
from arrivals.typing import Float

PLACES = [[0.0, 0.0], [10.0, 0.0], [4.0, 9.0]]
TONE = Tones(0.1)
LINE = DelayLine(4, 0.05, TONE, kappa=2.0)
PHASOR = Phasor(4, 0.05, frequency=0.1)
BEARING, RSS = Bearing(PLACES, noise=0.01), LogNormalRSS(PLACES, sigma=0.3, log_noise=0.0)
SPATIAL = Bearing(np.c_[PLACES, [0.0, 2.0, 1.0]], noise=0.01)
SNAPSHOT = ArraySnapshot(SensorArray.ula(5, spacing=0.5), wavelength=1.0, noise=0.1)
SAMPLES = np.random.default_rng(0).standard_normal((3, 2))


def swing(x: Float, dt: float) -> list[float]:
    return [x[0] + dt * x[1], x[1] - 0.1 * dt * np.sin(x[0])]


def waveform(model: DelayLine | Phasor) -> LinearMotion:
    return LinearMotion(model.transition, model.innovation, names=model.source_names)


MOTIONS: dict[str, MotionModel] = {
    "RandomWalk": RandomWalk(0.01),
    "ConstantVelocity": ConstantVelocity(0.01),
    "ConstantVelocity in space": ConstantVelocity(0.01, n_dims=3),
    "CoordinatedTurn": CoordinatedTurn(0.01, 0.001),
    "LinearMotion": LinearMotion(0.9 * np.eye(2), 0.1 * np.eye(2), names=["x", "y"]),
    "CombinedMotion": CombinedMotion(
        DirectionAmplitudeWalk(VonMisesWalk(50.0), 0.01), ConstantVelocity(0.01), DelayWalk(1e-3)
    ),
    "CombinedMotion of a tone": CombinedMotion(DelayDrift(1e-4), waveform(PHASOR)),
    "CombinedMotion of samples": CombinedMotion(DelayWalk(1e-3), waveform(LINE)),
    "DirectionAmplitudeWalk": DirectionAmplitudeWalk(VonMisesWalk(50.0), 0.01),
    "FunctionMotion": FunctionMotion(
        swing, Q=0.01 * np.eye(2), names=["angle", "rate"], angles=[0]
    ),
    "VonMisesWalk": VonMisesWalk(50.0),
    "VonMisesFisherWalk": VonMisesFisherWalk(50.0),
    "BernoulliVonMises": BernoulliVonMises(),
    "AutoregressiveSources": AutoregressiveSources([[0.9], [0.5]], 0.1),
    "DelayWalk": DelayWalk(1e-3),
    "DelayDrift": DelayDrift(1e-4),
}

MEASUREMENTS: dict[str, Callable[[int], MeasurementModel]] = {
    "LinearMeasurement": lambda n: LinearMeasurement(np.eye(n)[:1], [[0.1]]),
    "Bearing": lambda n: BEARING,
    "Bearing in space": lambda n: SPATIAL,
    "LogNormalRSS": lambda n: RSS,
    "CombinedMeasurement": lambda n: CombinedMeasurement(BEARING, RSS),
    "CombinedMeasurement of snapshots": lambda n: CombinedMeasurement(SNAPSHOT, SNAPSHOT),
    "FunctionMeasurement": lambda n: FunctionMeasurement(np.sum, R=0.1, needs=["rate"]),
    "ArraySnapshot": lambda n: SNAPSHOT,
    "ArrayManifold": lambda n: ArrayManifold(SensorArray.symmetric([0.25, 0.5]), 1.0, 0.1),
    "InterpolationDelay": lambda n: InterpolationDelay(
        DelayInterpolator(TONE), 4, 0.05, regressors=SAMPLES
    ),
    "DelayLine": lambda n: LINE,
    "Phasor": lambda n: PHASOR,
}


def imm(motion: MotionModel, measurement: MeasurementModel, x: Float, P: Float) -> IMM:
    members = [kind(motion, measurement, x, P) for kind in (EKF, UKF)]
    return IMM(members, [0.5, 0.5], [[0.9, 0.1], [0.1, 0.9]])


TRACKERS: dict[str, Callable[..., Tracker]] = {
    "ekf": EKF,
    "ukf": UKF,
    "particle": partial(Particle, n_particles=100, rng=1),
    "imm": imm,
}


def fits(motion: MotionModel, measurement: MeasurementModel, tracker: str) -> bool:
    """Return whether the state has the entries that the measurement needs.

    A particle filter weighs directions alone: it integrates amplitudes out.
    """
    needs = set(measurement.needs)
    if tracker == "particle" and needs == set(SNAPSHOT.needs) and not isinstance(
        measurement, ArrayManifold
    ):  # fmt: skip
        needs = {"doa"}
    return needs <= set(motion.state_names)


def simulate(motion: MotionModel, measurement: MeasurementModel, n: int) -> tuple[Float, Any]:
    """Return the first state and n measurements; snapshots of directions alone are complex."""
    rng = np.random.default_rng(5)
    x0 = rng.uniform(0.2, 1.0, motion.dim_x)
    located = measurement.for_likelihood(motion.state_names)
    x, z = x0, []
    for _ in range(n):
        x = motion.sample(x, rng)
        alone = "doa" in measurement.needs and "amplitude_re" not in motion.state_names
        z.append(measurement.sample([x[0], 1.0, 0.5], rng) if alone else located.sample(x, rng))
    return x0, np.array(z)


@pytest.mark.parametrize("tracker", TRACKERS)
@pytest.mark.parametrize("measurement", MEASUREMENTS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_pair_runs_if_its_names_fit_and_is_refused_otherwise(
    motion: str, measurement: str, tracker: str
) -> None:
    moves = MOTIONS[motion]
    model = MEASUREMENTS[measurement](moves.dim_x)
    make, P = TRACKERS[tracker], 0.05 * np.eye(moves.dim_x)
    if not fits(moves, model, tracker):
        with pytest.raises(
            TypeError, match=r"measurement must read entries of the state: .* needs"
        ):
            make(moves, model, np.full(moves.dim_x, 0.5), P)
        return
    x0, z = simulate(moves, model, 4)
    z[2, 0] = np.nan
    run = make(moves, model, x0, P).run(z)
    assert np.isfinite(run.x).all()
    assert np.linalg.eigvalsh(run.P).min() > -1e-9


def test_every_shipped_model_is_in_the_matrix() -> None:
    from arrivals import measurement_models, motion_models

    for package, base, names in (
        (motion_models, MotionModel, MOTIONS),
        (measurement_models, MeasurementModel, MEASUREMENTS),
    ):
        kinds = [getattr(package, name) for name in package.__all__]
        shipped = {
            kind.__name__ for kind in kinds if isinstance(kind, type) and issubclass(kind, base)
        }
        abstract = {"MotionModel", "MeasurementModel", "LinearMotionModel"}
        assert shipped - abstract == {name.split()[0] for name in names}
