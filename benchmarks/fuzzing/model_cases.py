"""Valid calls of models, settings, metrics and other functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from arrivals import measurement_models as mm
from arrivals import motion_models as motions
from arrivals.measurements import is_missing, numbers, real_numbers, rows
from arrivals.motion_models.autoregressive.estimation import partial_autocorrelation
from arrivals.scenarios.bounds.delay import tone_bound
from arrivals.scenarios.bounds.detection import exact_detection, network_detection
from arrivals.scenarios.bounds.signal_strength import rss_bound
from arrivals.scenarios.bounds.snapshot import snapshot_bound
from arrivals.scenarios.experiments.statistics import bootstrap_interval
from arrivals.scenarios.metrics.assignment import matches
from arrivals.scenarios.metrics.consistency import (
    circular_nees,
    coverage,
    position_coverage,
    position_nees,
)
from arrivals.scenarios.metrics.gospa import gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.metrics.position_errors import assign, huber, scores
from arrivals.scenarios.metrics.separation import nmse, sdr
from arrivals.scenarios.metrics.unlabelled_rmse import best_assignment_rmse
from arrivals.scenarios.simulations.ar_signals import ar_signals
from arrivals.trackers import (
    AmplitudePrior,
    BirthDeath,
    CoordinateSolver,
    FixedPointSolver,
    GridSearch,
    MAPSolver,
    NewtonSolver,
    VariationalSolver,
    find_peaks,
    refine_peaks,
)
from arrivals.typing import Float
from fuzzing.two_unknown_cases import TWO_UNKNOWNS

Arguments = dict[str, Any]
LINE = mm.SensorArray.ula(4, spacing=0.5)
SNAPSHOT = mm.ArraySnapshot(LINE, wavelength=1.0, noise=0.1)
PLACES = [[0.0, 0.0], [10.0, 0.0], [4.0, 9.0]]
RSS = mm.LogNormalRSS(PLACES, sigma=0.3, log_noise=0.0)
TONE = mm.Tones(0.1)
SAMPLES = mm.ArraySamples(mm.SensorArray.ula(4, 0.5, speed=1.0), 4.0, TONE)
SIGNAL = np.sin(np.arange(20.0) ** 1.5)
CONTROL = np.array([[0.0], [1.0]])


def swing(x: Any, dt: float) -> list[Any]:
    return [x[0] + dt * x[1], x[1] - 0.1 * dt * np.sin(x[0])]


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


CLASSES: dict[str, tuple[Any, list[Arguments]]] = {
    "RandomWalk": (motions.RandomWalk, [{"q": 0.5, "n_dims": 2}]),
    "ConstantVelocity": (motions.ConstantVelocity, [{"q": 0.1, "n_dims": 2}]),
    "CoordinatedTurn": (motions.CoordinatedTurn, [{"q": 0.1, "q_turn": 0.02}]),
    "VonMisesWalk": (motions.VonMisesWalk, [{"kappa": 50.0}, {"sigma_doa": 0.1}]),
    "VonMisesFisherWalk": (motions.VonMisesFisherWalk, [{"kappa": 50.0}, {"sigma_doa": 0.1}]),
    "BernoulliVonMises": (
        motions.BernoulliVonMises,
        [{"kappa": 50.0, "p_activate": 0.1, "p_deactivate": 0.2}, {"sigma_doa": 0.1}],
    ),
    "DirectionAmplitudeWalk": (
        motions.DirectionAmplitudeWalk,
        [{"direction": motions.VonMisesWalk(50.0), "amplitude_noise": 0.1}],
    ),
    "DelayWalk": (motions.DelayWalk, [{"q": 1e-4}]),
    "DelayDrift": (motions.DelayDrift, [{"q": 1e-4}]),
    "AutoregressiveSources": (
        motions.AutoregressiveSources,
        [{"coefficients": [[0.7, -0.4], [0.9]], "noise": [1.0, 2.0], "real_valued": True}],
    ),
    "LinearMotion": (
        motions.LinearMotion,
        [
            {
                "transition": 0.9 * np.eye(2),
                "noise": np.eye(2),
                "control": CONTROL,
                "names": ["x", "y"],
            }
        ],
    ),
    "FunctionMotion": (
        motions.FunctionMotion,
        [
            {
                "f": swing,
                "F": None,
                "Q": 0.1 * np.eye(2),
                "names": ["angle", "rate"],
                "angles": [0],
                "vectorized": False,
            },
            {"f": swing, "Q": lambda dt: dt * np.eye(2)},
        ],
    ),
    "CombinedMotion": (
        motions.CombinedMotion,
        [{"first": motions.RandomWalk(0.1, 1), "second": motions.DelayWalk(0.1), "names": None}],
    ),
    "LinearMeasurement": (
        mm.LinearMeasurement,
        [{"matrix": np.eye(3)[:2], "noise": 0.1 * np.eye(2)}],
    ),
    "Bearing": (
        mm.Bearing,
        [{"sensor_positions": np.array(PLACES), "noise": 0.01, "position": (0, 1)},
         {"sensor_positions": np.array(PLACES), "noise": 0.01 * np.eye(3)},
         {"sensor_positions": [[0.0, 0.0, 0.0], [9.0, 1.0, 2.0]], "position": (0, 1, 2),
          "noise": 0.01}],
    ),
    "FunctionMeasurement": (
        mm.FunctionMeasurement,
        [
            {
                "h": lambda x: np.hypot(x[0], x[1]),
                "H": None,
                "R": 0.1,
                "residual": None,
                "needs": ["x", "y"],
                "vectorized": False,
            }
        ],
    ),
    "CombinedMeasurement": (
        mm.CombinedMeasurement,
        [{"first": mm.Bearing(PLACES, 0.01, position=(0, 1)), "second": RSS}],
    ),
    "SensorArray": (
        mm.SensorArray,
        [{"positions": np.array(PLACES), "speed": 343.0, "channels": [0, 1, 2], "n_channels": 4}],
    ),
    "ElementResponse": (mm.ElementResponse, [{"gains": np.ones((4, 3), complex)}]),
    "ArraySnapshot": (
        mm.ArraySnapshot,
        [{"array": LINE, "wavelength": 1.0, "noise": 0.1, "power": 1.0, "n_snapshots": 1},
         {"array": LINE, "wavelength": [1.0, 1.5], "slowness": [0.9, 1.0], "angle": "auto"},
         {"array": LINE, "wavelength": 1.0, "noise_coherence": "diffuse", "white": 0.2},
         {"array": LINE, "wavelength": 1.0, "noise_coherence": np.eye(LINE.n_sensors)}],
    ),
    "ArrayManifold": (
        mm.ArrayManifold,
        [{"array": mm.SensorArray.symmetric([0.25, 0.5]), "wavelength": 1.0, "noise": 0.1}],
    ),
    "LogNormalRSS": (
        mm.LogNormalRSS,
        [{"sensors": np.array(PLACES), "sigma": 0.3, "alpha": 2.0, "log_noise": 0.0, "r_min": 1.0,
          "position": (0, 1), "log_amplitude": 9.0}],
    ),
    "AveragedEnvelope": (mm.AveragedEnvelope, [{"n_snapshots": 50, "exact_moments": False}]),
    "LogGains": (mm.LogGains, [{"offsets": np.zeros(3), "paths": 0.0}]),
    "ArraySamples": (
        mm.ArraySamples,
        [{"array": SAMPLES.array, "rate": 4.0, "correlation": TONE, "snr_db": 10.0, "power": 1.0}],
    ),
    "FlatBand": (mm.FlatBand, [{"low": 0.1, "high": 0.2}]),
    "Tones": (mm.Tones, [{"frequencies": [0.1, 0.2], "powers": [1.0, 2.0]}]),
    "Autoregressive": (mm.Autoregressive, [{"coefficients": [0.7, -0.4]}]),
    "DelayInterpolator": (
        mm.DelayInterpolator,
        [{"correlation": TONE, "offsets": (0, 1), "loading": 0.1}],
    ),
    "InterpolationDelay": (
        mm.InterpolationDelay,
        [{"interpolator": mm.DelayInterpolator(TONE), "n_sensors": 4, "noise_ratio": 0.1,
          "baseline": 1, "inflation": 1.0}],
    ),
    "DelayLine": (
        mm.DelayLine,
        [{"n_sensors": 4, "noise_ratio": 0.1, "correlation": TONE, "kappa": 2.0}],
    ),
    "Phasor": (
        mm.Phasor,
        [{"n_sensors": 4, "noise_ratio": 0.1, "frequency": 0.1, "process_noise": 0.01}],
    ),
    **{
        kind.__name__: (kind, [kind().get_params(deep=False)])
        for kind in (
            AmplitudePrior, BirthDeath, CoordinateSolver, FixedPointSolver, GridSearch, MAPSolver,
            NewtonSolver, VariationalSolver,
        )
    },
}  # fmt: skip

ANGLES = np.array([0.1, -2.0])
SKY = np.array([[0.1, 1.2], [-2.0, 0.3]])  # azimuths and elevations
X4 = np.array([1.0, 0.1, 2.0, 0.2])
FUNCTIONS: dict[str, tuple[Callable[..., Any], Arguments]] = TWO_UNKNOWNS | {
    "ula": (mm.SensorArray.ula, {"n_sensors": 4, "spacing": 0.5}),
    "uca": (mm.SensorArray.uca, {"n_sensors": 4, "radius": 0.5}),
    "symmetric": (mm.SensorArray.symmetric, {"distances": [0.25, 0.5]}),
    "array.steering_vector": (LINE.steering_vector, {"doa": ANGLES, "wavelength": 1.0}),
    "array.without": (LINE.without, {"sensors": [1]}),
    "snapshot.steering_vector": (SNAPSHOT.steering_vector, {"doa": ANGLES}),
    "snapshot.simulate": (SNAPSHOT.simulate, {"doa": ANGLES, "amplitude": [1.0, 1j], "rng": rng()}),
    "wrap": (motions.wrap, {"angle": ANGLES}),
    "yule_walker": (motions.yule_walker, {"signal": SIGNAL, "order": 2}),
    "select_order": (motions.select_order, {"signal": SIGNAL, "highest": 3}),
    "partial_autocorrelation": (
        partial_autocorrelation,
        {"signal": SIGNAL, "n_lags": 3},
    ),
    "predict_existence": (
        motions.BernoulliVonMises().predict_existence,
        {"existence": np.array([0.2, 0.9]), "dt": 2.0},
    ),
    "sample_active": (
        motions.BernoulliVonMises().sample_active,
        {"active": np.array([True, False]), "rng": rng(), "dt": 1.0},
    ),
    "blur": (
        motions.VonMisesWalk(50.0).blur,
        {"kappa": np.array([1.0, 100.0]), "dt": 1.0, "slope": 1.0},
    ),
    "scaled": (motions.AutoregressiveSources([[0.5]]).scaled, {"power": np.array([2.0])}),
    "signals": (motions.AutoregressiveSources([[0.5]]).signals, {"x": X4}),
    "stack": (lambda a, b: mm.CombinedMeasurement(mm.Bearing(PLACES, 0.1), RSS).stack(a, b),
              {"a": np.zeros(3), "b": None}),
    "log_likelihood": (
        mm.CombinedMeasurement(mm.Bearing(PLACES, 0.1, position=(0, 1)),
                               mm.LinearMeasurement(np.eye(4), np.eye(4))).log_likelihood,
        {"z": np.zeros(7), "x": X4},
    ),
    "numbers": (partial(numbers, "z"), {"value": X4}),
    "real_numbers": (partial(real_numbers, "z"), {"value": X4}),
    "rows": (partial(rows, "z"), {"measurements": X4}),
    "is_missing": (is_missing, {"z": X4}),
    "composite": (mm.composite, {"z": X4 * 1j}),
    "db_to_neper": (mm.db_to_neper, {"level_db": X4}),
    "find_peaks": (find_peaks, {"power": np.array([1.0, 3.0, 2.0]), "circular": False}),
    "refine_peaks": (
        refine_peaks,
        {"doa_grid": np.arange(3.0), "power": np.array([1.0, 3.0, 2.0]), "peaks": np.array([1])},
    ),
    "gospa": (
        gospa,
        {"truth": ANGLES, "estimate": ANGLES + 1, "c": 10.0, "p": 1.0, "alpha": 2.0, "period": 6.3},
    ),
    "gospa_on_sphere": (
        gospa,
        {"truth": SKY, "estimate": SKY, "c": 0.3, "period": 6.3, "distance": "great_circle"},
    ),
    "matches_on_sphere": (
        matches,
        {"truth": SKY[None], "estimate": SKY[None], "c": 0.3, "period": 6.3,
         "distance": "great_circle"},
    ),
    "ospa": (ospa, {"truth": ANGLES, "estimate": ANGLES, "c": 10.0, "p": 2.0, "period": 6.3}),
    "rmse": (rmse, {"truth": ANGLES, "estimate": ANGLES, "c": 10.0, "period": 6.3}),
    "mean_gospa": (
        mean_gospa,
        {"truth": ANGLES[None], "estimate": ANGLES[None], "c": 10.0, "p": 1.0},
    ),
    "mean_rmse": (mean_rmse, {"truth": ANGLES[None], "estimate": ANGLES[None], "c": 10.0}),
    "circular_nees": (circular_nees, {"error": ANGLES, "std": ANGLES**2}),
    "coverage": (coverage, {"error": ANGLES, "std": ANGLES**2, "level": 0.9}),
    "position_nees": (
        position_nees,
        {"error": ANGLES[None], "covariance": np.eye(2)[None]},
    ),
    "position_coverage": (
        position_coverage,
        {"error": ANGLES[None], "covariance": np.eye(2)[None], "level": 0.9},
    ),
    "matches": (
        matches,
        {"truth": ANGLES[None], "estimate": ANGLES[None], "c": 1.0, "period": 6.3},
    ),
    "huber": (huber, {"errors": X4, "k": 1.3}),
    "assign": (
        assign,
        {"theta": np.array(PLACES), "truth": np.array(PLACES) + 1, "how": "one-to-one"},
    ),
    "scores": (
        scores,
        {"theta": np.array([PLACES]), "truth": np.array([PLACES]) + 1, "u": np.ones((1, 3)),
         "true_u": np.zeros((1, 3)), "how": "nearest"},
    ),
    "nmse": (nmse, {"truth": X4[:, None], "estimate": X4[:, None] + 1, "db": True}),
    "sdr": (sdr, {"truth": X4[:, None], "estimate": X4[:, None] + 1}),
    "best_assignment_rmse": (
        best_assignment_rmse,
        {"truth": ANGLES[None], "estimate": ANGLES[None], "period": 6.3},
    ),
    "bootstrap_interval": (bootstrap_interval, {"values": X4, "level": 0.9}),
    "exact_detection": (
        exact_detection,
        {"false_alarm": 0.1, "n_snapshots": 10, "snr": ANGLES**2},
    ),
    "network_detection": (
        network_detection,
        {"false_alarm": 0.1, "weights": ANGLES**2, "snr": ANGLES**2},
    ),
    "snapshot_bound": (
        snapshot_bound,
        {"measurement": SNAPSHOT, "doa": ANGLES[:1], "amplitude": np.ones(1), "noise": 0.1},
    ),
    "rss_bound": (
        rss_bound,
        {"measurement": RSS, "u": np.ones(1), "theta": np.array([[1.0, 2.0]])},
    ),
    "tone_bound": (tone_bound, {"measurement": SAMPLES, "doa": 0.1, "n_steps": 10}),
    "ar_signals": (
        ar_signals,
        {"coefficients": [[0.5], [0.7, -0.4]], "noise": np.ones(2), "n": 5, "rng": rng(),
         "batch": (2,), "complex_valued": True},
    ),
}  # fmt: skip


def state_of(model: Any) -> Float:
    """Return a valid state of a model."""
    return np.linspace(0.3, 0.7, getattr(model, "dim_x", 0) or 4)
