"""Peaks at the ends of a scan; ambiguous arrays; simulations without noise."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import create, find_peaks
from arrivals.trackers.beamforming import parabolic_peak, scan_directions, scan_is_joined
from arrivals.typing import Complex

SCANS = ["cbf", "mvdr", "music", "sbl", "ssbl", "peaks_gnn"]
OTHERS = ["root_music", "esprit", "past", "svalse", "valse"]


def one_source(model: ArraySnapshot, degrees: float, n: int = 12) -> Complex:
    rng = np.random.default_rng(1)
    phases = np.exp(2j * np.pi * rng.random((n, 1)))
    return model.simulate(np.full((n, 1), np.deg2rad(degrees)), phases, rng)


@pytest.mark.parametrize("name", SCANS)
@pytest.mark.parametrize("degrees", [90.0, -90.0])
def test_source_at_endfire_is_detected(name: str, degrees: float) -> None:
    model = ArraySnapshot(SensorArray.ula(8, spacing=0.42), wavelength=1.0, noise=0.01)
    run = create(name, measurement=model).run(one_source(model, degrees))
    near = np.abs(np.rad2deg(run.doa[-6:]) - degrees) < 12
    assert near.any(axis=1).sum() >= 3
    assert np.nanmax(np.abs(run.doa)) <= np.pi / 2


@pytest.mark.parametrize("name", ["cbf", "mvdr"])
def test_ends_at_half_a_wavelength_are_one_direction(name: str) -> None:
    model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=1e-6)
    run = create(name, measurement=model, threshold_db=6.0).run(one_source(model, 90.0))
    assert (run.n_found == 1).all()
    assert (np.abs(run.doa[:, 0]) > np.deg2rad(85)).all()


def test_joined_ends_are_below_but_near_half_a_wavelength() -> None:
    joined = [scan_is_joined(SensorArray.ula(8, d), (1.0,)) for d in (0.5, 0.49, 0.42, 0.3)]
    assert joined == [True, True, False, False]
    assert not scan_is_joined(SensorArray.uca(8, 0.6), (1.0,))


@given(st.lists(st.floats(0.1, 1.0), min_size=3, max_size=9))
def test_peaks_of_a_line_are_those_of_its_even_continuation(values: list[float]) -> None:
    power = np.array(values)
    mirrored = np.concatenate([power[1:2], power, power[-2:-1]])
    expected = [n for n in range(len(power)) if mirrored[n] + 1e-9 < power[n] >= mirrored[n + 2]]
    assert sorted(find_peaks(power, circular=False).tolist()) == expected


@given(st.floats(-np.pi, np.pi - 1e-9))
def test_refined_peak_of_a_circle_lies_within_the_circle(azimuth: float) -> None:
    grid = scan_directions(SensorArray.uca(5, 0.5), 36)
    level = np.cos(grid - azimuth)
    doa = parabolic_peak(grid, level, np.array([level.argmax()]))[0]
    assert -np.pi <= doa < np.pi
    assert abs(np.angle(np.exp(1j * (doa - azimuth)))) < 1e-3


def test_parabola_at_an_end_continues_evenly_on_a_line_and_around_a_circle() -> None:
    level, ends = np.array([4.0, 3.0, 0.0, 1.0, 3.5]), np.array([0, 4])
    line, circle = np.linspace(-np.pi / 2, np.pi / 2, 5), np.linspace(-np.pi, np.pi, 5, False)
    np.testing.assert_array_equal(parabolic_peak(line, level, ends), line[ends])
    # the vertex through 3.5, 4 and 3, and through 1, 3.5 and 4: limited to half a step
    expected = np.array([np.pi - (np.pi / 15), circle[4] + np.pi / 5])
    np.testing.assert_allclose(parabolic_peak(circle, level, ends), expected, rtol=1e-12)
    assert parabolic_peak(line, level, ends[:0]).shape == (0,)


@pytest.mark.parametrize("name", [*SCANS, *OTHERS])
def test_one_source_without_noise_is_one_direction(name: str) -> None:
    model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)
    z = np.exp(1j * np.arange(12))[:, None] * model.steering_vector(np.deg2rad(-33.0))
    doa = create(name, measurement=model).run(z).doa[-1]
    np.testing.assert_allclose(np.rad2deg(doa[~np.isnan(doa)]), [-33.0], atol=0.5)


@pytest.mark.parametrize("name", ["music", "root_music", "esprit", "past", "mvdr"])
def test_two_sources_without_noise_are_two_directions(name: str) -> None:
    model = ArraySnapshot(SensorArray.ula(7, spacing=0.45), wavelength=1.0, noise=0.01)
    s = np.random.default_rng(0).standard_normal((60, 2, 2)) @ [1, 1j]
    doa = create(name, measurement=model).run(s @ model.steering_vector([-0.5, 0.3])).doa[-1]
    np.testing.assert_allclose(np.sort(doa[~np.isnan(doa)]), [-0.5, 0.3], atol=0.01)


@pytest.mark.parametrize("name", [*SCANS, "svalse", "valse"])
def test_ambiguous_array_gives_one_warning_that_names_the_directions(name: str) -> None:
    model = ArraySnapshot(SensorArray.ula(8, spacing=0.8), wavelength=1.0)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        tracker = create(name, measurement=model)
        tracker.reset()  # type: ignore[attr-defined]  # of direction trackers
    assert [str(each.message)[:40] for each in caught] == [
        "directions -90.0 and 14.5 degrees are am"
    ]
