"""Errors of fused positions: one line, before anything is computed."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile
from station_scenes import ARRAY, HEADINGS, PLACES, RATE, bearing_rows, samples_at, stations_file

import arrivals
from arrivals.measurement_models import SensorArray
from arrivals.recordings import Recording
from arrivals.recordings.fusion import BearingTable
from arrivals.recordings.networks import Network


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write short recordings, and tables of bearings and readings."""
    folder = tmp_path_factory.mktemp("short")
    for name in PLACES:
        samples = 0.3 * samples_at(name, duration=1.0)
        wavfile.write(folder / f"{name}.wav", RATE, samples.astype(np.float32))
    rows = [f"{t},{name},{bearing}" for t, name, bearing in bearing_rows(4)]
    (folder / "b.csv").write_text("\n".join(["time_s,station,bearing_deg", *rows]))
    (folder / "r.csv").write_text("time_s,s1,s2\n0,-60,-70\n1,-61,-71\n")
    (folder / "s.csv").write_text("name,x_m,y_m\ns1,0,0\ns2,9,9\n")
    (folder / "geo.csv").write_text("name,lat,lon\ns1,60,25\ns2,60.001,25\n")
    return folder


def keys(**more: Any) -> dict[str, Any]:
    stations = [{"name": name, "x_m": x, "y_m": y, "heading_deg": HEADINGS[name], "array": ARRAY}
                for name, (x, y) in PLACES.items()]  # fmt: skip
    return {"station": stations, **more}


def one_line(
    call: Callable[..., Any], message: str, kind: type[Exception] = ValueError, **arguments: Any
) -> None:
    with pytest.raises(kind, match=message) as error:
        call(**arguments)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"roof": "start_s = 30"}, "station 'mast' must have|station 'roof' must have a step in"),
        ({"roof": "start_s = -30"}, "got 'mast' 0.01 to 0.95 s, 'roof' -29.99 to -29.05 s, "),
        ({"roof": "start_s = 1777636800"}, "times must be dates in all inputs or in none: start_s"),
        ({"roof": "tracker = 'interpolation_ekf'"}, "'roof': tracker must take snapshots; got 'in"),
        ({"roof": "frequency = 9000"}, "frequency must lie|'roof': frequency|half the rate"),
        ({"roof": "window = 9000"}, "the recording has 8000 samples; one window requires 9000"),
    ],
)
def test_recordings_error_is_one_line(folder: Path, more: dict[str, str], message: str) -> None:
    path = stations_file(folder, head="band = [500, 1500]\nwindow = 250", more=more)
    one_line(arrivals.fuse, message, stations=path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "station 'mast' must have a recording, or bearings"),
        ({"recordings": ["a.wav"]}, "recordings must be one a station with an array and wi"),
        ({"recordings": "a.wav"}, "without bearings, 3; got 1"),
        ({"sensors": np.eye(2)}, "sensors require readings of signal strength"),
        ({"rss": Network.fixed("ab", np.eye(2), [[-60.0, -70.0]])}, "floor must be given with"),
        ({"area": [0, 0, 1]}, r"area must have shape \(4,\)"),
        ({"speed": -1.0}, "speed must be finite and positive"),
        ({"frequencies": 500.0, "band": [1, 2]}, "only one of frequency, frequencies, center, ban"),
    ],
)  # fmt: skip
def test_arguments_error_is_one_line(arguments: dict[str, Any], message: str) -> None:
    one_line(arrivals.fuse, message, stations=keys(), **arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"snapshot": 3}, "fuse has no argument 'snapshot': did you mean snapshots?"),
        ({"sigma_db": 3}, "fuse has no argument 'sigma_db': did you mean sigma?"),
        ({"motions__kappa": 3}, "fuse has no argument 'motions__kappa'"),
        ({"tracker": 3}, "name of a tracker must be a string; got 3"),
        ({"detection__cluter": 3}, "cluter"),
    ],
)
def test_unknown_argument_is_refused_with_a_similar_one(
    folder: Path, arguments: dict[str, Any], message: str
) -> None:
    one_line(arrivals.fuse, message, (TypeError, ValueError), stations=keys(),  # type: ignore[arg-type]
             bearings=folder / "b.csv", **arguments)  # fmt: skip


def test_single_station_requires_signal_strength(folder: Path) -> None:
    single = {"station": keys()["station"][:1]}
    one_line(arrivals.fuse, r"stations must be at least two without signal strength \(--rss\); got",
             stations=single, recordings=[folder / "mast.wav"])  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rss": "r.csv"}, "readings of signal strength require a table of sensors"),
        ({"rss": "r.csv", "sensors": "geo.csv"}, "got lat, lon for sensors and x_m, y_m for stat"),
        ({"rss": "late.csv", "sensors": "s.csv"}, "times must be dates in all inputs or in none"),
        ({"rss": "tags.csv", "sensors": "s.csv"}, "readings must be of one device; got 2"),
        ({"rss": "none.csv", "sensors": "s.csv"}, "No such file"),
        ({"rss": "r.npz", "sensors": "s.csv"}, "sensors must be left out where the readings have"),
        ({"rss": "moving.npz"}, "sensors must not move"),
    ],
)
def test_signal_strength_error_is_one_line(
    folder: Path, arguments: dict[str, Any], message: str
) -> None:
    (folder / "late.csv").write_text("time,s1,s2\n2026-05-01T12:00:00Z,-60,-70\n")
    (folder / "tags.csv").write_text("time,tag,sensor,rssi\n0,a,s1,-60\n0,b,s1,-70\n")
    level, moving = np.full((2, 2), -60.0), np.arange(8.0).reshape(2, 2, 2)
    np.savez(folder / "r.npz", rss_db=level, sensor_xy=moving[0])
    np.savez(folder / "moving.npz", rss_db=level, sensor_xy=moving)
    files = {name: folder / value for name, value in arguments.items()}
    one_line(arrivals.fuse, message, (ValueError, FileNotFoundError),  # type: ignore[arg-type]
             stations=keys(), bearings=folder / "b.csv", floor=-97, **files)  # fmt: skip


def test_readings_outside_of_all_recordings_are_refused() -> None:
    recordings = [Recording(samples_at(name, duration=1.0), RATE) for name in PLACES]
    network = Network.fixed("ab", np.eye(2), [[-60.0, -70.0]], np.array([50.0]))
    one_line(arrivals.fuse, "must have times from 0.0.* to .* s; got 50 to 50 s", stations=keys(),
             recordings=recordings, band=(500, 1500), rss=network, floor=-97)  # fmt: skip


def test_bearings_that_never_meet_are_refused() -> None:
    time, station = np.arange(6.0), np.repeat([0, 1, 2], 2)
    table = BearingTable(time, station, np.zeros(6), np.full(6, 1e-3))
    one_line(arrivals.fuse, r"must have a step in common with another one; got .*\(--step\)",
             stations=keys(), bearings=table)  # fmt: skip


def test_array_without_speed_and_recording_without_rate_are_refused() -> None:
    samples = [samples_at(name, duration=1.0) for name in PLACES]
    bare = keys()
    bare["station"][1]["array"] = SensorArray(ARRAY.positions)
    one_line(arrivals.fuse, "station 'roof': the array requires the key 'speed'", stations=bare,
             recordings=[Recording(each, RATE) for each in samples])  # fmt: skip
    one_line(arrivals.fuse, "station 'mast': .*rate", stations=keys(), recordings=samples)
    snapshots = [Recording(each.astype(complex)) for each in samples]
    one_line(arrivals.fuse, r"station 'mast': steps must have increasing times: pass rate",
             stations=keys(), recordings=snapshots, frequencies=500.0)  # fmt: skip
    none = keys()
    del none["station"][0]["array"]
    one_line(arrivals.fuse, "recordings must be one a station with an array and without bear.*, 2",
             stations=none, recordings=samples)  # fmt: skip


@pytest.mark.filterwarnings("ignore:channel 3 has zeros")
def test_faults_of_a_recording_are_warnings_with_the_station() -> None:
    recordings = [samples_at(name, duration=1.0) for name in PLACES]
    recordings[1][:, 3] = 0.0
    with pytest.warns(UserWarning, match="station 'roof': channel 4 is silent"):
        arrivals.fuse(keys(), recordings, rate=RATE, band=(500, 1500), window=250)
