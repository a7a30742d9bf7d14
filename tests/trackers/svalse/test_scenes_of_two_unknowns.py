"""SVALSE and VALSE in azimuth and elevation, and in direction and range: accuracy and laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays.sphere import azimuth_elevation, great_circle, unit_vectors
from arrivals.scenarios.bounds import range_bound, sphere_bound
from arrivals.scenarios.metrics.registry import gospa_of
from arrivals.scenarios.simulations import NearField, SourcesOnSphere
from arrivals.trackers import create
from arrivals.typing import Float

SPACE = SensorArray(np.random.default_rng(1).normal(size=(9, 3)) * 0.4)


@pytest.mark.parametrize(("distance", "least"), [(0.3, 24), (0.5, 24), (5.0, 24)])
def test_valse_near_a_line_reaches_the_bound_in_direction_and_range(
    distance: float, least: int
) -> None:
    """Specification, section 7 and acceptance 8; 25 draws, within 1.5 of the bound."""
    scene = NearField([20.0], [distance], n_steps=25)
    trial: Any = scene.sample(np.random.default_rng(3))
    run: Any = trial.tracker("valse").run(trial.measurements)
    alone = (~np.isnan(run.doa)).sum(axis=1) == 1
    assert alone.sum() >= least
    error = np.stack([run.doa[alone, 0] - np.deg2rad(20), 1 / run.range[alone, 0] - 1 / distance])
    C = range_bound(trial.measurement, np.deg2rad([20.0]), [distance], scene.amplitudes(), 0.01)
    assert (np.sqrt((error**2).mean(axis=1)) < 1.5 * np.sqrt(np.diagonal(C[0]))).all()
    stated = np.median(run.range_std[alone, 0]) / distance**2
    assert stated == pytest.approx(np.sqrt(C[0, 1, 1]), rel=0.25)


def test_valse_finds_a_near_source_at_the_end_of_a_line() -> None:
    """Of noise that moves the best sine beyond 1."""
    model = ArraySnapshot(SensorArray.ula(16, 0.5), 1.0, noise=0.03, unknowns="range", nearest=5.0)
    doa, distance = np.full((20, 1), np.pi / 2), np.full((20, 1), 8.0)
    z = model.simulate(doa, np.ones((20, 1)), np.random.default_rng(0), distance=distance)
    run: Any = create("valse", measurement=model).run(z)
    np.testing.assert_allclose(run.doa[:, 0], np.pi / 2, atol=0.2)


def test_valse_finds_two_sources_in_one_direction() -> None:
    """Acceptance 9: 0.5 and 2 m, ten snapshots."""
    trial: Any = NearField([10, 10], [0.5, 2.0], n_snapshots=10, n_steps=12).sample(
        np.random.default_rng(1)
    )
    run: Any = trial.tracker("valse").run(trial.measurements)
    ranges = np.sort(run.range, axis=1)  # NaN last
    found = (~np.isnan(run.doa)).sum(axis=1) == 2
    assert found.sum() >= 10
    np.testing.assert_allclose(np.median(ranges[found, :2], axis=0), [0.5, 2.0], rtol=0.02)


def test_svalse_tracks_sources_that_cross_in_azimuth() -> None:
    """Acceptance 3: a GOSPA of at most 3.6 degrees, below that of VALSE."""
    trial = SourcesOnSphere("ura4").sample(np.random.default_rng(5))
    svalse, valse = (
        gospa_of(trial, trial.tracker(name).run(trial.measurements)).total
        for name in ("svalse", "valse")
    )
    assert svalse < 3.6
    assert svalse < valse


def test_deviations_on_the_sphere_are_those_of_the_bound() -> None:
    model = ArraySnapshot(SPACE, 1.0, n_snapshots=10, noise=0.01, unknowns="sphere")
    doa, elevation, w = np.array([0.4]), np.array([-0.7]), np.ones((40, 10, 1), dtype=complex)
    z = model.simulate(
        np.tile(doa, (40, 1)), w, np.random.default_rng(0), np.tile(elevation, (40, 1))
    )
    run: Any = create("valse", measurement=model).run(z)
    C = sphere_bound(model, doa, elevation, w[0], 0.01)[0]
    np.testing.assert_allclose(np.median(run.covariance[:, 0], axis=0), C, rtol=0.25, atol=2e-6)
    alone = (~np.isnan(run.doa)).sum(axis=1) == 1
    assert alone.sum() >= 30
    found = unit_vectors(run.doa[alone, 0], run.elevation[alone, 0])
    error = great_circle(found, unit_vectors(doa, elevation))
    assert np.sqrt((error**2).mean()) == pytest.approx(np.sqrt(np.trace(C)), rel=0.35)


def test_source_seen_as_its_image_beyond_the_horizon_is_reported() -> None:
    """Sensors half a wavelength apart: u = -1.21 has the response of u = 0.79."""
    axis = 0.5 * np.arange(4)
    square = SensorArray(np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2))
    model = ArraySnapshot(square, 1.0, n_snapshots=10, unknowns="sphere")
    doa, elevation = np.tile([0.3, 2.5], (4, 1)), np.tile([0.6, 1.1], (4, 1))
    for seed in (5, 6):
        rng = np.random.default_rng(seed)
        w = np.exp(2j * np.pi * rng.random((4, 10, 2)))
        run: Any = create("valse", measurement=model).run(model.simulate(doa, w, rng, elevation))
        found = unit_vectors(run.doa, run.elevation)[..., None, :]
        apart = great_circle(found, unit_vectors(doa, elevation)[:, None])
        assert (np.nanmin(apart, axis=1) < 0.2).all()


def turned(array: SensorArray, turn: Float) -> ArraySnapshot:
    return ArraySnapshot(
        SensorArray(array.positions @ turn.T), 1.0, n_snapshots=4, unknowns="sphere"
    )


def test_rotated_array_rotates_estimates() -> None:
    """Up to where the steps of the solver end: candidates are not rotated."""
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    azimuth, elevation = np.array([0.4, -1.9]), np.array([-0.7, 0.5])
    straight, other = turned(SPACE, np.eye(3)), turned(SPACE, turn)
    rng = np.random.default_rng(2)
    z = straight.replace(noise=0.01).simulate(azimuth, np.ones((4, 2)), rng, elevation)
    directions = []
    for model in (straight, other):
        tracker: Any = create("svalse", measurement=model)
        tracker.update(z)
        directions.append(unit_vectors(tracker.estimate.doa, tracker.estimate.elevation))
    assert len(directions[0]) == len(directions[1]) == 2
    apart = great_circle((directions[0] @ turn.T)[:, None], directions[1][None])
    assert apart.min(axis=1).max() < 1e-3
    found = azimuth_elevation(directions[0])
    assert np.sort(found[0]) == pytest.approx(np.sort(azimuth), abs=0.05)


@pytest.mark.parametrize("method", ["svalse", "valse"])
def test_plane_waves_have_no_range(method: str) -> None:
    line = SensorArray.ula(16, 0.5)
    model = ArraySnapshot(line, 1.0, noise=0.01, unknowns="range")
    doa = np.tile([0.3, -0.8], (10, 1))
    z = model.simulate(doa, np.ones((10, 2)), np.random.default_rng(0))
    run: Any = create(method, measurement=model).run(z)
    found = ~np.isnan(run.doa)
    assert found.sum() == 20
    assert np.isinf(run.range[found]).mean() > 0.85
    near = model.simulate(doa, np.ones((10, 2)), np.random.default_rng(0), distance=0 * doa + 40.0)
    curved: Any = create(method, measurement=model).run(near)
    ranges = curved.range[-1][~np.isnan(curved.doa[-1])]
    np.testing.assert_allclose(ranges, 40.0, rtol=0.25)


@pytest.mark.parametrize("unknowns", ["sphere", "range"])
def test_missing_sensors_and_steps_leave_the_points_where_they_were(unknowns: Any) -> None:
    array = SPACE if unknowns == "sphere" else SensorArray.ula(12, 0.5)
    model = ArraySnapshot(array, 1.0, n_snapshots=4, noise=1e-3, unknowns=unknowns)
    given = {"elevation": np.full((8, 1), 0.5)} if unknowns == "sphere" else {}
    z = model.simulate(np.full((8, 1), 0.4), np.ones((8, 4, 1)), np.random.default_rng(0), **given)
    z[3, :, [0, 4]] = np.nan
    z[5] = np.nan
    run: Any = create("svalse", measurement=model).run(z)
    valid = np.arange(8) != 5
    assert (~np.isnan(run.doa)).sum(axis=1)[valid].tolist() == [1] * 7
    np.testing.assert_allclose(run.doa[valid, 0], 0.4, atol=0.03)
    assert len(np.unique(run.label[valid, 0])) == 1


@pytest.mark.parametrize("method", ["svalse", "valse"])
def test_change_of_the_unknowns_starts_anew(method: str) -> None:
    line = SensorArray.ula(9, 0.5)
    models = [
        ArraySnapshot(line, 1.0, noise=0.01),
        ArraySnapshot(SPACE, [1.0, 1.2], n_snapshots=2, noise=0.01, unknowns="sphere"),
        ArraySnapshot(line, 1.0, noise=0.01, unknowns="range"),
        ArraySnapshot(line, 1.0, noise=0.01, unknowns="range", nearest=2.5),
        ArraySnapshot(line, 1.0, n_snapshots=3, noise=0.01),
    ]
    tracker: Any = create(method, measurement=models[0])
    for model in models:
        tracker.set_params(measurement=model)
        w = np.ones((3, *model.shape[:-1], 1))
        z = model.simulate(np.full((3, 1), 0.4), w, np.random.default_rng(0))
        fresh: Any = create(method, measurement=model)
        np.testing.assert_array_equal(tracker.run(z).doa, fresh.run(z).doa)
        kept = tracker.x.copy()
        tracker.set_params(measurement=model.replace(noise=0.02))
        np.testing.assert_array_equal(tracker.x, kept)
        assert type(tracker.estimate) is fresh.estimate_kind


@pytest.mark.parametrize("array", [SensorArray.uca(7, 0.5), SPACE])
def test_sensor_that_fails_is_as_an_array_without_it(array: SensorArray) -> None:
    model = ArraySnapshot(array, 1.0, 1e-2, n_snapshots=3, unknowns="sphere")
    truth = np.full((4, 2), [0.5, -0.4]), np.full((4, 2), [0.3, 1.0])
    rng = np.random.default_rng(2)
    z = model.simulate(truth[0], np.exp(6.28j * rng.random((4, 3, 2))), rng, truth[1])
    smaller = model.replace(array=array.without([2]))
    less: Any = create("svalse", measurement=smaller).run(np.delete(z, 2, axis=-1))
    z[..., 2] = np.nan
    run: Any = create("svalse", measurement=model).run(z)
    assert run.n_found.tolist() == less.n_found.tolist()
    for step in range(4):
        one, other = np.argsort(run.doa[step])[:2], np.argsort(less.doa[step])[:2]
        variance = run.covariance[step, one].diagonal(axis1=1, axis2=2)  # elevation, azimuth
        for name, std in (("elevation", variance[:, 0] ** 0.5), ("doa", run.std[step, one])):
            difference = getattr(run, name)[step, one] - getattr(less, name)[step, other]
            assert (np.abs(difference) < 0.1 * std).all()


@pytest.mark.parametrize(
    "name", ["svalse", "valse", "cbf", "mvdr", "music", "peaks_gnn", "wideband_mixture"]
)
def test_set_unknowns_restart_the_tracker(name: str) -> None:
    sphere = ArraySnapshot(
        SensorArray.uca(7, 0.5), list(np.linspace(1, 3, 10)), 1e-2, unknowns="sphere"
    )
    azimuth, rng = sphere.replace(unknowns="azimuth"), np.random.default_rng(0)
    data = {
        "sphere": sphere.simulate(np.full((6, 1), 0.4), 1.0, rng, np.full((6, 1), 0.7)),
        "azimuth": azimuth.simulate(np.full((6, 1), 0.4), 1.0, rng),
    }
    tracker: Any = create(name, measurement=azimuth)
    for unknowns in ("azimuth", "sphere", "azimuth"):
        tracker.set_params(measurement__unknowns=unknowns)
        run = tracker.run(data[unknowns])
        again: Any = create(name, measurement=sphere.replace(unknowns=unknowns))
        np.testing.assert_array_equal(run.doa, again.run(data[unknowns]).doa)
        assert ("elevation" in run.fields) == (unknowns == "sphere")


@pytest.mark.parametrize("name", ["svalse", "valse"])
def test_array_or_bins_that_are_set_are_used_by_the_next_step(name: str) -> None:
    circle = ArraySnapshot(SensorArray.uca(7, 0.5), 1.0, 1e-2)
    bins = circle.replace(wavelength=[1.0, 1.3])
    sphere = circle.replace(unknowns="sphere")
    pairs = [
        (circle, bins),
        (sphere, sphere.replace(array=SPACE)),
        (sphere, sphere.replace(noise=1e-3)),
    ]
    for model, other in pairs:
        kwargs = {} if model is circle else {"elevation": np.full((3, 1), 0.7)}
        tracker: Any = create(name, measurement=model)
        tracker.run(model.simulate(np.full((3, 1), 0.4), 1.0, np.random.default_rng(0), **kwargs))
        tracker.set_params(measurement=other)
        z = other.simulate(np.full((3, 1), 0.4), 1.0, np.random.default_rng(1), **kwargs)
        run = tracker.run(z)
        np.testing.assert_allclose(run.doa[:, 0], 0.4, atol=0.05)
