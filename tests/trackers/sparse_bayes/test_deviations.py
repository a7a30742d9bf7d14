"""Tests of the stated deviations of directions on a grid."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios import create
from arrivals.scenarios.metrics import METRICS
from arrivals.trackers import SBL
from arrivals.trackers.marginal_variances import student_factor
from arrivals.trackers.sparse_bayes.deviations import grid_deviations
from arrivals.typing import Complex, Float

M = np.arange(15.0)[:, None]


def waves(doa: list[float]) -> tuple[Complex, Complex]:
    phase = np.pi * np.sin(doa)
    A = np.exp(1j * M * phase)
    return A, 1j * np.pi * np.cos(doa) * M * A


def fitted(doa: list[float], amplitude: list[complex], noise: float, rng: np.random.Generator,
           n_snapshots: int = 1) -> Float:  # fmt: skip
    A, D = waves(doa)
    Y = A @ np.outer(amplitude, np.ones(n_snapshots))
    real, imaginary = np.sqrt(noise / 2) * rng.standard_normal((2, *Y.shape))
    Y = Y + real + 1j * imaginary
    W = np.linalg.pinv(A) @ Y
    return grid_deviations(A, D, Y, W, 0.0, 0.9)


def test_one_wave_has_the_cramer_rao_bound() -> None:
    found = fitted([0.3], [1.0 + 1.0j], 1e-3, np.random.default_rng(0), n_snapshots=4000)
    # σ² / (2 N |w|² π² cos² Σ (m - m̄)²)
    bound = 1e-3 / (2 * 4000 * 2 * (np.pi * np.cos(0.3)) ** 2 * np.square(M - 7).sum())
    assert found[0] == pytest.approx(np.sqrt(bound), rel=0.02)


def test_a_near_second_wave_widens_both() -> None:
    rng = np.random.default_rng(0)
    far = fitted([0.0, 0.6], [1, 1j], 1e-3, rng, 200)
    near = fitted([0.0, 0.06], [1, 1j], 1e-3, rng, 200)
    assert (near > 2 * far).all()


def test_rounding_adds_the_variance_of_a_uniform_error() -> None:
    A, D = waves([0.3])
    Y = A * 2.0 + 0.1
    W = np.linalg.pinv(A) @ Y
    variance = [grid_deviations(A, D, Y, W, step, 0.9)[0] ** 2 for step in (0.0, 0.06)]
    assert variance[1] - variance[0] == pytest.approx(0.06**2 / 12)
    assert student_factor(np.array([27.0]))[0] > 1


def test_as_many_waves_as_sensors_leave_nothing_for_the_noise() -> None:
    A, D = waves(np.linspace(-1.2, 1.2, 15).tolist())
    Y = A.sum(axis=1, keepdims=True)
    W = np.linalg.pinv(A) @ Y
    np.testing.assert_array_equal(grid_deviations(A, D, Y, W, 0.0, 0.9), 0.9)


@pytest.mark.parametrize("missing", [None, 4])
def test_the_tracker_states_deviations(missing: int | None) -> None:
    model = ArraySnapshot(SensorArray.ula(15, spacing=0.5), wavelength=1.0)
    z = model.simulate([-0.4, 0.5], [1.0, 1.0j], np.random.default_rng(0))
    if missing is not None:
        z[missing] = np.nan
    tracker = SBL(model, max_sources=2)
    tracker.update(z)
    std = tracker.estimate.std
    assert ((std > np.deg2rad(0.5) / np.sqrt(12)) & (std < 0.9)).all()
    np.testing.assert_allclose(np.diag(tracker.P), std**2)


def test_walks_are_covered() -> None:
    found = []
    for seed in range(2):
        trial = create("walk").sample(np.random.default_rng(seed))
        run = trial.tracker("ssbl").run(trial.measurements)
        found.append([METRICS[name](trial, run) for name in ("coverage68", "coverage95", "nees")])
    inner, outer, nees = np.mean(found, axis=0)
    assert 0.5 < inner < 0.8
    assert outer > 0.87
    assert 0.6 < nees < 1.6
