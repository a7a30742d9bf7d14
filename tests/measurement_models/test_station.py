"""Stations on a map: azimuths, their slopes, late waves, images of a line, refusals."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.differentiation import numerical_jacobian
from arrivals.measurement_models import ArraySnapshot, Bearing, SensorArray
from arrivals.measurement_models.station import Station, StationEntries
from arrivals.parameters import Configurable
from arrivals.typing import Float

coordinates = st.floats(-50, 50)
angles = st.floats(-np.pi, np.pi)
speeds = st.floats(-20, 20)
WITH_ERRORS = StationEntries(errors=4)
PLACE = np.array([3.0, -7.0])
CIRCLE = ArraySnapshot(SensorArray.uca(8, 0.65), wavelength=1.0)
LINE = ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0)


def wrapped(one: Float, other: Float) -> Float:
    return np.asarray((one - other + np.pi) % (2 * np.pi) - np.pi)


@given(coordinates, coordinates)
def test_station_without_errors_equals_bearing(x: float, y: float) -> None:
    station, bearing = Station(None, PLACE, heading=0.4), Bearing([PLACE], 0.01)
    state = np.array([x, 3.0, y, -2.0])
    if np.hypot(x - 3, y + 7) > 1e-3:
        np.testing.assert_array_equal(station.azimuth(state), bearing.h(state)[0])
        np.testing.assert_allclose(station.slope(state), bearing.H(state)[0], rtol=1e-12)


@given(coordinates, coordinates, speeds, speeds, st.sampled_from([30.0, 343.0, np.inf]))
def test_slope_with_errors_and_late_waves_equals_numerical_derivative(
    x: float, y: float, vx: float, vy: float, wave_speed: float
) -> None:
    station = Station(None, PLACE, heading_std=0.1, position_std=1.0, wave_speed=wave_speed)
    state = np.array([x, vx, y, vy, 0.1, 0.8, -0.3])
    late = state[[0, 2]] - PLACE - state[5:]
    source = late - state[[1, 3]] * np.hypot(*late) / wave_speed
    if min(np.hypot(*source), np.hypot(*late)) > 0.5:
        expected = numerical_jacobian(
            lambda s: station.azimuth(s, WITH_ERRORS)[..., None], state, wrapped
        )
        np.testing.assert_allclose(station.slope(state, WITH_ERRORS), expected[0], atol=1e-7)


@given(st.floats(20, 200), angles, st.floats(0, 15), angles)
def test_late_wave_comes_from_where_the_source_was(
    r: float, bearing: float, speed: float, course: float
) -> None:
    q = r * np.array([np.cos(bearing), np.sin(bearing)])
    v = speed * np.array([np.cos(course), np.sin(course)])
    state = np.array([3 + q[0], v[0], -7 + q[1], v[1]])
    # |q - v τ| = c τ, the retarded time τ in closed form
    c, qv = 343.0, q @ v
    tau = (np.sqrt(qv**2 + (c**2 - v @ v) * r**2) - qv) / (c**2 - v @ v)
    exact = np.arctan2(*(q - v * tau)[::-1])
    error = wrapped(Station(None, PLACE, wave_speed=c).azimuth(state), exact)
    assert abs(error) <= 1.2 * (speed / c) ** 2 + 1e-12  # second order; without delay the first


def test_late_wave_of_a_crossing_source_lags_by_speed_over_wave_speed() -> None:
    state = [100.0, 0.0, 0.0, 34.3]
    lag = Station(None, [0.0, 0.0], wave_speed=343.0).azimuth(state)
    assert float(lag) == pytest.approx(-np.arctan(0.1))
    at_rest = StationEntries(velocity=None)
    assert Station(None, [0.0, 0.0], wave_speed=343.0).azimuth(state, at_rest) == 0


@given(angles, coordinates, coordinates, coordinates, coordinates, speeds, speeds)
def test_moved_and_turned_map_turns_azimuths_alone(
    turn: float, x: float, y: float, east: float, north: float, vx: float, vy: float
) -> None:
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    p, v, e = np.array([x, y]), np.array([vx, vy]), np.array([0.5, -0.2])

    def azimuth(p: Float, v: Float, e: Float, place: Float) -> Float:
        station = Station(None, place, position_std=1.0, wave_speed=100.0)
        return station.azimuth([p[0], v[0], p[1], v[1], 0.05, *e], WITH_ERRORS)

    if np.hypot(*(p - PLACE)) > 2:
        shift = np.array([east, north])
        moved = azimuth(R @ p + shift, R @ v, R @ e, R @ PLACE + shift)
        change = wrapped(moved, azimuth(p, v, e, PLACE))
        np.testing.assert_allclose(wrapped(change, np.array(turn)), 0, atol=1e-9)


@given(angles, angles)
def test_heading_turns_directions_to_the_map(heading: float, doa: float) -> None:
    found = Station(CIRCLE, PLACE, heading).to_map([doa])
    assert found.shape == (1, 1)
    assert -np.pi <= found[0, 0] < np.pi
    np.testing.assert_allclose(wrapped(found[0, 0], np.array(heading + doa)), 0, atol=1e-12)


@given(angles, st.floats(-1.5, 1.5))
def test_images_of_a_line_have_the_response_of_the_direction(heading: float, doa: float) -> None:
    station = Station(LINE, PLACE, heading)
    images = station.to_map(doa)
    axis = np.array([np.cos(heading), np.sin(heading)])
    waves = np.stack([np.cos(images), np.sin(images)], axis=-1)
    # sin of the direction from broadside is the cosine with the axis of the sensors
    np.testing.assert_allclose(waves @ axis, np.sin(doa), atol=1e-12)
    assert station.is_line
    assert images.shape == (2,)
    across = waves @ [-axis[1], axis[0]]
    assert across[0] == pytest.approx(-across[1], abs=1e-9)


def test_azimuth_and_slope_accept_leading_axes() -> None:
    states = np.random.default_rng(0).normal(scale=20, size=(2, 3, 7))
    station = Station(None, PLACE, wave_speed=343.0, heading_std=0.1)
    azimuth, slope = station.azimuth(states, WITH_ERRORS), station.slope(states, WITH_ERRORS)
    assert (azimuth.shape, slope.shape) == ((2, 3), (2, 3, 7))
    assert azimuth[1, 2] == station.azimuth(states[1, 2], WITH_ERRORS)
    np.testing.assert_array_equal(slope[1, 2], station.slope(states[1, 2], WITH_ERRORS))


def test_slope_at_the_station_is_finite() -> None:
    state = np.array([3.0, 5.0, -7.0, 1.0])
    for speed in (343.0, np.inf):
        assert np.isfinite(Station(None, PLACE, wave_speed=speed).slope(state)).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"measurement": 3}, "measurement must be a DirectionMeasurement or None; got 3"),
        ({"measurement": Bearing([PLACE], 0.1)}, "measurement must be a DirectionMeasurement"),
        ({"position": [1.0]}, r"position must have shape \(2,\); got \(1,\)"),
        ({"position": [1.0, np.nan]}, "position must be finite"),
        ({"position": "here"}, "position must hold real numbers"),
        ({"heading": np.inf}, "heading must be finite; got inf"),
        ({"heading": np.nan}, "heading must be finite; got nan"),
        ({"heading": "north"}, "heading must be a number; got 'north'"),
        ({"heading_std": -0.1}, "heading_std must be finite and not negative; got -0.1"),
        ({"position_std": np.inf}, "position_std must be finite and not negative; got inf"),
        ({"wave_speed": 0.0}, "wave_speed must be positive; got 0.0"),
        ({"wave_speed": np.nan}, "wave_speed must be positive; got nan"),
        ({"name": 7}, "name must be a str; got 7"),
    ],
)
def test_station_invalid_argument_raises_one_line(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message) as caught:
        Station(**{"measurement": None, "position": PLACE} | arguments)
    assert "\n" not in str(caught.value)


def test_equal_stations_are_interchangeable() -> None:
    one = Station(CIRCLE, [3.0, -7.0], 0.5, heading_std=0.1, wave_speed=343.0, name="mast")
    same = Station(CIRCLE.replace(), (3, -7), 0.5, heading_std=0.1, wave_speed=343, name="mast")
    assert one == same
    assert hash(one) == hash(same)
    assert one != one.replace(heading=0.6)
    assert one != "mast"
    for changed in ({"position": [3.0, -7.1]}, {"measurement": LINE}, {"name": "pole"}):
        assert one.replace(**changed) != one
    assert one.replace(heading=0.6).replace(heading=0.5) == one
    assert pickle.loads(pickle.dumps(one)) == one
    assert copy.deepcopy(one) is one


def test_zero_of_either_sign_makes_equal_stations() -> None:
    assert Station(None, [-0.0, 1.0]) == Station(None, [0.0, 1.0])
    assert hash(Station(None, [-0.0, 1.0])) == hash(Station(None, [0.0, 1.0]))


@pytest.mark.parametrize("measurement", [None, CIRCLE])
def test_station_survives_a_round_trip_as_a_dictionary(measurement: ArraySnapshot | None) -> None:
    station = Station(measurement, PLACE, 0.5, position_std=2.0, name="mast")
    assert Configurable.from_dict(station.to_dict()) == station


def test_position_of_a_station_is_a_copy_that_cannot_change() -> None:
    place = np.array([1.0, 2.0])
    station = Station(None, place)
    place[0] = 9.0
    assert station.position[0] == 1
    with pytest.raises(ValueError, match="read-only"):
        station.position[0] = 5.0
    assert (station.has_errors, Station(None, place, heading_std=0.1).has_errors) == (False, True)
