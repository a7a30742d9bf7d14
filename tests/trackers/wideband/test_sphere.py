"""Densities on the sphere, and talkers in azimuth and elevation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.sphere import (
    fibonacci_sphere,
    great_circle,
    unit_vectors,
)
from arrivals.trackers import MixtureSettings, SphereEstimate, WidebandMixture
from arrivals.trackers.wideband.sphere_density import SphereDensityGrid
from arrivals.typing import Complex, Float

STEP = np.deg2rad(4.0)
HALF = SphereDensityGrid(STEP, (0.0, 0.0, 1.0))
WHOLE = SphereDensityGrid(np.deg2rad(6.0), None)
FREQUENCIES = range(500, 4000, 50)
SPACE = ArraySnapshot(
    SensorArray(0.05 * fibonacci_sphere(8)),
    [343.0 / each for each in FREQUENCIES],
    noise=0.01,
    n_snapshots=8,
    unknowns="sphere",
)
FLAT = SPACE.replace(array=SensorArray.uca(6, radius=0.046))


def normal_density(grid: SphereDensityGrid, azimuth: float, elevation: float, std: float) -> Float:
    distance = great_circle(grid.scan.points, unit_vectors(azimuth, elevation))
    density = np.exp(-((distance / std) ** 2) / 2)
    return np.asarray(density / density.sum())


def talkers(model: ArraySnapshot, azimuth: Float, elevation: Float, seed: int = 0) -> Complex:
    """Draw bins that few sources share, n_steps of them."""
    rng = np.random.default_rng(seed)
    size = (len(azimuth), model.n_bins, model.n_snapshots, azimuth.shape[1])
    speech = rng.laplace(size=size) * rng.gamma(0.3, size=size)
    return model.simulate(azimuth, 3 * speech, rng, elevation)


@pytest.mark.parametrize("grid", [HALF, WHOLE])
@pytest.mark.parametrize("variance", [1e-4, 1e-2, 0.1])
def test_walk_adds_its_variance_along_both_axes(grid: SphereDensityGrid, variance: float) -> None:
    start = np.flatnonzero(grid.scan.points[:, 2] > 0.7)[::7]
    moved = grid.moved(np.eye(len(grid.doa))[start], variance)
    np.testing.assert_allclose(moved.sum(axis=1), 1, rtol=1e-9)
    # a Brownian motion on the sphere: E cos = exp(-σ²)
    cosine = (moved * np.cos(grid.distance[start])).sum(axis=1)
    assert -np.log(cosine).mean() == pytest.approx(variance, rel=0.08)


@settings(max_examples=15)
@given(st.floats(1e-5, 0.3), st.floats(1e-5, 0.3))
def test_two_walks_equal_one_of_the_sum(a: float, b: float) -> None:
    start = np.eye(len(WHOLE.doa))[[5, 300]]
    twice = WHOLE.moved(WHOLE.moved(start, a), b)
    np.testing.assert_allclose(twice, WHOLE.moved(start, a + b), atol=1e-9)


def test_walk_keeps_the_uniform_density_and_approaches_it() -> None:
    n = len(HALF.doa)
    uniform = np.full((1, n), 1 / n)
    np.testing.assert_allclose(HALF.moved(uniform, 0.2), uniform, rtol=1e-9)
    np.testing.assert_allclose(HALF.moved(np.eye(n)[:1], 19.0), uniform, rtol=1e-3)
    np.testing.assert_allclose(HALF.moved(np.eye(n)[:1], 1e6), uniform, rtol=1e-12)
    assert HALF.moved(uniform, 0.0) is uniform
    assert HALF.moved(np.zeros((0, n)), 0.1).shape == (0, n)


@pytest.mark.parametrize("std_deg", [1.0, 2.5, 5.0])
@pytest.mark.parametrize("azimuth", [-3.1, 0.4])
@pytest.mark.parametrize("elevation", [0.3, 0.8, 1.5])
def test_mean_and_covariance_of_a_normal_density_are_found(
    azimuth: float, elevation: float, std_deg: float
) -> None:
    std = np.deg2rad(std_deg)
    density = normal_density(HALF, azimuth, elevation, std)
    directions, covariance = HALF.located(density[None], np.deg2rad(18.0))
    error = great_circle(unit_vectors(*directions[:, 0]), unit_vectors(azimuth, elevation))
    assert error < np.deg2rad(0.3)
    np.testing.assert_allclose(covariance[0], std**2 * np.eye(2), atol=0.25 * std**2)


def test_density_at_the_edge_of_a_half_stays_above_the_plane() -> None:
    density = normal_density(HALF, 0.7, 0.01, np.deg2rad(1.0))
    (azimuth, elevation), _ = HALF.located(density[None], np.deg2rad(18.0))
    assert 0 <= elevation[0] < np.deg2rad(2.0)
    assert azimuth[0] == pytest.approx(0.7, abs=np.deg2rad(1.0))


@pytest.mark.parametrize(("model", "limit_deg"), [(SPACE, 1.5), (FLAT, 3.0)])
def test_two_talkers_are_tracked_in_azimuth_and_elevation(
    model: ArraySnapshot, limit_deg: float
) -> None:
    n = 10
    azimuth = np.stack([0.5 + 0.02 * np.arange(n), np.full(n, -1.5)], axis=1)
    elevation = np.full((n, 2), [0.6, 0.9])
    z = talkers(model, azimuth, elevation)
    z[4, ..., 2] = np.nan
    tracker = WidebandMixture(model)
    run = tracker.run(z)
    assert isinstance(tracker.estimate, SphereEstimate)
    assert run.n_found.tolist()[1:] == [2] * (n - 1)
    for label in (0, 1):
        step, slot = np.nonzero(run.label == label)
        found = unit_vectors(run.doa[step, slot], run.elevation[step, slot])
        error = great_circle(found[:, None], unit_vectors(azimuth, elevation)[step])
        assert np.rad2deg(np.median(error, axis=0).min()) < limit_deg
    assert np.linalg.eigvalsh(tracker.estimate.covariance).min() > np.deg2rad(0.5) ** 2


def test_turned_array_turns_the_directions_of_talkers() -> None:
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = SPACE.replace(array=SensorArray(SPACE.array.positions @ quarter.T))
    azimuth, elevation = np.full((3, 1), 0.4), np.full((3, 1), 0.5)
    z = talkers(SPACE, azimuth, elevation)
    one, other = (WidebandMixture(model).run(z) for model in (SPACE, turned))
    change = great_circle(
        unit_vectors(one.doa[-1, :1] + np.pi / 2, one.elevation[-1, :1]),
        unit_vectors(other.doa[-1, :1], other.elevation[-1, :1]),
    )
    assert np.rad2deg(change) < 1.0  # the grid does not turn


def test_settings_of_the_sphere_change_its_grid_alone() -> None:
    coarse = MixtureSettings(sphere_step=np.deg2rad(8.0))
    tracker = WidebandMixture(FLAT, settings=coarse)
    assert len(tracker.grid.doa) == 322
    assert len(WidebandMixture(FLAT.replace(unknowns="azimuth"), settings=coarse).grid.doa) == 120
    white = WidebandMixture(FLAT, settings=coarse.replace(diffuse=False))
    z = talkers(FLAT, np.full((3, 1), 0.4), np.full((3, 1), 0.9))
    assert white.run(z).elevation[-1, 0] == pytest.approx(0.9, abs=0.1)


def test_too_few_sensors_for_elevation_count_as_a_gap() -> None:
    z = talkers(FLAT, np.full((3, 1), 0.4), np.full((3, 1), 0.9))
    z[1:, ..., 2:] = np.nan
    tracker = WidebandMixture(FLAT)
    gap = WidebandMixture(FLAT).run([z[0], None, None])
    np.testing.assert_array_equal(tracker.run(z).doa, gap.doa)


def test_sources_with_a_range_are_refused() -> None:
    line = ArraySnapshot(SensorArray.ula(5, 0.1), [0.2, 0.3], unknowns="range")
    with pytest.raises(
        ValueError, match="WidebandMixture requires unknowns='azimuth' or 'sphere'; got 'range'"
    ):
        WidebandMixture(line)
