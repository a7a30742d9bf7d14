"""Scenes of autoregressive sources for the tests of the AR Kalman filter."""

from dataclasses import fields
from typing import Any

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import AutoregressiveSources
from arrivals.trackers import ARKalmanQRDRLS, Run
from arrivals.trackers.autoregressive import NoiseSettings, RegressionSettings
from arrivals.typing import Complex, Float

TWO = AutoregressiveSources([[0.772, -0.45], [0.96, -0.77]]).scaled(1.0)
THREE = AutoregressiveSources([[0.772, -0.45], [0.96, -0.77], [-1.2, -0.72]]).scaled(1.0)
DOA = np.deg2rad([-20.0, 30.0])
INWARDS = np.deg2rad([10.0, -10.0])


def symmetric_array(*distances: float, snr_db: float = 10.0) -> ArraySnapshot:
    return ArraySnapshot(SensorArray.symmetric(distances), 1.0, noise=10 ** (-snr_db / 10))


def sources(motion: AutoregressiveSources, runs: int, n: int, seed: int = 0) -> Complex:
    """Draw stationary sources, (runs, n, n_sources)."""
    from scipy.signal import lfilter

    v = np.random.default_rng(seed).standard_normal((2, runs, n + 200, motion.n_sources))
    std = np.sqrt(np.array(motion.noise) / motion.n_parts)
    w = std * (v[0] if motion.real_valued else v[0] + 1j * v[1])
    models = enumerate(motion.coefficients)
    s = [lfilter([1.0], [1.0, *(-a for a in row)], w[..., k], axis=1) for k, row in models]
    return np.stack(s, axis=-1)[:, 200:].astype(complex)


def snapshots(measurement: ArraySnapshot, doa: Float, s: Complex, seed: int = 1) -> Complex:
    return measurement.simulate(np.broadcast_to(doa, s.shape), s, np.random.default_rng(seed))


def rmse_deg(runs: list[Run], doa: Float, first: int) -> float:
    """Return the median over runs of the RMSE from step `first` on, degrees."""
    error = np.array([run.doa[first:] for run in runs]) - doa[..., first:, :]
    return float(np.median(np.rad2deg(np.sqrt((error**2).mean(axis=(1, 2))))))


def constant(doa: Float, n: int) -> Float:
    return np.tile(doa, (n, 1))


def make_tracker(
    measurement: ArraySnapshot, motion: AutoregressiveSources = TWO, **params: Any
) -> ARKalmanQRDRLS:
    """Make a tracker; parameters of the settings models are given by their own names."""
    for name, kind in (("regression", RegressionSettings), ("noise", NoiseSettings)):
        own = {field.name for field in fields(kind)} & params.keys()
        params[name] = kind(**{key: params.pop(key) for key in own})
    return ARKalmanQRDRLS(measurement, motion, **params)
