"""Conformance cases of the AR Kalman filter with QRD-RLS."""

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.motion_models import AutoregressiveSources
from arrivals.trackers import ARKalmanQRDRLS
from arrivals.trackers.autoregressive import NoiseSettings, RegressionSettings
from arrivals.trackers.conformance import MakeTracker, Measurements

# Without a sensor it is not symmetric: the pair of a missing sensor is left out, while a uniform
# line of one sensor less has other pairs.
SNAPSHOT = ArraySnapshot(SensorArray.symmetric([0.25, 0.6]), wavelength=1.0, noise=0.1)
RAGGED = AutoregressiveSources([[0.7, -0.4], [0.9]]).scaled(1.0)
SPEECH = AutoregressiveSources([[0.9], [0.5]], real_valued=True).scaled(1.0)
DOA = [-0.3, 0.5]


def with_gaps(motion: AutoregressiveSources, n_steps: int, seed: int = 0) -> Measurements:
    """Draw two sources; a sample and whole snapshots are missing, once the last of an interval."""
    rng, x, s = np.random.default_rng(seed), np.zeros(motion.dim_x), []
    for _ in range(n_steps):
        x = motion.sample(x, rng)
        s.append(motion.signals(x))
    z = SNAPSHOT.simulate(np.full((n_steps, 2), [-0.35, 0.52]), s, rng)
    z[4, 1], z[6:8], z[-1] = np.nan, np.nan, np.nan
    return z


TRACKERS: list[tuple[str, MakeTracker, Measurements]] = [
    (
        "ar_kalman_qrd_rls",
        lambda: ARKalmanQRDRLS(
            SNAPSHOT, RAGGED, doa=DOA, interval=3, noise=NoiseSettings(r_start=0.3)
        ),
        with_gaps(RAGGED, 14),
    ),
    (
        "ar_kalman_qrd_rls",
        lambda: ARKalmanQRDRLS(
            SNAPSHOT,
            RAGGED,
            doa=DOA,
            interval=4,
            inner=2,
            regression=RegressionSettings(correction=False),
        ),
        with_gaps(RAGGED, 13),
    ),
    (
        "ar_kalman_qrd_rls",
        lambda: ARKalmanQRDRLS(
            SNAPSHOT,
            SPEECH,
            doa=DOA,
            interval=5,
            gate=0.3,
            regression=RegressionSettings(ridge=5.0),
            noise=NoiseSettings(adapt_process_noise=False),
        ),
        with_gaps(SPEECH, 21),
    ),
    ("ar_kalman_qrd_rls", lambda: ARKalmanQRDRLS(SNAPSHOT, interval=20), with_gaps(RAGGED, 70)),
]
