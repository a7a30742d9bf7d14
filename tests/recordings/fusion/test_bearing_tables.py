"""Tables of ready-made bearings: columns, senses, deviations, stations, times, and errors."""

from pathlib import Path

import numpy as np
import pytest

from arrivals.recordings.fusion import BearingTable, StationPlan, read_bearings, read_stations

PLANS = read_stations(
    {
        "station": [
            {"name": "Mast", "x_m": 0, "y_m": 0, "heading_deg": 30},
            {"name": "roof", "x_m": 9, "y_m": 0, "bearings": "compass"},
        ]
    }
).plans


def table_of(folder: Path, text: str, name: str = "b.csv") -> BearingTable:
    path = folder / name
    path.write_text(text)
    return read_bearings(path, PLANS)


def test_bearings_are_azimuths_on_the_map_with_variances(tmp_path: Path) -> None:
    table = table_of(
        tmp_path, "time_s,station,bearing_deg,std_deg\n2,roof,0,2\n1,Mast,15,1\n1,Mast,-60,\n"
    )
    np.testing.assert_allclose(table.time, [1, 1, 2])
    np.testing.assert_array_equal(table.station, [0, 0, 1])
    np.testing.assert_allclose(np.rad2deg(table.azimuth), [45, -30, 90])
    np.testing.assert_allclose(np.rad2deg(np.sqrt(table.variance)), [1, 3, 2])
    assert table.understood == (
        "time 'time_s'", "bearing 'bearing_deg'", "1 without a deviation: 3 degrees"
    )  # fmt: skip


@pytest.mark.parametrize(
    "text",
    [
        "Timestamp,Station ID,DOA,Confidence\n1,mast,15,9\n",
        "time (ms);name;Azimuth [deg]\n1000;Mast;15,0\n",
        "time_s\tstation\tbearing_rad\n1\tMAST\t0.2617993878\n",
        "t,node,angle,uncertainty\n1,Mast,375,3\n",
    ],
)
def test_usual_names_of_columns_are_understood(tmp_path: Path, text: str) -> None:
    table = table_of(tmp_path, text)
    assert table.time.tolist() == [1.0]
    assert np.rad2deg(table.azimuth) == pytest.approx([45], abs=1e-6)
    assert np.rad2deg(np.sqrt(table.variance)) == pytest.approx([3])


def test_table_without_deviations_has_3_degrees_and_says_so(tmp_path: Path) -> None:
    table = table_of(tmp_path, "time_s,station,bearing_deg\n1,roof,15\n")
    assert "no deviations: 3 degrees assumed" in table.understood


def test_row_without_a_bearing_is_a_station_that_received_nothing(tmp_path: Path) -> None:
    table = table_of(tmp_path, "time_s,station,bearing_deg\n1,roof,\n1,Mast,10\n")
    np.testing.assert_array_equal(np.isnan(table.azimuth), [False, True])


def test_kraken_log_is_read_without_a_header(tmp_path: Path) -> None:
    row = "{time}, {angle}, 40.5, -12.3, 433920000, UCA, 100, roof, 60.1, 24.9, 0, 0, GPS"
    spectrum = ", ".join(["R"] * 4 + ["0.5"] * 360)
    rows = [row.format(time=1777636800000 + 250 * k, angle=90 + k) for k in range(3)]
    table = table_of(tmp_path, "\n".join(f"{each}, {spectrum}" for each in rows))
    assert table.start == 1777636800
    np.testing.assert_allclose(table.time, [0, 0.25, 0.5])
    np.testing.assert_allclose(np.rad2deg(table.azimuth), [0, -1, -2], atol=1e-9)
    np.testing.assert_array_equal(table.station, 1)


def test_several_tables_with_dates_have_one_clock_and_the_stations_of_their_names(
    tmp_path: Path,
) -> None:
    (tmp_path / "mast.csv").write_text("time,bearing\n2026-05-01T12:00:02Z,0\n")
    (tmp_path / "ROOF.csv").write_text("time,bearing\n2026-05-01T12:00:00.5Z,0\n")
    table = read_bearings([tmp_path / "mast.csv", tmp_path / "ROOF.csv"], PLANS)
    np.testing.assert_allclose(table.time, [0.5, 2])
    np.testing.assert_array_equal(table.station, [1, 0])
    (tmp_path / "mast.csv").write_text("time,bearing\n2,0\n")
    with pytest.raises(ValueError, match="dates in all tables, or in none"):
        read_bearings([tmp_path / "mast.csv", tmp_path / "ROOF.csv"], PLANS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,station,bearing_deg\n1,rof,3\n",
         "line 2: no station has the name 'rof': did you mean roof?"),
        ("time_s,station,bearing_deg\n1,x,3\n", "'x': the stations are Mast, roof"),
        ("time_s,bearing_deg\n1,3\n", "the column 'station' is missing, and the file has the name"),
        ("time_s,station,course\n1,roof,3\n", "the column 'bearing_deg' is missing: found time_s,"),
        ("when,station,bearing\n1,roof,3\n", "the column 'time_s' is missing"),
        ("time_s,station,bearing\n1,roof,north\n", "line 2: 'north' is not a number"),
        ("time_s,station,bearing,std\n1,roof,3,0\n", "line 2: a deviation must be positive and at"),
        ("time_s,station,bearing,std\n1,roof,3,90\n", "at most 57.3 degrees; got 90"),
        ("time_s,station,bearing\n,roof,3\n", "line 2: the time is missing"),
        ("time_s,station,bearing\n", "there is no row below the header"),
        ("1777636800000, 90, 1, 1, 1, UCA, 1, roof, 1, 1, 1, 1, G\n1777636800001, 3\n",
         "line 2 must have 13 cells or more"),
    ],
)  # fmt: skip
def test_bearings_error_is_one_line_with_the_name_of_the_file(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message) as error:
        table_of(tmp_path, text)
    assert str(error.value).startswith(f"{tmp_path / 'b.csv'}: ")
    assert "\n" not in str(error.value)


def test_bearings_of_a_station_without_a_heading_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "b.csv"
    path.write_text("time_s,station,bearing_deg\n1,hut,3\n")
    with pytest.raises(ValueError, match="station 'hut' requires heading_deg"):
        read_bearings(path, [StationPlan("hut", np.zeros(2), None)])
    table = read_bearings(path, [StationPlan("hut", np.zeros(2), 0.0)])
    path.write_text("time_s,bearing_deg\n1,3\n")
    only = read_bearings(path, [StationPlan("hut", np.zeros(2), 0.0)])
    assert only.azimuth == table.azimuth  # one station needs no column
