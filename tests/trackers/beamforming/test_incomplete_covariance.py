"""Covariances of incomplete snapshots: semidefinite, likely, without additional sources."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import create
from arrivals.trackers.beamforming.incomplete import MAX_PATTERNS, PatternSums
from arrivals.typing import Complex

LINE = ArraySnapshot(SensorArray.ula(9, spacing=0.5), wavelength=1.0, noise=1e-2)
ALL = np.ones(9, dtype=bool)


def two_sources(seed: int, n: int = 30) -> Complex:
    rng = np.random.default_rng(seed)
    phases = np.exp(2j * np.pi * rng.random((n, 2)))
    return LINE.simulate(np.full((n, 2), [0.5, -0.4]), phases, rng)


def sums_of(z: Complex, forgetting: float = 1.0) -> PatternSums:
    sums = PatternSums.empty(z.shape[1])
    for y in z:
        sums = sums.forget(forgetting).add(y)
    return sums


def with_gaps(z: Complex, kind: str, seed: int = 1) -> Complex:
    z, third = z.copy(), len(z) // 3
    gaps = {"fails": slice(third, 2 * third), "late": slice(third), "ends": slice(-third, None)}
    if kind in gaps:
        z[gaps[kind], 3] = np.nan
    elif kind == "dead":
        z[:, 4] = np.nan
    else:
        z[np.random.default_rng(seed).random(z.shape) < float(kind)] = np.nan
    return z


@given(st.integers(0, 1000), st.sampled_from(["0.1", "0.4", "fails"]), st.floats(0.8, 1.0))
@settings(max_examples=15, deadline=None)
def test_covariance_is_positive_semidefinite(seed: int, kind: str, forgetting: float) -> None:
    sums = sums_of(with_gaps(two_sources(seed), kind, seed), forgetting)
    R = sums.mean_covariance(sums.sensor_weights > 0)
    np.testing.assert_array_equal(R, R.conj().T)
    values = np.linalg.eigvalsh(R)
    assert values[0] > -1e-12 * values[-1]


def test_complete_snapshots_have_their_mean() -> None:
    z = two_sources(0)
    R = sums_of(z).mean_covariance(ALL)
    np.testing.assert_allclose(R, z.T @ z.conj() / len(z), atol=1e-12)


def log_likelihood(z: Complex, R: Complex) -> float:
    """Return the log-likelihood of the numbers that are there."""
    total = 0.0
    for y in z:
        o = ~np.isnan(y)
        S = R[np.ix_(o, o)]
        total -= np.linalg.slogdet(S)[1] + np.vdot(y[o], np.linalg.solve(S, y[o])).real
    return total


def test_covariance_is_likelier_than_that_of_complete_snapshots_or_pairs() -> None:
    z = with_gaps(two_sources(3, 60), "0.2")
    R = sums_of(z).mean_covariance(ALL)
    valid = ~np.isnan(z)
    y = np.where(valid, z, 0)
    pairs = (y.T @ y.conj()) / (valid.T.astype(float) @ valid)
    values, vectors = np.linalg.eigh(pairs)
    clipped = (vectors * np.maximum(values, 1e-2)) @ vectors.conj().T
    assert log_likelihood(z, R) > log_likelihood(z, clipped) + 50


@pytest.mark.parametrize("name", ["mvdr", "music", "root_music", "esprit", "past"])
@pytest.mark.parametrize("kind", ["fails", "late", "ends", "dead", "0.3"])
def test_missing_sensors_add_no_sources(name: str, kind: str) -> None:
    found = []
    for seed in range(3):
        tracker = create(name, measurement=LINE)
        tracker.run(with_gaps(two_sources(seed), kind, seed))
        found.append(tracker.estimate.n_found)
    assert 2 <= np.mean(found) <= 2.5


def test_number_of_sets_of_sensors_is_limited() -> None:
    z = with_gaps(two_sources(0, 300), "0.5")
    sums = sums_of(z[~np.isnan(z).all(axis=1)])
    assert len(sums.weights) == MAX_PATTERNS
    R = sums.mean_covariance(ALL)
    assert np.linalg.eigvalsh(R)[-3:].round(1).tolist()[0] < 0.5


def test_sensor_with_few_data_is_left_out() -> None:
    z = two_sources(2)
    z[:-2, 5] = np.nan
    found = create("music", measurement=LINE).run(z).n_found
    assert found[-1] == 2
