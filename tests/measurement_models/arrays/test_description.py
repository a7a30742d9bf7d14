"""Keys of array files: units, turns, compass bearings, latitude and longitude."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.description import from_description
from arrivals.measurement_models.arrays.positions import UNITS, compass
from arrivals.typing import Float

SQUARE = [[0.0, 0.0], [2.0, 0.5], [-1.0, 1.5]]
KINDS: list[dict[str, Any]] = [
    {"kind": "ula", "n_sensors": 4, "spacing": 0.3},
    {"kind": "uca", "n_sensors": 5, "radius": 2.0},
    {"kind": "symmetric", "distances": [1.0, 2.5]},
    {"kind": "positions", "positions": SQUARE},
]
PLANES = [KINDS[1], KINDS[3], {"kind": "positions", "positions": [[*p, 0.3] for p in SQUARE]}]


def response(keys: dict[str, Any], doa: float) -> Float:
    """Return phases relative to the first element, which do not depend on the origin."""
    a = from_description(keys).steering_vector(doa, wavelength=5.0)
    return np.asarray(a / a[0])


@pytest.mark.parametrize("keys", KINDS, ids=lambda keys: keys["kind"])
@pytest.mark.parametrize("unit", UNITS)
def test_unit_scales_positions(keys: dict[str, Any], unit: str) -> None:
    scaled = from_description({**keys, "unit": unit}).positions
    np.testing.assert_allclose(scaled, UNITS[unit] * from_description(keys).positions, rtol=1e-12)


@pytest.mark.parametrize("keys", PLANES, ids=("circle", "plane", "space"))
@given(doa=st.floats(-3, 3), rotation=st.floats(-360, 360), clockwise=st.booleans())
def test_rotation_is_added_to_directions(
    keys: dict[str, Any], doa: float, rotation: float, clockwise: bool
) -> None:
    keys = {**keys, "clockwise": clockwise}
    turned = response({**keys, "rotation": rotation}, doa + np.deg2rad(rotation))
    np.testing.assert_allclose(turned, response(keys, doa), atol=1e-9)


@pytest.mark.parametrize("keys", PLANES[1:], ids=("plane", "space"))
@given(doa=st.floats(-3, 3))
def test_clockwise_directions_are_compass_bearings(keys: dict[str, Any], doa: float) -> None:
    bearing = np.pi / 2 - doa  # from north, the y axis
    clockwise = response({**keys, "clockwise": True}, bearing)
    np.testing.assert_allclose(clockwise, response(keys, doa), atol=1e-9)


def test_compass_twice_is_the_identity() -> None:
    positions = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_array_equal(compass(compass(positions)), positions)
    assert not np.array_equal(compass(positions), positions)


def test_circle_has_element_1_at_0_degrees_and_the_next_in_the_sense_of_its_directions() -> None:
    keys = {"kind": "uca", "n_sensors": 4, "radius": 1.0}
    for clockwise in (False, True):
        array = from_description({**keys, "clockwise": clockwise})
        at_element = [array.steering_vector(k * np.pi / 2, 8.0)[k] for k in range(4)]
        np.testing.assert_allclose(at_element, np.exp(2j * np.pi / 8), atol=1e-12)


def test_latitude_and_longitude_are_east_and_north() -> None:
    keys = {
        "kind": "positions",
        "latitude": [60.0, 60.001, 60.0],
        "longitude": [25.0, 25.0, 25.002],
    }
    east_north = from_description(keys).positions
    np.testing.assert_allclose(east_north[1] - east_north[0], [0, 111.42], atol=0.01)
    np.testing.assert_allclose(east_north[2] - east_north[0], [111.6, 0], atol=0.1)
    north_east = from_description({**keys, "clockwise": True}).positions
    np.testing.assert_array_equal(north_east, east_north[:, ::-1])
    raised = from_description({**keys, "height": [100, 200, 300], "unit": "cm"})
    np.testing.assert_allclose(raised.positions, np.column_stack([east_north, [1, 2, 3]]))
    one_unit = from_description({**keys, "unit": "km"})
    np.testing.assert_array_equal(one_unit.positions, east_north)


@pytest.mark.parametrize("keys", [*KINDS, {"kind": "respeaker-usb-v2", "rotation": 20}])
def test_json_file_equals_toml_file(tmp_path: Path, keys: dict[str, Any]) -> None:
    keys = {**keys, "missing": [2], "speed": 340.0}
    one, other = tmp_path / "a.json", tmp_path / "a.toml"
    one.write_text(json.dumps(keys))
    other.write_text("\n".join(f"{key} = {json.dumps(value)}" for key, value in keys.items()))
    array = SensorArray.from_file(one)
    assert array == SensorArray.from_file(other) == from_description(keys)


def test_table_of_positions_is_an_array_file(tmp_path: Path) -> None:
    file = tmp_path / "mics.csv"
    file.write_text("x,y\n0,0\n1,0\n0,1\n")
    assert SensorArray.from_file(file) == SensorArray(np.array([[0, 0], [1, 0], [0, 1]]))
    assert SensorArray.from_file(str(file)) == SensorArray.from_csv(file)
    described = tmp_path / "array.toml"
    described.write_text('kind = "positions"\npositions = "mics.csv"\nunit = "cm"\nspeed = 340')
    array = SensorArray.from_file(described)
    assert array == SensorArray(0.01 * SensorArray.from_csv(file).positions, 340.0)
    described.write_text('kind = "positions"\npositions = "no.csv"')
    with pytest.raises(FileNotFoundError, match=r"no\.csv"):
        SensorArray.from_file(described)


GEO = {"kind": "positions", "latitude": [1.0, 2.0], "longitude": [3.0, 4.0]}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({**KINDS[0], "unit": "mile"}, "unit must be one of 'm', 'cm', .*; got 'mile'"),
        ({**KINDS[0], "unit": 3}, "unit must be one of 'm'"),
        ({**KINDS[0], "rotation": 30}, "rotation must be left out for a line, .*; got 30: reverse"),
        ({**KINDS[0], "clockwise": True}, "clockwise must be left out for a line"),
        ({**KINDS[1], "clockwise": "yes"}, "clockwise must be true or false; got 'yes'"),
        ({**KINDS[1], "rotation": "north"}, "rotation must be a number; got 'north'"),
        ({"kind": "positions", "lat": [1.0]}, "no key 'lat': did you mean latitude?"),
        ({"kind": "kraken-5", "radius": 1, "clockwise": False}, "clockwise must be true for 'krak"),
        ({**KINDS[1], "roation": 3}, "kind 'uca' has no key 'roation': did you mean rotation?"),
        ({"kind": "uca", "n_sensors": 4, "raduis": 1}, "no key 'raduis': did you mean radius?"),
        ({"kind": "circle"}, "got 'circle': known: kinect-360, "),
        ({"kind": "ucaa"}, "got 'ucaa': did you mean uca"),
        ({"kind": "positions"}, "needs the key 'positions', or 'latitude' and 'longitude'"),
        ({**KINDS[0], "spacing": "wide", "unit": "cm"}, "spacing must hold numbers"),
        ({"kind": "positions", "latitude": [1, 2]}, "needs the key 'longitude'"),
        ({**GEO, "positions": [1]}, "has no key 'positions'"),
        ({**GEO, "longitude": [3]}, "must be lists of one length; got shapes"),
        ({**GEO, "height": [3]}, "latitude, longitude and height must be lists of one length"),
        ({**GEO, "latitude": [1, 91]}, "lat must lie within ±90 degrees; got 91"),
        ({**GEO, "latitude": [1, None]}, "latitude and longitude must be finite"),
        ({**KINDS[3], "height": [1, 2, 3]}, "has no key 'height'"),
    ],
)
def test_invalid_key_is_refused_with_its_cure(keys: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message) as caught:
        from_description(keys)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", b"[1, 2]", "a.json: the file must have keys, such as 'kind'; got"),
        ("a.json", b"{", "a.json: Expecting property name"),
        ("a.toml", b"kind = uca", "line 1, column 8.*'kind = uca': TOML has lines key = value, te"),
        ("a.toml", b"kind = 'uca'\nradius = 0,5", "line 2, .*'radius = 0,5': .* decimal points"),
        (
            "talk.wav",
            b"RIFF\0\0",
            "talk.wav: an array file must be text; got binary data: is it the rec",
        ),
    ],
)
def test_other_files_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message):
        SensorArray.from_file(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        SensorArray.from_file(tmp_path / "uma-8")  # a name in a folder is that of a file
