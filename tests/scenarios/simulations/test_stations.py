"""Scenes of several stations: paths, powers, errors of stations, missing data, signal strength."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import db_to_neper
from arrivals.motion_models import ConstantVelocity
from arrivals.scenarios import create
from arrivals.scenarios.simulations import (
    StationsGhost,
    StationsRadio,
    StationsSound,
    StationsTrial,
)
from arrivals.scenarios.simulations.stations.base import StationsScenario
from arrivals.scenarios.simulations.stations.paths import SquareMap, ghost_paths, moving_paths
from arrivals.trackers.fusion.births.crossings import crossing

SCENES: list[StationsScenario] = [StationsRadio(), StationsSound(), StationsGhost()]


def drawn(scene: StationsScenario, seed: int = 0) -> StationsTrial:
    return scene.sample(np.random.default_rng(seed))


def azimuths(trial: StationsTrial, stations: Any) -> Any:
    """Return azimuths from stations, (n_steps, n_stations, n_sources), rad."""
    d = trial.truth[:, None] - np.stack([each.position for each in stations])[:, None]
    return np.arctan2(d[..., 1], d[..., 0])


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 6))
def test_moving_paths_stay_inside_and_apart(seed: int, n_sources: int) -> None:
    square = SquareMap(1000.0, (4.0, 12.0), ConstantVelocity(0.05))
    paths = moving_paths(square, n_sources, 60, 0.05, np.random.default_rng(seed))
    assert paths.shape == (60, n_sources, 2)
    assert paths.min() > 30
    assert paths.max() < 970
    apart = np.linalg.norm(paths[:, :, None] - paths[:, None], axis=-1) + 1e9 * np.eye(n_sources)
    assert apart.min() > 45 or n_sources == 1


def test_moving_paths_have_the_speeds_and_noise_of_the_scene() -> None:
    square = SquareMap(1e6, (4.0, 12.0), ConstantVelocity(0.5))
    rng = np.random.default_rng(0)
    paths = np.concatenate([moving_paths(square, 1, 60, 0.0, rng) for _ in range(300)], axis=1)
    speed = np.linalg.norm(paths[1] - paths[0], axis=-1)
    assert speed.mean() == pytest.approx(8.0, abs=0.5)
    # x_{t+1} - 2 x_t + x_{t-1} has the variance 2 q/3 of continuous white acceleration
    bend = np.diff(paths, n=2, axis=0)
    assert bend.var() == pytest.approx(2 / 3 * 0.5, rel=0.03)


@pytest.mark.parametrize("seed", range(5))
def test_activity_begins_and_ends_as_specified(seed: int) -> None:
    on = ~np.isnan(drawn(StationsRadio(), seed).truth[..., 0])
    assert on[:, 0].all()
    assert 38 <= on[:, 1].sum() <= 51
    assert on[0, 1]
    assert 60 - 19 <= on[:, 2].sum() <= 60 - 8
    assert on[-1, 2]
    np.testing.assert_array_equal(np.flatnonzero(on[:, 3]), np.arange(15, 45))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("n_stations", [3, 4])
def test_ghost_bearings_cross_where_no_source_is(seed: int, n_stations: int) -> None:
    trial = drawn(StationsGhost(n_stations=n_stations), seed)
    stations = trial.stations[:3]
    azimuth = azimuths(trial, stations)[0, range(3), range(3)]
    places = np.stack([each.position for each in stations])
    x, _, residual = crossing(places, azimuth, np.full(3, 1e-4))
    assert np.abs(residual).max() < 0.01  # rad; sources move by 0.2 m a step
    assert np.linalg.norm(trial.truth[0] - x, axis=1).min() > 40
    assert np.linalg.norm(np.ptp(trial.truth, axis=0), axis=1).max() < 20


def test_ghost_paths_accept_draws_that_are_always_too_near() -> None:
    square = SquareMap(1000.0, (4.0, 12.0), ConstantVelocity(0.05))
    positions = np.array([[300.0, 300.0], [310.0, 300.0], [305.0, 310.0]])
    paths = ghost_paths(square, positions, 2, 1.0, np.random.default_rng(0))
    assert paths.shape == (2, 3, 2)


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: type(scene).__name__)
def test_snapshots_have_the_stated_power_at_the_true_directions(scene: StationsScenario) -> None:
    trial = drawn(scene.replace(snr_db=20.0, heading_std=0.1, position_std=0.01 * scene.size))
    model = trial.measurement
    mean_square = (np.abs(trial.measurements) ** 2).mean(axis=(2, 3, 4)[: len(model.shape)])
    expected = np.nansum(trial.power, axis=2) + model.noise
    ratio = mean_square / expected  # of few dozen numbers each
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
    # the true directions explain all but the noise
    heading = np.array([each.heading for each in trial.true_stations])[:, None]
    doa = azimuths(trial, trial.true_stations) - heading
    on = ~np.isnan(trial.truth[0, :, 0])
    A = np.moveaxis(
        model.steering_vector(doa[0][:, on]).reshape(len(doa[0]), on.sum(), -1, 8), 1, 3
    )
    Y = np.swapaxes(trial.measurements[0].reshape(len(A), model.n_bins, -1, 8), 2, 3)
    rest = Y - A @ (np.linalg.pinv(A) @ Y)
    assert (np.abs(rest) ** 2).mean() * 8 / (8 - on.sum()) == pytest.approx(1.0, abs=0.15)


def test_power_is_the_snr_at_half_the_size() -> None:
    trial = drawn(StationsRadio(snr_db=10.0))
    places = np.stack([each.position for each in trial.true_stations])
    r = np.linalg.norm(trial.truth[:, None] - places[:, None], axis=-1)
    np.testing.assert_allclose(trial.power, 10 * (500 / np.maximum(r, 30)) ** 2)


def test_missing_station_has_no_data_in_the_middle_third() -> None:
    whole, gap = drawn(StationsRadio()), drawn(StationsRadio(n_missing=1))
    missing = np.isnan(gap.measurements).all(axis=(2, 3))
    np.testing.assert_array_equal(np.argwhere(missing), [[t, 1] for t in range(20, 40)])
    np.testing.assert_array_equal(gap.measurements[~missing], whole.measurements[~missing])
    np.testing.assert_array_equal(np.isnan(gap.power).all(axis=2), missing)


def test_nominal_stations_differ_from_the_true_ones_by_their_deviations() -> None:
    scene = StationsRadio(n_stations=8, n_steps=1, heading_std=0.02, position_std=10.0)
    turns, shifts = [], []
    for seed in range(100):
        trial = drawn(scene, seed)
        for nominal, true in zip(trial.stations, trial.true_stations, strict=True):
            turns.append(true.heading - nominal.heading)
            shifts.append(true.position - nominal.position)
            assert (nominal.heading_std, nominal.position_std) == (0.02, 10.0)
    assert np.std(turns) == pytest.approx(0.02, rel=0.1)
    assert np.std(shifts) == pytest.approx(10.0, rel=0.1)
    exact = drawn(StationsRadio())
    assert all(a == b for a, b in zip(exact.stations, exact.true_stations, strict=True))


def test_readings_are_levels_with_shadowing() -> None:
    scene = StationsRadio(n_sources=1, n_rss_sensors=400, n_steps=60)
    trial = drawn(scene)
    assert trial.rss is not None
    readings = np.stack([step[-1] for step in trial.measurements])
    assert [len(step) for step in trial.measurements] == [5] * 60
    levels = trial.rss.levels(np.zeros((60, 1)), trial.truth).log_sigma
    error = readings - levels
    u = error.mean()  # of the source, 3 dB
    assert abs(u) < 3 * db_to_neper(3.0)
    assert error.std() == pytest.approx(float(db_to_neper(4.0)), rel=0.05)
    np.testing.assert_array_equal(trial.measurements[5][2], drawn(scene).measurements[5][2])
    assert trial.rss.log_noise == pytest.approx(-10.36, abs=0.01)  # level of u = 0 at 1 km


@pytest.mark.parametrize("n_rss_sensors", [0, 8])
def test_step_is_a_measurement_of_fused(n_rss_sensors: int) -> None:
    trial = drawn(StationsRadio(n_sources=1, n_missing=1, n_rss_sensors=n_rss_sensors, n_steps=9))
    tracker: Any = trial.tracker("fused")
    run = tracker.run(trial.measurements)
    assert len(run) == 9
    assert np.linalg.norm(run.position[-1, 0] - trial.truth[-1, 0]) < 30
    assert tracker.speed_std == pytest.approx(8.4)


def test_cut_off_is_five_percent_of_the_size() -> None:
    assert [drawn(scene).cut_off for scene in SCENES] == pytest.approx([50.0, 1.5, 50.0])
    assert create("stations_sound").truth_unit == "m"


def test_draws_depend_on_the_seed_alone() -> None:
    one, same, other = (drawn(StationsSound(n_steps=3), seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(one.measurements, same.measurements)
    assert not np.array_equal(one.measurements, other.measurements)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n_stations": 9}, "n_stations must be at most 8; got 9"),
        ({"n_sources": 7}, "n_sources must be at most 6; got 7"),
        ({"n_steps": 101}, "n_steps must be at most 100; got 101"),
        ({"n_missing": 4}, "n_missing must be at most 3; got 4"),
        ({"heading_std": -1.0}, "heading_std must be"),
        ({"spread": 0.0}, "spread must be"),
        ({"snr_db": np.nan}, "snr_db must be within ±300; got nan"),
    ],
)
def test_scene_refuses_arguments_out_of_range(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        StationsRadio(**arguments)


def test_ghost_refuses_more_sources_than_stations() -> None:
    with pytest.raises(ValueError, match=r"^n_sources must be at most n_stations, 3; got 4$"):
        StationsGhost(n_sources=4)
