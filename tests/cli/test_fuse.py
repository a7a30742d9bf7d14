"""`arrivals fuse`: tables, maps and errors of positions from several stations."""

import csv
import os
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_rejected, table
from station_scenes import HEADINGS, PLACES, bearing_rows, path_of, stations_file, wav_files

from arrivals.__main__ import main
from arrivals.typing import Float

HEADER = ("step,time_s,label,x_m,y_m,std_x_m,std_y_m,corr,vx_mps,vy_mps,existence,level_db,"
          "heard")  # fmt: skip
OPTIONS = ["--band", "500", "1500", "--window", "256", "--snapshots", "16", "--speed", "1"]


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder with stations and recordings of two sources."""
    wav_files(tmp_path, n_sources=2)
    stations_file(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder with stations and a table of bearings."""
    stations_file(tmp_path, recorded=False)
    write_bearings(tmp_path / "b.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_bearings(path: Path) -> None:
    with open(path, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time_s", "station", "bearing_deg"])
        writer.writerows(bearing_rows(10))


def error_of(rows: list[dict[str, str]], source: int) -> Float:
    """Return the distances from the nearest row of each time to a source."""
    steps: dict[float, list[float]] = {}
    for row in rows:
        time = float(row["time_s"])
        place = np.array([float(row["x_m"]), float(row["y_m"])])
        away = np.linalg.norm(place - path_of(np.array([time]), source)[0])
        steps.setdefault(time, []).append(float(away))
    return np.array([min(each) for each in steps.values()])


def test_fuse_of_three_wav_files_writes_tracks_and_a_map(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["fuse", "stations.toml", "--out", "tracks.csv", "--plot", "map.png"]
    assert main([*command, "--tracker", "svalse", *OPTIONS]) == 0
    printed, message = capsys.readouterr()
    assert printed == ""
    assert message.startswith("arrivals: 3 stations (mast, roof, gate); svalse at ")
    assert message.count("\n") == 1
    text = (scene / "tracks.csv").read_text()
    assert text.startswith(HEADER + "\n")
    rows = table(text)
    assert np.median(error_of(rows, 0)) < 0.1
    assert np.median(error_of(rows, 1)) < 0.1
    assert rows[-1]["heard"] == "mast+roof+gate"
    assert rows[-1]["level_db"] == ""
    assert (scene / "map.png").read_bytes().startswith(b"\x89PNG")


def test_files_replace_the_recordings_of_the_file_in_the_order_of_stations(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["fuse", "stations.toml", *OPTIONS, "--quiet"]
    assert main(command) == 0
    expected = capsys.readouterr().out
    for name in PLACES:
        (scene / f"{name}.wav").rename(scene / f"{name}2.wav")
    assert main([*command[:2], "mast2.wav", "roof2.wav", "gate2.wav", *command[2:]]) == 0
    assert capsys.readouterr() == (expected, "")
    assert_rejected(command, capsys, scene, "mast.wav", "No such file")
    assert_rejected([*command[:2], "mast2.wav", *command[2:]], capsys, scene, "3; got 1")


def test_fuse_of_bearings_prints_the_table_without_out(
    tables: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fuse", "stations.toml", "--bearings", "b.csv", "--speed", "1"]) == 0
    printed, message = capsys.readouterr()
    assert printed.startswith(HEADER + "\n")
    assert np.median(error_of(table(printed), 0)) < 0.5
    assert "no deviations: 3 degrees assumed; 10 steps of 1 s; --speed 1 --q 0.01" in message
    main(["fuse", "stations.toml", "--bearings", "b.csv", "--speed", "1", "--out", "t.csv"])
    assert (tables / "t.csv").read_text() == printed


def test_fuse_of_kraken_logs_has_dates_latitudes_and_longitudes(
    tables: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lat, lon = 60.0, 25.0  # a degree is 111412.3 m and 55799.98 m
    text = "".join(
        f'[[station]]\nname = "{name}"\nlat_deg = {lat + y / 111412.3}\nlon_deg = '
        f'{lon + x / 55799.98}\nbearings = "compass"\n'
        for name, (x, y) in PLACES.items()
    )
    (tables / "stations.toml").write_text(text)
    for own in PLACES:
        log = [(1777636800000 + int(1000 * t), 90 - (b + HEADINGS[own]))
               for t, name, b in bearing_rows(10) if name == own]  # fmt: skip
        lines = [f"{t}, {b % 360:.1f}, 40, -20, 433e6, UCA, 90, {own}, 0, 0, 0, 0, GPS, R, R, R, R"
                 for t, b in log]  # fmt: skip
        (tables / f"{own}.csv").write_text("\n".join(lines))
    logs = [f"{name}.csv" for name in PLACES]
    assert main(["fuse", "stations.toml", "--bearings", *logs, "--speed", "1", "--quiet"]) == 0
    rows = table(capsys.readouterr().out)
    assert list(rows[0])[-3:] == ["lat_deg", "lon_deg", "time_utc"]
    last = rows[-1]
    assert last["time_utc"] == "2026-05-01T12:00:09.000Z"
    x, y = path_of(np.array([9.0]))[0]
    assert float(last["lat_deg"]) == pytest.approx(lat + y / 111412.3, abs=1e-5)
    assert float(last["lon_deg"]) == pytest.approx(lon + x / 55799.98, abs=2e-5)


def test_fuse_with_signal_strength_has_levels_and_draws_sensors(
    tables: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(0)
    sensors = rng.uniform(0, 30, (6, 2))
    (tables / "s.csv").write_text(
        "name,x_m,y_m\n" + "".join(f"s{k},{x},{y}\n" for k, (x, y) in enumerate(sensors))
    )
    lines = ["time_s," + ",".join(f"s{k}" for k in range(6))]
    for time in np.arange(10.0):
        away = np.linalg.norm(path_of(np.array([time]))[0] - sensors, axis=1)
        levels = -30 - 30 * np.log10(np.maximum(away, 1)) + rng.normal(0, 2, 6)
        lines.append(f"{time}," + ",".join(f"{level:.1f}" for level in levels))
    (tables / "r.csv").write_text("\n".join(lines))
    command = ["fuse", "stations.toml", "--bearings", "b.csv", "--rss", "r.csv", "--sensors",
               "s.csv", "--alpha", "3", "--sigma", "2", "--speed", "1"]  # fmt: skip
    assert_rejected(command, capsys, tables, "floor must be given", "(--floor)")
    assert main([*command, "--floor", "-97", "--power", "-30", "--plot", "map.svg"]) == 0
    printed, message = capsys.readouterr()
    assert "--alpha 3" in message
    assert float(table(printed)[-1]["level_db"]) == pytest.approx(-30, abs=2)
    assert "sensors" in (tables / "map.svg").read_text()


def test_fuse_without_a_source_says_so(tables: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tables / "b.csv").write_text("time_s,station,bearing_deg\n0,mast,\n0,roof,\n0,gate,\n")
    assert main(["fuse", "stations.toml", "--bearings", "b.csv"]) == 0
    printed, message = capsys.readouterr()
    assert printed == HEADER + "\n"
    assert "arrivals: no source was found in 1 steps" in message


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--out", "nowhere/t.csv"], "the folder does not exist"),
        (["--plot", "map.sketch"], "suffix of a picture"),
        (["--out", "b.csv"], "must be different files"),
        (["--out", "stations.toml"], "must be different files"),
        (["--out", "m.png", "--plot", "m.png"], "must be different files"),
        (["--set", "speed=3"], "--set must not have options"),
        (["--set", "detection__cluter=3"], "cluter"),
        (["--step", "0"], "step must be finite and positive"),
        (["--speeed", "3"], "unrecognized arguments: --speeed 3: did you mean --speed?"),
        (["--bearings", "none.csv"], "none.csv: No such file"),
        (["--sensors", "b.csv"], "sensors require readings"),
        (["--tracker", "svals"], "did you mean svalse?"),
    ],
)
def test_fuse_invalid_argument_prints_one_line_and_writes_nothing(
    tables: Path, capsys: pytest.CaptureFixture[str], change: list[str], words: str
) -> None:
    before = {name: (tables / name).read_bytes() for name in os.listdir(tables)}
    command = ["fuse", "stations.toml", "--bearings", "b.csv", *change]
    assert_rejected(command, capsys, tables, words)
    assert {name: (tables / name).read_bytes() for name in os.listdir(tables)} == before


@pytest.mark.parametrize("name", ["array.toml", "mast.wav"])
def test_output_that_the_stations_file_names_as_an_input_is_refused(
    scene: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    before = (scene / name).read_bytes()
    command = ["fuse", "stations.toml", *OPTIONS, "--out", name]
    assert_rejected(command, capsys, scene, "must be different files")
    assert (scene / name).read_bytes() == before
