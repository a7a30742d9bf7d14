"""Snapshots reduced to their covariance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.recordings import Recording
from arrivals.recordings.choice import Choice
from arrivals.recordings.step_snapshots import reduced_snapshots
from arrivals.recordings.tracking import RecordedSteps, track
from arrivals.trackers import SVALSE
from arrivals.typing import Complex

ARRAY = SensorArray.uca(5, radius=0.35, speed=3e8)

RECORDED = {"solver__power_floor": 3.0, "solver__max_snr_db": 20.0}


def scene(n: int = 4800, seed: int = 0) -> Complex:
    """Return snapshots of two random sources at 30 and -160 degrees, in noise."""
    rng = np.random.default_rng(seed)
    shape = (n, 7)
    white = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    A = ARRAY.steering_vector(np.deg2rad([30.0, -160.0]), 0.69)
    return np.asarray(white[:, :2] * [1.0, 0.5] @ A + 0.3 * white[:, 2:])


@given(st.integers(0, 99), st.integers(1, 60), st.integers(1, 6), st.integers(0, 5))
def test_covariance_is_that_of_the_complete_snapshots(
    seed: int, n: int, m: int, n_missing: int
) -> None:
    rng = np.random.default_rng(seed)
    y = rng.standard_normal((3, n, m)) + 1j * rng.standard_normal((3, n, m))
    for _ in range(n_missing):
        y[1, rng.integers(n), rng.integers(m)] = np.nan
    w = reduced_snapshots(y)
    assert w.shape == (3, min(n, 8 * m), m)
    for before, after in zip(y, w, strict=True):
        present = ~np.isnan(before).all(axis=0)
        rows = before[:, present]
        rows = rows[~np.isnan(rows).any(axis=1)]
        if n > 8 * m and len(rows):
            R = after[:, present].conj().T @ after[:, present] / (8 * m)
            assert_allclose(R, rows.conj().T @ rows / len(rows), atol=1e-12)
            assert np.isnan(after[:, ~present]).all()
        elif n > 8 * m:
            assert np.isnan(after).all()
        else:
            assert_array_equal(after, before)


def test_svalse_is_the_same_in_reduced_snapshots() -> None:
    y, estimates = scene(), []
    for z, tempering in ((y, 120.0), (reduced_snapshots(y), 1.0)):
        tracker = SVALSE(ArraySnapshot(ARRAY, 0.69, n_snapshots=len(z)))
        tracker = tracker.set_params(solver__tempering=tempering, **RECORDED)
        tracker.update(z)
        estimates.append(tracker.estimate)
    full, reduced = estimates
    assert_allclose(np.rad2deg(np.sort(full.doa)), [-160, 30], atol=1)
    assert_allclose(reduced.doa, full.doa, atol=1e-3)
    assert_allclose(reduced.std, full.std, rtol=0.2)


def test_recorded_steps_are_reduced_block_by_block(monkeypatch: pytest.MonkeyPatch) -> None:
    y = scene(1050)
    choice = Choice("IQ", "svalse", (4e8,), n_snapshots=100, reduce=True)
    monkeypatch.setattr("arrivals.recordings.tracking.BLOCK", 2000)
    steps = RecordedSteps(Recording(y, 1000.0), choice)
    expected = reduced_snapshots(y[:1000].reshape(10, 100, 5))
    assert_allclose(np.array(list(steps)), expected)
    assert_allclose(steps.framed().values, expected)
    assert_allclose(steps.time, np.arange(10) * 0.1 + 0.0495)


@pytest.mark.parametrize("snr_db", [-8.0, 20.0])
def test_weak_sources_are_found_and_deviations_of_receivers_are_not(snr_db: float) -> None:
    rng = np.random.default_rng(1)
    white = rng.standard_normal((28_800, 7)) + 1j * rng.standard_normal((28_800, 7))
    deviations = 10 ** (rng.normal(0, 1, 5) / 20) * np.exp(1j * rng.normal(0, 0.087, 5))
    A = ARRAY.steering_vector(np.deg2rad([30.0, -100.0]), 0.69) * deviations
    y = 10 ** (snr_db / 20) * white[:, :2] @ A + white[:, 2:]
    recording = Recording(y, 240e3, frequency=3e8 / 0.69)
    run = track(recording, ARRAY)
    assert_allclose(np.rad2deg(np.sort(run.doa[2:])), [[-100, 30]] * (len(run) - 2), atol=12)


@pytest.mark.parametrize(("doa_deg", "snr_db"), [([30.0], -10.0), ([30.0, 75.0], -7.0)])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_weak_sources_are_found_within_300_ms(
    doa_deg: list[float], snr_db: float, seed: int
) -> None:
    rng, n = np.random.default_rng(seed), len(doa_deg)
    white = rng.standard_normal((96_000, n + 5)) + 1j * rng.standard_normal((96_000, n + 5))
    deviations = 10 ** (rng.normal(0, 1, 5) / 20) * np.exp(1j * rng.normal(0, 0.087, 5))
    A = ARRAY.steering_vector(np.deg2rad(doa_deg), 0.69) * deviations
    y = 10 ** (snr_db / 20) * white[:, :n] @ A + white[:, n:]
    run = track(Recording(y, 240e3, frequency=3e8 / 0.69), ARRAY)
    late = run.time > 0.3
    assert (run.n_found[late] == n).all()
    assert_allclose(np.rad2deg(np.sort(run.doa[late])[:, :n]), [doa_deg] * late.sum(), atol=3)
