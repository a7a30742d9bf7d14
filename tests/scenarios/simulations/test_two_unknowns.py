"""Scenes on the sphere and in the near field."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest

from arrivals.measurement_models.arrays.sphere import great_circle, unit_vectors
from arrivals.scenarios import create
from arrivals.scenarios.simulations import NearField
from arrivals.scenarios.simulations.sources_on_sphere import ArrayName, array_of


def test_directions_cross_in_azimuth_pass_the_zenith_and_stay_at_the_horizon() -> None:
    """Specification, section 9."""
    trial: Any = create("sphere").sample(np.random.default_rng(0))
    azimuth, elevation = np.rad2deg(trial.truth), np.rad2deg(trial.elevation)
    assert azimuth.shape == elevation.shape == (50, 4)
    difference = azimuth[:, 0] - azimuth[:, 1]
    assert difference[24] * difference[25] < 0
    np.testing.assert_allclose(elevation[:, :2], [[25, 55]] * 50)
    assert np.isnan(azimuth[:10, 2]).all()
    assert elevation[25, 2] == pytest.approx(90)
    u = unit_vectors(trial.truth[10:, 2], trial.elevation[10:, 2])
    np.testing.assert_allclose(np.rad2deg(great_circle(u[1:], u[:-1])), 1)
    np.testing.assert_allclose(elevation[:35, 3], 3)
    np.testing.assert_array_equal(np.isnan(trial.elevation), np.isnan(trial.truth))
    assert np.isnan(azimuth[35:, 3]).all()


@pytest.mark.parametrize(
    ("name", "n_sensors", "n_sources", "half", "edge"),
    [
        ("ura4", 16, 4, True, 0.5),
        ("ura8", 64, 4, True, 0.5),
        ("uca8", 8, 4, True, 1.3 * np.sin(np.pi / 8)),
        ("uca6", 6, 3, True, 0.5),
        ("tetra4", 4, 2, False, 0.5),
        ("sph12", 12, 4, False, None),
    ],
)
def test_arrays_are_those_of_the_specification(
    name: Any, n_sensors: int, n_sources: int, half: bool, edge: float | None
) -> None:
    trial: Any = create("sphere", array=name, n_bins=2, n_steps=3).sample(np.random.default_rng(0))
    assert trial.measurements.shape == (3, 2, 10, n_sensors)
    assert trial.truth.shape == (3, n_sources)
    assert trial.measurement.half_space is half
    assert trial.measurement.wavelengths == pytest.approx((1 / 0.6, 1.0))
    p = array_of(name).positions
    apart = np.linalg.norm(p[:, None] - p[None], axis=2) + 9 * np.eye(n_sensors)
    if edge is not None:
        np.testing.assert_allclose(apart.min(axis=1), edge)
    assert name in get_args(ArrayName)


def test_snr_is_that_of_all_sources_of_the_scene_over_a_sensor() -> None:
    loud, quiet = (
        create("sphere", array="tetra4", snr_db=snr).sample(np.random.default_rng(0)).measurements
        for snr in (300.0, 10.0)
    )
    noise = np.mean(np.abs(quiet - loud) ** 2)
    assert noise == pytest.approx(2 * 0.1, rel=0.1)
    assert np.mean(np.abs(loud) ** 2) == pytest.approx(2, rel=0.15)


def test_near_field_sources_are_received_with_equal_power() -> None:
    scene = NearField([-10, 25], [0.3, 3], snr_db=20, n_steps=400)
    trial: Any = scene.sample(np.random.default_rng(0))
    assert trial.truth.shape == trial.range.shape == (400, 2)
    np.testing.assert_allclose(trial.range, [[0.3, 3.0]] * 400)
    a = trial.measurement.steering_vector(np.deg2rad([-10, 25]), distance=[0.3, 3.0])
    received = (np.abs(a * scene.amplitudes()[:, None]) ** 2).mean(axis=1)
    np.testing.assert_allclose(received, 1)
    assert np.mean(np.abs(trial.measurements) ** 2) == pytest.approx(2.01, rel=0.1)
    assert trial.measurement.nearest == 0.3


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        ("sphere", {"array": "ura5"}, "array must be"),
        ("sphere", {"n_steps": 0}, "n_steps must be"),
        ("sphere", {"snr_db": "loud"}, "snr_db must be"),
        ("near_field", {"doa_deg": [1.0, 2.0]}, "equal length; got 2 and 1"),
        ("near_field", {"doa_deg": [np.nan]}, "doa_deg must be a list of finite numbers"),
        ("near_field", {"range_m": [0.0]}, "range_m must be finite and positive"),
        ("near_field", {"nearest": 0.1}, "quarter of the array's extent of 1.2 m"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(
    name: str, params: dict[str, Any], message: str
) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        create(name, **params)
