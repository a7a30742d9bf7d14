"""Blocks of snapshots of two sources on a line, for methods that estimate directions."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios import ar_signals
from arrivals.trackers import DirectionTracker
from arrivals.typing import Complex

SPEED, FREQUENCY, N_SENSORS, N_SNAPSHOTS = 343.0, 1000.0, 15, 50
BIN_WIDTH = 31.25  # Hz: 512 samples at 16 kHz
DOA = np.deg2rad([-20.0, 30.0])


def block_model() -> ArraySnapshot:
    """Return 15 sensors at half a wavelength, of 50 snapshots a step."""
    wavelength = SPEED / FREQUENCY
    array = SensorArray.ula(N_SENSORS, wavelength / 2)
    return ArraySnapshot(array, wavelength, noise=0.1, n_snapshots=N_SNAPSHOTS)


def two_sources() -> Complex:
    """Return one block of two AR(2) sources at -20 and 30 degrees, (n_snapshots, n_sensors)."""
    rng, model = np.random.default_rng(0), block_model().replace(n_snapshots=1)
    s = ar_signals(([0.772, -0.45], [0.96, -0.77]), (0.571, 0.287), N_SNAPSHOTS, rng)
    return model.simulate(np.tile(DOA, (N_SNAPSHOTS, 1)), s, rng)


def circle_model() -> ArraySnapshot:
    """Return 6 sensors on a circle, of 20 bins and 50 snapshots a step."""
    frequencies = BIN_WIDTH * np.arange(20, 60, 2)
    wavelength = (SPEED / frequencies).tolist()
    return ArraySnapshot(SensorArray.uca(6, 0.05), wavelength, noise=0.1, n_snapshots=N_SNAPSHOTS)


def two_wideband_sources() -> Complex:
    """Return one block of two Gaussian sources on `circle_model`, (n_bins, n_snapshots, 6)."""
    rng, model = np.random.default_rng(0), circle_model()
    w = rng.standard_normal((1, *model.shape[:-1], 2, 2)) @ np.array([1, 1j])
    return np.asarray(model.simulate(np.array([[0.5, -1.5]]), w, rng)[0])


def step(tracker: DirectionTracker, block: Complex) -> object:
    """Predict and update by one block; return the directions."""
    tracker.predict()
    tracker.update(block)
    return tracker.estimate.doa
