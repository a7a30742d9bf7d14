"""Arrays of named stations, from tables and StationXML."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.measurement_models.arrays.stations import StationArray
from arrivals.recordings import Recording

PLACES = {"AA": (0.0, 0.0), "BB": (2500.0, 100.0), "CC": (-300.0, 1800.0)}
LAT_LON = {"AA": (62.5, -114.6), "BB": (62.51, -114.55), "CC": (62.48, -114.58)}
TABLE = "name,x_m,y_m\n" + "".join(f"{name},{x},{y}\n" for name, (x, y) in PLACES.items())


def array_file(folder: Path, content: str, name: str = "stations.csv", more: str = "") -> Path:
    (folder / name).write_text(content)
    path = folder / "array.toml"
    path.write_text(f'kind = "stations"\nstations = "{name}"\nspeed = 6000.0\n{more}')
    return path


def station_xml(places: dict[str, tuple[float, float]]) -> str:
    stations = "".join(
        f'<Station code="{name}"><Latitude>{lat}</Latitude><Longitude>{lon}</Longitude>'
        "<Elevation>10</Elevation></Station>"
        for name, (lat, lon) in places.items()
    )
    return (
        '<FDSNStationXML xmlns="http://www.fdsn.org/xml/station/1" schemaVersion="1.1">'
        f'<Source>test</Source><Network code="CN">{stations}</Network></FDSNStationXML>'
    )


def test_table_has_names_and_positions(tmp_path: Path) -> None:
    array = SensorArray.from_toml(array_file(tmp_path, TABLE))
    assert isinstance(array, StationArray)
    assert (array.names, array.speed) == (("AA", "BB", "CC"), 6000.0)
    assert_array_equal(array.positions, list(PLACES.values()))


def test_bearings_swap_east_and_north(tmp_path: Path) -> None:
    array = SensorArray.from_toml(array_file(tmp_path, TABLE, more="clockwise = true\n"))
    assert_allclose(array.positions, np.array(list(PLACES.values()))[:, ::-1])


def test_latitudes_and_stationxml_are_on_the_local_plane(tmp_path: Path) -> None:
    table = "name;lat;lon\n" + "".join(f"CN.{n};{a};{b}\n" for n, (a, b) in LAT_LON.items())
    by_table = SensorArray.from_toml(array_file(tmp_path, table))
    by_xml = SensorArray.from_toml(array_file(tmp_path, station_xml(LAT_LON), "inventory.xml"))
    lat, lon = np.array(list(LAT_LON.values())).T
    expected = np.stack(LocalPlane.around(lat, lon).to_xy(lat, lon), axis=1)
    for array in (by_table, by_xml):
        assert isinstance(array, StationArray)
        assert array.names == ("CN.AA", "CN.BB", "CN.CC")
        assert_allclose(array.positions, expected)


def test_channels_are_matched_by_name(tmp_path: Path) -> None:
    array = SensorArray.from_toml(array_file(tmp_path, TABLE))
    samples = np.arange(30.0).reshape(10, 3)
    names = ("XX.CC..SHZ", "XX.AA.00.SHZ", "XX.BB..SHZ")
    recording = Recording(samples, 20.0, names=names).select(array)
    assert_array_equal(recording.samples, samples[:, [1, 2, 0]])
    assert recording.names == ("XX.AA.00.SHZ", "XX.BB..SHZ", "XX.CC..SHZ")
    assert recording.array is not None
    assert_array_equal(recording.array.positions, array.positions)


def test_stations_and_channels_without_each_other_are_left_out(tmp_path: Path) -> None:
    array = SensorArray.from_toml(array_file(tmp_path, TABLE))
    samples = np.arange(30.0).reshape(10, 3)
    recording = Recording(samples, 20.0, names=("XX.CC..SHZ", "XX.ZZ..SHZ", "XX.AA..SHZ"))
    with (
        pytest.warns(UserWarning, match="stations without a channel are left out: BB$"),
        pytest.warns(UserWarning, match="channels without a station are left out: XX.ZZ..SHZ$"),
    ):
        matched = recording.select(array)
    assert_array_equal(matched.samples, samples[:, [2, 0]])
    with pytest.raises(ValueError, match=r"at least two stations .* got 0: .* AA, BB, CC; .* a, b"):
        Recording(samples[:, :2], 20.0, names=("a", "b")).select(array)
    with pytest.raises(ValueError, match="the recording has none"):
        Recording(samples, 20.0).select(array)


BOMB = '<!DOCTYPE a [<!ENTITY x "xxxxxxxx"><!ENTITY y "&x;&x;&x;&x;">]><a>&y;</a>'


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "s.csv",
            "name,a,b\nx,1,2\n",
            r"s\.csv: the table must have the columns",
        ),
        ("s.csv", "name,x_m,y_m\nx,1,\n", "line 2 must have a new name and a position"),
        ("s.csv", "name,x_m,y_m\nx,1,2\nx,2,3\n", "line 3 must have a new name"),
        ("s.csv", "name,lat,lon\nx,91,2\ny,1,2\n", "lat must lie within"),
        ("s.csv", "", "no row below the header"),
        ("s.xml", BOMB, "without a document type"),
        ("s.xml", "<a><b></a>", "mismatched tag"),
        ("s.xml", "<a></a>", "the file has no stations"),
        ("s.xml", station_xml({"AA": (0, 0)}).replace("Latitude>", "Lat>"), "AA has no position"),
    ],
)
def test_invalid_stations_are_refused(
    tmp_path: Path, name: str, content: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        SensorArray.from_toml(array_file(tmp_path, content, name))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('kind = "stations"', "needs the key 'stations'"),
        ('kind = "stations"\nstations = "no.csv"', r"no\.csv"),
        ('kind = "stations"\nstations = "s.csv"\nspead = 2', "no key 'spead': did you mean speed"),
        ('kind = "stations"\nstations = "s.csv"\nclockwise = 2', "clockwise must be true or false"),
    ],
)
def test_invalid_station_keys_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "s.csv").write_text(TABLE)
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises((ValueError, OSError), match=message):
        SensorArray.from_toml(tmp_path / "a.toml")
