"""Stations files: places, headings, senses of arrays, options, and errors."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from station_scenes import HEADINGS, PLACES, stations_file

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.arrays import from_description
from arrivals.recordings.fusion import read_stations
from arrivals.recordings.fusion.oriented_arrays import station_array
from arrivals.recordings.fusion.station_options import merged, track_options

MAST = 'name = "mast"\nx_m = 0\ny_m = 0\nheading_deg = 10'
ROOF = 'name = "roof"\nx_m = 50\ny_m = 0\nheading_deg = 10'
CIRCLE = {"kind": "uca", "n_sensors": 5, "radius": 0.3, "speed": 343.0}


def written(folder: Path, text: str) -> Path:
    path = folder / "stations.toml"
    path.write_text(text)
    return path


def two(root: str = "", mast: str = "", roof: str = "") -> str:
    return f"{root}\n[[station]]\n{MAST}\n{mast}\n[[station]]\n{ROOF}\n{roof}\n"


def keys(**more: Any) -> dict[str, Any]:
    return {"name": "mast", "x_m": 3.0, "y_m": 4.0} | more


def test_stations_file_has_places_headings_and_files(tmp_path: Path) -> None:
    contents = read_stations(stations_file(tmp_path, head="area = [0, 0, 40, 40]\nspeed = 1.5"))
    assert [plan.name for plan in contents.plans] == list(PLACES)
    np.testing.assert_array_equal([plan.position for plan in contents.plans], [*PLACES.values()])
    headings = [np.rad2deg(plan.heading or 0.0) for plan in contents.plans]
    np.testing.assert_allclose(headings, [*HEADINGS.values()])
    assert contents.area == (0, 0, 40, 40)
    assert contents.motion == {"speed": 1.5}
    assert set(contents.files) == {
        str(tmp_path / name) for name in ("stations.toml", "array.toml", "mast.wav", "roof.wav",
                                          "gate.wav")
    }  # fmt: skip


def test_station_option_beats_that_of_the_root_and_frequencies_replace_a_band(
    tmp_path: Path,
) -> None:
    root = "window = 256\nband = [500, 900]\nheading_std_deg = 2"
    text = two(root, "frequencies = [600, 700]", 'bearings = "compass"\nheading_std_deg = 0.5')
    mast, roof = read_stations(written(tmp_path, text)).plans
    assert track_options(mast.options).frequencies == (600.0, 700.0)
    assert track_options(mast.options).band is None
    assert track_options(roof.options).band == [500, 900]
    assert mast.options["window"] == roof.options["window"] == 256
    assert roof.station().heading_std == pytest.approx(np.deg2rad(0.5))
    assert mast.station().heading_std == pytest.approx(np.deg2rad(2))
    assert roof.is_compass
    assert not mast.is_compass


def test_settings_of_trackers_are_merged_by_name() -> None:
    levels: list[dict[str, Any]] = [
        {"settings": {"a": 1, "b": 2}}, {"hop": 3}, {"settings": {"b": 5}}
    ]  # fmt: skip
    assert merged(*levels) == {"settings": {"a": 1, "b": 5}, "hop": 3}


@given(st.floats(-360, 360), st.floats(-180, 180))
def test_compass_heading_and_heading_are_the_same_direction(degrees: float, bearing: float) -> None:
    given_east = {"station": [keys(heading_deg=90 - degrees)]}
    given_north = {"station": [keys(heading_compass_deg=degrees)]}
    if abs(90 - degrees) > 360:
        return
    east, north = (read_stations(each).plans[0] for each in (given_east, given_north))
    b = np.deg2rad(bearing)
    assert np.exp(1j * east.azimuth(b)) == pytest.approx(np.exp(1j * north.azimuth(b)), abs=1e-9)


@given(st.floats(-180, 180), st.floats(0, 360))
def test_compass_bearing_points_east_at_90_whatever_the_heading(
    heading: float, bearing: float
) -> None:
    table = keys(heading_deg=heading, bearings="compass")
    azimuth = read_stations({"station": [table]}).plans[0].azimuth(np.deg2rad(bearing))
    direction = np.array([np.sin(np.deg2rad(bearing)), np.cos(np.deg2rad(bearing))])
    np.testing.assert_allclose([np.cos(azimuth), np.sin(azimuth)], direction, atol=1e-9)


def test_latitudes_and_longitudes_are_metres_east_and_north_of_their_mean() -> None:
    corners = {"a": (60.0, 25.0), "b": (60.01, 25.0), "c": (60.0, 25.02)}
    tables = [{"name": name, "lat_deg": lat, "lon_deg": lon, "bearings": "compass"}
              for name, (lat, lon) in corners.items()]  # fmt: skip
    contents = read_stations({"station": tables})
    a, b, c = (plan.position for plan in contents.plans)
    # radii of curvature of WGS 84 at 60 degrees
    np.testing.assert_allclose(b - a, [0, 111412.3 / 100], atol=0.3)
    np.testing.assert_allclose(c - a, [55799.98 / 50, 0], atol=0.3)
    assert contents.plane is not None
    np.testing.assert_allclose(contents.plane.to_lat_lon(*b), corners["b"], atol=1e-9)


@given(st.floats(-3.1, 3.1), st.floats(-180, 180))
def test_clockwise_array_is_mirrored_so_that_directions_are_anticlockwise(
    doa: float, rotation: float
) -> None:
    clockwise = {**CIRCLE, "clockwise": True, "rotation": rotation}
    given_array, mirrored = from_description(clockwise), station_array(clockwise, Path())
    np.testing.assert_allclose(
        mirrored.steering_vector(-doa, 0.7), given_array.steering_vector(doa, 0.7), atol=1e-9
    )


def test_clockwise_preset_and_files_are_mirrored(tmp_path: Path) -> None:
    (tmp_path / "kraken.toml").write_text('kind = "kraken-5"\nradius = 0.3\n')
    (tmp_path / "points.json").write_text(
        '{"kind": "positions", "positions": [[0, 0], [1, 0], [0, 2]], "clockwise": true}'
    )
    (tmp_path / "table.csv").write_text("x,y\n0,0\n1,0\n0,2\n")
    kraken = station_array("kraken.toml", tmp_path)
    second = np.rad2deg(np.arctan2(*kraken.positions[1][::-1]))
    assert second == pytest.approx(-72)  # elements follow clockwise
    points = station_array("points.json", tmp_path)
    np.testing.assert_allclose(points.positions, [[0, 0], [0, -1], [2, 0]])  # north, west
    np.testing.assert_allclose(station_array("table.csv", tmp_path).positions[2], [0, 2])
    inline = {"kind": "positions", "positions": "table.csv", "speed": 343.0}
    np.testing.assert_allclose(station_array(inline, tmp_path).positions[1], [1, 0])
    assert station_array("respeaker-4mic", tmp_path).n_sensors == 4
    line = SensorArray.ula(3, 0.1)
    assert station_array(line, tmp_path) is line
    row = {"kind": "ula", "n_sensors": 3, "spacing": 0.1}
    assert station_array(row, tmp_path).dim == 1


def test_station_has_the_azimuths_of_its_array(tmp_path: Path) -> None:
    plan = read_stations(stations_file(tmp_path)).plans[0]
    assert plan.array is not None
    station = plan.station(ArraySnapshot(plan.array, wavelength=0.5))
    assert np.rad2deg(station.to_map(0.5))[0] == pytest.approx(HEADINGS["mast"] + np.rad2deg(0.5))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (two("frequenzy = 400"), "a stations file has no key 'frequenzy': did you mean frequency"),
        (two(mast="heding_std_deg = 1"),
         "station 'mast': a station has no key 'heding_std_deg': did you mean heading_std_deg?"),
        (two(roof="[rss]\nsensor = 's.csv'"), r"\[rss\] has no key 'sensor': did you mean sensors"),
        (two(roof="y_m = 3").replace("y_m = 0", "x_m = 1", 1), "Cannot overwrite a value"),
        (two().replace("y_m = 0\n", "", 1), "station 'mast' requires the key 'y_m'"),
        (two(mast="lat_deg = 60"), "station 'mast' must have x_m, y_m or lat_deg, lon_deg; got b"),
        (two().replace("x_m = 0\ny_m", "lat_deg = 60\nlon_deg", 1),
         "positions must all be x_m, y_m or all be lat_deg, lon_deg; got 'roof' by the first and"),
        (two().replace("x_m = 50", "x_m = 0"),
         r"stations must be at different places; got 'mast' and 'roof' at \(0, 0\) m"),
        (two().replace("roof", "mast"), "names of stations must differ; got 'mast' twice"),
        (two().replace("roof", "a+b"), r"station 'a\+b': name must be a text without \+"),
        (two(roof='x_mm = "far"'), "station 'roof': a station has no key 'x_mm'"),
        (two().replace("x_m = 50", "x_m = nan"), "station 'roof': x_m must be finite; got nan"),
        (two(mast="heading_compass_deg = 3"), "station 'mast': only one of heading_deg and"),
        (two().replace("heading_deg = 10", "heading_deg = 400", 1), "within ±360 degrees; got 400"),
        (two(mast='bearings = "north"'),
         "station 'mast': bearings must be one of 'anticlockwise', 'compass'; got 'north'"),
        (two(mast="frequency = 3\nband = [1, 2]"), "station 'mast': only one of frequency"),
        (two("window = 2.5"), "window must be a whole number; got 2.5"),
        (two("area = [0, 0, -1, 1]"), "area must be x0, y0, x1, y1 with x0 < x1"),
        (two("speed = 0"), "speed must be finite and positive; got 0"),
        (two(mast='start_s = "noon"'), "station 'mast': start_s must be a number; got 'noon'"),
        (two(mast="start_s = inf"), "station 'mast': start_s must be finite; got inf"),
        (two(mast="recording = [1]"), "station 'mast': recording must be a str; got 1, an int"),
        (two(mast='array = "kraken5"'), "station 'mast': array must be a file or a preset"),
        (two(mast='array = {kind = "uca", n_sensors = 3}'), "station 'mast': an array of kind"),
        ("station = 3", "a stations file must have tables"),
        ("", "a stations file must have tables"),
        ("station = [3]", "station must be a table"),
        (two("rss = 3"), r"rss must be a table \[rss\]; got 3"),
        ("[[station]\n", "stations.toml: "),
        (two("alpha = -1"), "alpha must be finite and positive; got -1"),
    ],
)  # fmt: skip
def test_stations_file_error_is_one_line_with_the_name_of_the_file(
    tmp_path: Path, text: str, message: str
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ValueError, match=message) as error:
        read_stations(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_stations_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "stations.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="a stations file must be text in UTF-8"):
        read_stations(path)
    with pytest.raises(TypeError, match="stations must be a stations file or its keys; got 3"):
        read_stations(3)  # type: ignore[arg-type]
    with pytest.raises(FileNotFoundError):
        read_stations(tmp_path / "none.toml")


def test_station_without_heading_is_refused_only_where_it_is_required() -> None:
    compass, turned = keys(bearings="compass"), keys()
    assert read_stations({"station": [compass]}).plans[0].station().heading == 0
    plan = read_stations({"station": [turned]}).plans[0]
    with pytest.raises(ValueError, match="'mast' requires heading_deg or heading_compass_deg: its"):
        plan.station()
    with pytest.raises(ValueError, match="its array is relative to the heading"):
        read_stations({"station": [compass]}).plans[0].station(
            ArraySnapshot(SensorArray.uca(4, 0.1), wavelength=1.0)
        )
