"""Tests of tables of readings: forms, names of columns, times, windows, sensors."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reading_tables import NAMES, PLACES, iso, sensors, text, walk, wide

from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.recordings.networks import Network, read_network, read_sensors
from arrivals.recordings.networks.columns import ALIASES, roles
from arrivals.recordings.networks.steps import SingleReadings, as_network, scattered_window
from arrivals.recordings.networks.times import iso_text, parsed

ROWS = walk(6)
LONG = ("time_s", "sensor", "rss_db")


def read(folder: Path, table: str, places: Path | None = None) -> Network:
    path = folder / "readings.csv"
    path.write_text(table, encoding="latin-1")
    return read_network(path, sensors(folder) if places is None else places)


def assert_same(one: Network, other: Network) -> None:
    assert one.name == other.name
    for part in ("time", "rss_db", "sensors"):
        np.testing.assert_array_equal(getattr(one, part), getattr(other, part))


def test_windows_do_not_depend_on_duplicates() -> None:
    rng = np.random.default_rng(0)
    time, sensor = np.sort(rng.uniform(0, 60, 300)), rng.integers(0, len(NAMES), 300)
    once = SingleReadings(time, sensor, -time, NAMES, PLACES)
    twice = once.select(np.repeat(np.arange(300), 2))
    assert scattered_window(twice, 1.5) == scattered_window(once, 1.5) == 2.0


def test_one_row_a_reading_is_the_same_network_as_one_row_a_step(tmp_path: Path) -> None:
    assert_same(read(tmp_path, text(LONG, ROWS)), read(tmp_path, wide(ROWS)))


@settings(max_examples=20, deadline=None)
@given(st.permutations(ROWS))
def test_order_of_rows_does_not_matter(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, str, float]]
) -> None:
    folder = tmp_path_factory.mktemp("order")
    assert_same(read(folder, text(LONG, rows)), read(folder, text(LONG, ROWS)))
    assert_same(read(folder, wide(rows)), read(folder, wide(ROWS)))


@pytest.mark.parametrize(
    "header",
    [
        ("timestamp", "BSSID", "dBm"),
        ("Time (s)", "AP", "RSSI [dBm]"),
        ("t", "receiver", "Signal_dBm"),
        ("epoch", "Gateway ID", "signal level"),
        ("FirstSeen", "MAC", "rssi"),
    ],
)
def test_names_of_columns_are_recognised(tmp_path: Path, header: tuple[str, str, str]) -> None:
    assert_same(read(tmp_path, text(header, ROWS)), read(tmp_path, text(LONG, ROWS)))


@given(st.data())
def test_names_of_columns_ignore_case_and_punctuation(data: st.DataObject) -> None:
    role = data.draw(st.sampled_from(sorted(ALIASES)))
    name = data.draw(st.sampled_from(sorted(ALIASES[role])))
    marks = data.draw(st.lists(st.sampled_from(["", " ", "_", "-"]), min_size=len(name),
                               max_size=len(name)))  # fmt: skip
    written = "".join(
        (letter.upper() if data.draw(st.booleans()) and letter.isascii() else letter) + mark
        for letter, mark in zip(name, marks, strict=True)
    )
    found = roles([written], (role,))
    assert found[role].name == written
    assert found[role].scale == ALIASES[role][name]


@pytest.mark.parametrize(
    "written",
    [
        iso,
        lambda time: iso(time).replace("+00:00", "Z"),
        lambda time: iso(time + 7200).replace("T", " ").replace("+00:00", "+02:00"),
        lambda time: iso(time).replace("+00:00", ""),
        lambda time: f"{1777636800 + time:.3f}",
        lambda time: f"{1777636800000 + 1000 * time:.0f}",
    ],
)
def test_dates_are_the_same_network_as_seconds(tmp_path: Path, written: Any) -> None:
    rows = [(written(time), *others) for time, *others in ROWS]
    dated = read(tmp_path, text(LONG, rows))
    assert dated.start == 1777636800.0
    assert_same(replace(dated, start=None), read(tmp_path, text(LONG, ROWS)))


@given(st.integers(0, 4102444800000))
def test_date_of_a_time_is_a_round_trip(milliseconds: int) -> None:
    written = iso_text(milliseconds / 1000)
    time, start = parsed([written], [2], 1.0)
    assert start is not None
    assert round(1000 * (start + time[0])) == milliseconds


def test_date_and_time_may_be_two_columns(tmp_path: Path) -> None:
    rows = [(iso(time)[:10], iso(time)[11:23], *others) for time, *others in ROWS]
    network = read(tmp_path, text(("Date", "Time", "AP", "RSSI"), rows))
    assert_same(network, read(tmp_path, text(LONG, ROWS)))


def test_units_of_times_are_part_of_the_name(tmp_path: Path) -> None:
    rows = [(1000 * time, *others) for time, *others in ROWS]
    network = read(tmp_path, text(("time_ms", "sensor", "rssi"), rows))
    assert_same(network, read(tmp_path, text(LONG, ROWS)))


def test_readings_of_one_sensor_at_one_time_are_averaged(tmp_path: Path) -> None:
    rows = [(0, NAMES[0], -60), (0, NAMES[0], -70), (1, NAMES[1], -50)]
    levels = read(tmp_path, text(LONG, rows)).rss_db
    np.testing.assert_array_equal(levels[:, :2], [[-65, np.nan], [np.nan, -50]])


def test_sensors_outside_the_table_are_left_out_with_a_warning(tmp_path: Path) -> None:
    rows = [*ROWS, (0, "other", -30), (1, "other", -30), (1, "another", -30)]
    with pytest.warns(UserWarning, match=r"3 readings are left out, .* \(2\): 'other', 'another'"):
        network = read(tmp_path, text(LONG, rows))
    assert_same(network, read(tmp_path, text(LONG, ROWS)))


def test_addresses_of_other_case_and_separator_are_the_same_sensor(tmp_path: Path) -> None:
    rows = [(time, name.lower().replace(":", "-"), level) for time, name, level in ROWS]
    assert_same(read(tmp_path, text(LONG, rows)), read(tmp_path, text(LONG, ROWS)))


def test_sensors_by_latitude_and_longitude_have_a_plane(tmp_path: Path) -> None:
    plane = LocalPlane(60.17, 24.94)
    lat, lon = plane.to_lat_lon(*PLACES.T)
    places = tmp_path / "places.csv"
    rows = [(name, f"{a:.9f}", f"{b:.9f}") for name, a, b in zip(NAMES, lat, lon, strict=True)]
    places.write_text(text(("BSSID", "Latitude", "lng"), rows))
    network = read(tmp_path, text(LONG, ROWS), places)
    assert network.plane is not None
    back = plane.to_xy(*network.plane.to_lat_lon(*network.sensors[0].T))
    np.testing.assert_allclose(np.stack(back, axis=-1), PLACES, atol=2e-4)  # 1e-9 degrees


def test_units_of_positions_are_part_of_the_name(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    path.write_text("id,x (cm),y_km\na,150,0.02\n")
    np.testing.assert_allclose(read_sensors(path)[1], [[1.5, 20.0]])


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("time|sensor|rssi\n0|a|-60\n", "separate cells by commas"),
        (
            "foo,bar\n1,2\n",
            "columns foo, bar are neither sensors nor understood: .* level .rssi,",
        ),
        ("", "there is no row below the header"),
        (f"time,sensor,rssi\nsoon,{NAMES[0]},-60\n", "line 2: the time 'soon' is not understood"),
        (f"time,sensor,rssi\n0,{NAMES[0]},-60\nlater,{NAMES[0]},-60\n", "line 3: the time 'later'"),
        (f"time,sensor,rssi\n{iso(0)},{NAMES[0]},-60\n7,{NAMES[0]},-60\n", "line 3: the time '7'"),
        (f"time,sensor,rssi\n,{NAMES[0]},-60\n", "line 2: the time is missing"),
        ("time,sensor,rssi\n0,x,-60\n", "no sensor of the column 'sensor' is in the table"),
        (f"time,sensor,rssi\n0,{NAMES[0]},NA\n", "rss_db must have a valid reading"),
        (f"time,device,sensor,rssi\n0,p,{NAMES[0]},-6\n0,q,{NAMES[0]},-6\n", "has 2 devices"),
        ("Network;BSSID;GPSBestLat\n1;a;60\n", "networks of Kismet .* pass the .kismet database"),
        ("SQLite format 3\0 and no more", "not a complete log of Kismet"),
        ("<?xml version='1.0'?><gps-run>", "not complete XML"),
        ("PK\3\4 of a spreadsheet", "save it as CSV"),
        ("\x1f\x8b of gzip", "not a complete gzip file"),
        (f"time,sensor,rssi\n1e30,{NAMES[0]},-60\n", "line 2: the time '1e30'"),
        ("<gps-run></gps-run>", "no readings with a level and a position"),
    ],
)
def test_tables_that_are_not_understood_raise_one_line(
    tmp_path: Path, table: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message) as error:
        read(tmp_path, table)
    assert str(error.value).startswith(f"{tmp_path / 'readings.csv'}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("name,lat,lon,x_m,y_m\na,60,24,1,2\n", "must be x_m, y_m or lat, lon; got both"),
        ("name,lat,lon\na,124,60\n", "line 2: a latitude must lie within ±90 degrees; got 124"),
        ("name,lat,lon\na,60,24\nb,0,0\n", "within 1000 km .* without a fix"),
        ("name,lat\na,60\n", "the column 'lon' is missing: found name, lat"),
        ("x_m,y_m\n1,2\n", "the column 'name' is missing: found x_m, y_m"),
    ],
)
def test_sensors_that_are_not_of_one_place_raise_one_line(
    tmp_path: Path, table: str, message: str
) -> None:
    path = tmp_path / "s.csv"
    path.write_text(table)
    with pytest.raises(ValueError, match=message) as error:
        read_sensors(path)
    assert str(error.value).startswith(f"{path}: ")


# steps


def single(time: Any, n_sensors: int = 4) -> SingleReadings:
    time = np.asarray(time, dtype=np.float64)
    readings = SingleReadings(time, np.arange(len(time)) % n_sensors, -time,
                              tuple("abcd"[:n_sensors]), 50.0 * np.eye(n_sensors, 2))  # fmt: skip
    return readings.select(slice(None))


@given(st.integers(0, 1000))
def test_jitter_within_a_step_has_the_steps_of_common_times(seed: int) -> None:
    rng = np.random.default_rng(seed)
    common = np.repeat(np.arange(30.0), 4)
    scattered = single(common + rng.uniform(0, 0.9, len(common)))
    assert scattered_window(single(common), 1.5) is None
    assert scattered_window(scattered, 1.5) == 1.0
    network = as_network(scattered, 1.0)
    assert len(network) == 30
    assert np.isfinite(network.rss_db).all()
    assert (np.floor(network.time) == np.arange(30)).all()


def test_window_is_no_longer_than_the_time_of_a_source_between_sensors() -> None:
    readings = single(100.0 * np.arange(40) + np.tile([0.0, 3.0, 5.0, 9.0], 10))
    assert scattered_window(readings, 1e-3) == 500.0
    assert scattered_window(readings, 5.0) is None  # a window of 2 s would hold one reading


def test_time_on_the_edge_of_a_window_is_in_the_later_one() -> None:
    assert len(as_network(single(0.1 * np.arange(12)), 0.1)) == 12
