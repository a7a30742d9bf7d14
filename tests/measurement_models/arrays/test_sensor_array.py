"""Geometry of arrays, and the one steering sign."""

import copy
import dataclasses
import itertools
import pickle
from math import gcd
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from arrivals.measurement_models import SensorArray, steering_vector
from arrivals.measurement_models.arrays.sensor_array import direction
from arrivals.measurement_models.arrays.uniform_grid import grid_spacing
from arrivals.typing import Float

angles = st.floats(-np.pi, np.pi)

# the steering sign, from the physics


@pytest.mark.parametrize(
    ("dim", "doa_deg"),
    [(1, -70.0), (1, 35.0), (2, -20.0), (2, 35.0), (2, 130.0), (3, -100.0), (3, 35.0)],
)
def test_steering_phases_are_those_of_a_delayed_wave(dim: int, doa_deg: float) -> None:
    """A real wave, sampled in time where it passes each sensor, and its spectrum's phases."""
    speed, frequency, rate, n = 340.0, 1000.0, 16000.0, 1600
    positions = np.random.default_rng(3).uniform(-0.3, 0.3, (6, dim))  # no symmetry
    doa = np.deg2rad(doa_deg)
    ahead, aside = np.cos(doa), np.sin(doa)
    source = 1e7 * np.array([ahead, aside, 0.0])  # far away
    # of the line, "broadside" is the direction ahead, and its sensors lie along the other axis
    places = np.pad(positions, ((0, 0), (1, 1) if dim == 1 else (0, 3 - dim)))
    distance = np.linalg.norm(places - source, axis=1)
    t = np.arange(n) / rate + 1e7 / speed
    samples = np.cos(2 * np.pi * frequency * (t - distance[:, None] / speed) + 0.4)
    spectrum = np.fft.rfft(samples, axis=1)[:, round(frequency * n / rate)]
    expected = steering_vector(positions, doa, speed / frequency)
    measured = spectrum / np.abs(spectrum)
    turn = measured[0] / expected[0]  # the phase of the source
    np.testing.assert_allclose(measured, turn * expected, atol=1e-4)


def test_nearer_sensor_is_ahead() -> None:
    near_and_far = SensorArray.ula(2, spacing=0.1).steering_vector(np.pi / 6, wavelength=1.0)[::-1]
    assert np.angle(near_and_far[0] / near_and_far[1]) == pytest.approx(2 * np.pi * 0.1 * 0.5)


@settings(deadline=None)
@given(hnp.arrays(float, (5, 2), elements=st.floats(-3, 3)), angles, angles)
def test_turning_array_and_source_together_changes_nothing(
    positions: Float, doa: float, turn: float
) -> None:
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    np.testing.assert_allclose(
        steering_vector(positions @ rotation.T, doa + turn, 0.7),
        steering_vector(positions, doa, 0.7),
        atol=1e-12,
    )


@settings(deadline=None)
@given(hnp.arrays(float, (5, 1), elements=st.floats(-3, 3)), angles, st.floats(-3, 3))
def test_moving_a_line_turns_all_phases_alike(positions: Float, doa: float, shift: float) -> None:
    ratio = steering_vector(positions + shift, doa, 0.7) / steering_vector(positions, doa, 0.7)
    np.testing.assert_allclose(ratio, ratio[0], atol=1e-12)


def test_line_equals_the_same_sensors_in_the_plane() -> None:
    """A line along y has azimuth β where a line of its own counts β from broadside."""
    line = SensorArray.ula(5, spacing=0.3)
    plane = SensorArray(np.column_stack([np.zeros(5), line.positions[:, 0]]))
    np.testing.assert_allclose(
        line.steering_vector([-0.4, 0.9], 1.0), plane.steering_vector([-0.4, 0.9], 1.0), atol=1e-14
    )


def test_directions_and_wavelengths_broadcast() -> None:
    array = SensorArray.uca(4, radius=0.2)
    a = array.steering_vector(np.zeros((3, 1)), wavelength=[1.0, 2.0])
    assert a.shape == (3, 2, 4)
    np.testing.assert_allclose(a[1, 1], array.steering_vector(0.0, 2.0))
    assert direction(np.zeros((2, 3)), 3).shape == (2, 3, 3)


# geometry


def test_shapes_are_where_they_should_be() -> None:
    assert SensorArray.ula(3, 2.0).positions.ravel().tolist() == [-2.0, 0.0, 2.0]
    np.testing.assert_allclose(
        SensorArray.uca(4, 2.0).positions, [[2, 0], [0, 2], [-2, 0], [0, -2]], atol=1e-12
    )
    assert SensorArray.symmetric([3.0, 1.0]).positions.ravel().tolist() == [-3, -1, 0, 1, 3]
    free = SensorArray(np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]))
    assert (free.n_sensors, free.dim) == (2, 3)
    assert SensorArray(np.array([1.0, 5.0])).dim == 1


def test_missing_sensors_are_left_out_and_the_others_stay() -> None:
    whole = SensorArray.ula(5, 1.0)
    gaps = SensorArray.ula(5, 1.0, missing=[1, 3])
    np.testing.assert_array_equal(gaps.positions, whole.positions[[0, 2, 4]])
    assert gaps == whole.without([3, 1]) == whole.without([3]).without([1])
    assert whole.without([]) is whole
    assert SensorArray.uca(6, 1.0, missing=[0]).n_sensors == 5
    assert SensorArray.symmetric([1.0, 2.0], missing=[2]).positions.ravel().tolist() == [
        -2, -1, 1, 2,
    ]  # fmt: skip


NONSENSE: list[tuple[Any, type[Exception], str]] = [
    (lambda: SensorArray(np.array([0.0, 1.0, 0.0])), ValueError, "numbers 1 and 3 of 3"),
    (lambda: SensorArray(np.array([[0.0, 1.0], [0.0, 1.0]])), ValueError, "numbers 1 and 2 of"),
    (lambda: SensorArray(np.array([0.0, np.nan])), ValueError, "finite; sensor 1 is at"),
    (lambda: SensorArray(np.zeros((2, 4))), ValueError, r"dim 1, 2 or 3; got \(2, 4\)"),
    (lambda: SensorArray(np.zeros((0, 2))), ValueError, r"got \(0, 2\)"),
    (lambda: SensorArray(np.array(1.0)), ValueError, r"got \(\)"),
    (lambda: SensorArray(np.array(["a"])), TypeError, "positions must hold real numbers"),
    (lambda: SensorArray(np.array([1j])), TypeError, "positions must hold real numbers"),
    (lambda: SensorArray.ula(0, 1.0), ValueError, "n_sensors must be at least 1"),
    (lambda: SensorArray.ula(3, -1.0), ValueError, "spacing must be finite and positive"),
    (lambda: SensorArray.uca(1, 1.0), ValueError, "n_sensors must be at least 2"),
    (lambda: SensorArray.uca(3, 0.0), ValueError, "radius must be finite and positive"),
    (lambda: SensorArray.symmetric([]), ValueError, "distances must be a list"),
    (lambda: SensorArray.symmetric([0.0, 1.0]), ValueError, "distances must be a list"),
    (lambda: SensorArray.symmetric([1.0, 1.0]), ValueError, "share the position"),
    (lambda: SensorArray.ula(3, 1.0, speed=0.0), ValueError, "speed must be finite"),
    (lambda: SensorArray.ula(3, 1.0, missing=[3]), ValueError, "sensor 3 is not there"),
    (lambda: SensorArray.ula(3, 1.0, missing=[-1]), ValueError, "at least 0; got -1"),
    (
        lambda: SensorArray.ula(3, 1.0, missing=[0, 1, 2]),
        ValueError,
        "must leave at least one",
    ),
    (lambda: SensorArray(np.arange(3.0), channels=[0, 1]), ValueError, "each of the 3 sensors"),
    (lambda: SensorArray(np.arange(2.0), channels=[4, 4]), ValueError, "differ from each other"),
    (lambda: SensorArray(np.arange(2.0), channels=[0, 5], n_channels=4), ValueError, "at least 6"),
    (lambda: SensorArray(np.arange(2.0), n_channels=1), ValueError, "at least 2; got 1"),
    (lambda: SensorArray.ula(3, 1.0).wavelength(100.0), ValueError, "no wave speed"),
]


@pytest.mark.parametrize(("make", "error", "message"), NONSENSE)
def test_nonsense_is_refused(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def test_wavelength_is_speed_by_frequency() -> None:
    assert SensorArray.ula(3, 1.0, speed=1500.0).wavelength(200.0) == 7.5


def test_alias_limit_is_two_spacings_of_a_line_and_no_others() -> None:
    assert SensorArray.ula(5, 0.5, missing=[2]).alias_limit == pytest.approx(1.0)
    assert SensorArray.ula(4, 0.5, missing=[1]).alias_limit == pytest.approx(1.0)
    assert SensorArray.ula(5, 0.5, missing=[1, 3]).alias_limit == pytest.approx(2.0)
    assert SensorArray.uca(5, 0.5).alias_limit is None
    assert SensorArray(np.array([0.0, 1.0, 2.7183])).alias_limit is None


# a frozen model


def every_array() -> list[SensorArray]:
    line = SensorArray.ula(4, 0.5)
    return [
        line,
        SensorArray.ula(4, 0.5, speed=340.0),
        SensorArray.ula(4, 0.5001),
        line.without([0]),
        SensorArray(line.positions, channels=[3, 2, 1, 0]),
        SensorArray(line.positions, n_channels=8),
        SensorArray.uca(4, 0.5),
    ]


def test_equal_where_all_numbers_are() -> None:
    assert every_array() == every_array()
    assert [hash(array) for array in every_array()] == [hash(array) for array in every_array()]
    for one, other in itertools.combinations(every_array(), 2):
        assert one != other
    assert SensorArray.ula(2, 1.0) != "a line"


def test_equal_arrays_hash_alike_even_at_minus_zero() -> None:
    one, other = SensorArray(np.array([-0.0, 1.0])), SensorArray(np.array([0.0, 1.0]))
    assert one == other
    assert hash(one) == hash(other)


@pytest.mark.parametrize("array", every_array())
def test_array_survives_copies_and_configuration(array: SensorArray) -> None:
    assert copy.deepcopy(array) is array
    loaded = pickle.loads(pickle.dumps(array))
    assert loaded == array
    assert not loaded.positions.flags.writeable
    assert SensorArray.from_dict(array.to_dict()) == array


def test_nothing_of_an_array_can_be_changed() -> None:
    given = np.arange(3.0)
    array = SensorArray(given)
    given[0] = 9.0
    assert array.positions[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        array.positions[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        array.speed = 1.0  # type: ignore[misc]
    assert array.replace(speed=2.0).speed == 2.0


# the grid under a sparse line


@settings(deadline=None)
@given(
    st.sets(st.integers(0, 900), min_size=2, max_size=12),
    st.floats(1e-3, 1e3),
    st.floats(-1e3, 1e3),
)
def test_grid_is_the_greatest_common_spacing(
    places: set[int], spacing: float, origin: float
) -> None:
    first, *others = sorted(places)
    divisor = gcd(*(place - first for place in others))
    coordinates = origin + spacing * np.array([*places], dtype=float)
    assert grid_spacing(coordinates) == pytest.approx(divisor * spacing, rel=1e-6)


@settings(deadline=None)
@given(st.sets(st.integers(0, 4000), min_size=2, max_size=12))
def test_grid_holds_all_sensors_each_on_its_own_point(places: set[int]) -> None:
    coordinates = np.sort(np.array([*places], dtype=float))
    spacing = grid_spacing(coordinates)
    assert spacing is not None
    points = (coordinates - coordinates[0]) / spacing
    assert np.abs(points - np.rint(points)).max() <= 1.001e-3
    assert np.diff(np.rint(points)).min() >= 1


@settings(deadline=None)
@given(
    st.sets(st.integers(0, 60), min_size=3, max_size=12),
    st.lists(st.floats(-2e-4, 2e-4), min_size=12, max_size=12),
)
def test_grid_is_found_though_sensors_are_a_little_off(
    places: set[int], errors: list[float]
) -> None:
    neighbours = [*places, max(places) + 1]  # two neighbours show the spacing directly
    coordinates = np.array(neighbours) + np.array([*errors, 0.0])[: len(neighbours)]
    assert grid_spacing(coordinates) == pytest.approx(1.0, rel=1e-3)


@settings(deadline=None)
@given(st.permutations(range(5)))
def test_grid_does_not_see_the_order(order: list[int]) -> None:
    assert grid_spacing(np.array([0.0, 0.3, 0.5, 1.4, 1.7])[order]) == pytest.approx(0.1)


def test_neighbours_far_from_the_rest_do_not_fall_onto_one_point() -> None:
    assert grid_spacing([0.0, 2000.0, 2001.0]) == pytest.approx(1.0)


def test_no_grid_under_irrational_places() -> None:
    assert grid_spacing(np.sqrt([0.0, 1.0, 2.0, 3.0, 5.0])) is None
    assert grid_spacing([0.0, 1.0, 5000.0]) is None  # finer than 4096 points
    assert grid_spacing([1.0]) is None


# channels of a recording


def test_channels_are_selected() -> None:
    recording = np.arange(12).reshape(2, 6)
    whole = SensorArray.ula(6, 1.0)
    np.testing.assert_array_equal(whole.select(recording), recording)
    sparse = whole.without([0, 4])
    np.testing.assert_array_equal(sparse.select(recording), recording[:, [1, 2, 3, 5]])
    np.testing.assert_array_equal(sparse.select(recording[:, :4]), recording[:, :4])
    swapped = SensorArray(np.arange(2.0), channels=[4, 1])
    np.testing.assert_array_equal(swapped.select(recording), recording[:, [4, 1]])
    np.testing.assert_array_equal(swapped.without([0]).select(recording), recording[:, [1]])


@pytest.mark.parametrize(
    ("array", "n_channels", "message"),
    [
        (SensorArray.ula(4, 1.0), 3, "must have 4 channels; got 3"),
        (SensorArray.ula(4, 1.0), 5, "must have 4 channels; got 5"),
        (SensorArray.ula(4, 1.0, missing=[1]), 2, "must have 3 or 4 channels; got 2"),
        (SensorArray(np.arange(2.0), channels=[4, 1]), 4, "2 or at least 5 channels; got 4"),
    ],
)
def test_other_numbers_of_channels_are_refused(
    array: SensorArray, n_channels: int, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        array.select(np.zeros((7, n_channels)))
    with pytest.raises(ValueError, match="got 0"):
        array.select(np.float64(3.0))
