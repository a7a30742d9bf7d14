"""Array files and tables of positions."""

import copy
from pathlib import Path

import numpy as np
import pytest

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.description import from_description


def toml(path: Path, text: str) -> Path:
    file = path / "array.toml"
    file.write_text(text, encoding="utf-8")
    return file


GOOD = [
    ('kind = "ula"\nn_sensors = 3\nspacing = 0.5', SensorArray.ula(3, 0.5)),
    ('kind = "uca"\nn_sensors = 3\nradius = 2\nspeed = 340', SensorArray.uca(3, 2.0, speed=340.0)),
    ('kind = "symmetric"\ndistances = [1, 2.5]', SensorArray.symmetric([1.0, 2.5])),
    ('kind = "positions"\npositions = [0, 1, 3.5]', SensorArray(np.array([0.0, 1.0, 3.5]))),
    ('kind = "positions"\npositions = [[0, 1], [2, 3]]', SensorArray(np.array([[0, 1], [2, 3]]))),
    (
        'kind = "positions"\npositions = [[0, 1, 2], [2, 3, 4]]',
        SensorArray(np.array([[0, 1, 2], [2, 3, 4]])),
    ),
    (
        'kind = "ula"\nn_sensors = 64\nspacing = 1.875\nmissing = [43]\nspeed = 1488.0',
        SensorArray.ula(64, 1.875, missing=[42], speed=1488.0),
    ),
    (
        'kind = "ula"\nn_sensors = 3\nspacing = 1\nchannels = [3, 1, 2]',
        SensorArray(np.array([-1.0, 0.0, 1.0]), channels=[2, 0, 1]),
    ),
    (  # a channel for each element of the whole array, or one for each that works
        'kind = "ula"\nn_sensors = 3\nspacing = 1\nmissing = [1]\nchannels = [3, 1, 2]',
        SensorArray(np.array([0.0, 1.0]), channels=[0, 1]),
    ),
    (
        'kind = "ula"\nn_sensors = 3\nspacing = 1\nmissing = [1]\nchannels = [7, 5]',
        SensorArray(np.array([0.0, 1.0]), channels=[6, 4]),
    ),
]


@pytest.mark.parametrize(("text", "array"), GOOD)
def test_array_file(tmp_path: Path, text: str, array: SensorArray) -> None:
    assert SensorArray.from_toml(toml(tmp_path, text)) == array


LINE = 'kind = "ula"\nn_sensors = 3\nspacing = 0.5\n'
BAD = [
    ("n_sensors = 3", "the key 'kind' is missing; it is one of ula, uca, symmetric, positions"),
    ('kind = "ulla"', "kind must be one of ula, .*; got 'ulla'"),
    ("kind = [1]", r"kind must be one of ula, .*; got \[1\]"),
    ('kind = "ula"\nn_sensors = 3', "kind 'ula' needs the key 'spacing'"),
    ('kind = "ula"\nspacing = 3', "kind 'ula' needs the key 'n_sensors'"),
    ('kind = "uca"\nn_sensors = 3', "kind 'uca' needs the key 'radius'"),
    ('kind = "symmetric"', "kind 'symmetric' needs the key 'distances'"),
    ('kind = "positions"', "kind 'positions' needs the key 'positions'"),
    (LINE + "radius = 1", "kind 'ula' has no key 'radius'"),
    (LINE + "sped = 1", "kind 'ula' has no key 'sped'"),
    (LINE + "speed = -1", "speed must be finite and positive; got -1"),
    (LINE + 'speed = "fast"', "speed must be a number; got 'fast'"),
    (LINE + "missing = 2", "missing must be a list of numbers; got 2"),
    (LINE + "missing = [0]", "missing must be at least 1; got 0"),
    (LINE + "missing = [4]", "missing names element 4 of 3"),
    (LINE + "missing = [1, 2, 3]", "must leave at least one"),
    (LINE + "channels = 2", "channels must be a list of numbers; got 2"),
    (LINE + "channels = [0, 1, 2]", "channels must be at least 1; got 0"),
    (LINE + "channels = [1, 2, 2]", r"channels must differ from each other; got \[1, 2, 2\]"),
    (LINE + "channels = [1, 2]", "channels must name one channel for each of the 3 sensors; got 2"),
    ('kind = "ula"\nn_sensors = 2.5\nspacing = 1', "n_sensors must be a whole number; got 2.5"),
    ('kind = "ula"\nn_sensors = 3\nspacing = "wide"', "spacing must be a number; got 'wide'"),
    ('kind = "symmetric"\ndistances = "far"', "distances must hold real numbers"),
    (
        'kind = "positions"\npositions = [[0, 1], [0, 1]]',
        r"share the position \(0, 1\) m: numbers 1 and 2 of 2",
    ),
    ('kind = "positions"\npositions = [[0, 1], [0]]', "positions must have rows of one length"),
    ('kind = "positions"\npositions = ["a"]', "positions must hold numbers"),
    ('kind = "positions"\npositions = [0, inf]', "positions must be finite; sensor 1"),
    ('kind = "positions"\npositions = []', "positions must have shape"),
    ('kind = "ula"\nn_sensors = 1000000000\nspacing = 1', "n_sensors must be at most 100000; got"),
    ('kind = "positions"\npositions = [0, 1' + "0" * 400 + "]", "positions must be finite"),
    ('kind = "ula"\nx = ' + "[" * 5000, "nested too deeply"),
    ("kind = ula", "Invalid value"),
    ("kind = \"ula\"\nkind = 'ula'", "Cannot overwrite a value"),
]


@pytest.mark.parametrize(("text", "message"), BAD)
def test_bad_array_file_says_what_is_wrong_and_where(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ValueError, match=f"array.toml: .*{message}") as caught:
        SensorArray.from_toml(toml(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_file_that_is_not_text_or_not_there(tmp_path: Path) -> None:
    file = tmp_path / "array.toml"
    file.write_bytes(b"\xff\xfe\x00")
    for read in (SensorArray.from_toml, SensorArray.from_csv):
        with pytest.raises(ValueError, match=r"array\.toml: "):
            read(file)
        with pytest.raises(FileNotFoundError):
            read(tmp_path / "no.toml")


def test_array_file_of_windows_is_read(tmp_path: Path) -> None:
    file = tmp_path / "array.toml"
    text = 'kind = "ula"\r\nn_sensors = 3\r\nspacing = 0.5\r\n'
    file.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert SensorArray.from_toml(file) == SensorArray.ula(3, 0.5)


def test_array_file_must_be_a_regular_file(tmp_path: Path) -> None:
    for read in (SensorArray.from_toml, SensorArray.from_csv):
        with pytest.raises(OSError, match="not a regular file"):
            read(tmp_path)


def test_description_is_not_modified() -> None:
    description = {"kind": "ula", "n_sensors": 3, "spacing": 0.1, "missing": [2]}
    kept = copy.deepcopy(description)
    from_description(description)
    assert description == kept


def csv(path: Path, content: bytes) -> Path:
    file = path / "places.csv"
    file.write_bytes(content)
    return file


@pytest.mark.parametrize(
    ("content", "positions"),
    [
        (b"0\n1.5\n3\n", [[0.0], [1.5], [3.0]]),
        (b"x,y\r\n0,1\r\n\r\n2,3\r\n", [[0.0, 1.0], [2.0, 3.0]]),
        (b"0, 1, 2\n3, 4, 5", [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]),
        (b"\xef\xbb\xbf0\n1\n", [[0.0], [1.0]]),  # a mark that spreadsheets put in front
        (b"x;y\r\n0;1,5\r\n2,25;3\r\n", [[0.0, 1.5], [2.25, 3.0]]),
        (b'"x"\t"y"\n# metres\n0\t"1"\n', [[0.0, 1.0]]),
        ("x,y\n0,1\n".encode("utf-16"), [[0.0, 1.0]]),
        (b"mic,y [m],x [m]\n1,0.5,2\nb,3,4\n", [[2.0, 0.5], [4.0, 3.0]]),
    ],
)
def test_positions_from_a_table(
    tmp_path: Path, content: bytes, positions: list[list[float]]
) -> None:
    array = SensorArray.from_csv(csv(tmp_path, content), speed=340.0)
    assert array == SensorArray(np.array(positions), speed=340.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "has no positions"),
        (b"x,y\n", "has no positions"),
        (b"name,lat,lon\na,1,2\n", r"must have x, y, z; got .*: latitudes and longitudes are keys"),
        (b"x_cm,y_cm\n1,2\n", "must be in metres; got 'x_cm': name the column x, and write"),
        (b"mic,x\n1\n", r"line 2 must have 1 numbers; got \['1'\]"),
        (b"0,1\n2\n", r"line 2 must have 2 numbers; got \['2'\]"),
        (b"0,1\n2,b\n", "line 2 must have 2 numbers"),
        (b"0,1\n0,1\n", "numbers 1 and 2 of"),
        (b"0,1\n0,nan\n", "must be finite"),
        (b"1,2,3,4\n", "dim 1, 2 or 3"),
    ],
)
def test_bad_table_says_what_is_wrong_and_where(
    tmp_path: Path, content: bytes, message: str
) -> None:
    with pytest.raises(ValueError, match=f"places.csv: .*{message}"):
        SensorArray.from_csv(csv(tmp_path, content))
