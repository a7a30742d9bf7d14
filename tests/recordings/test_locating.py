"""Tests of `arrivals.locate`: devices, surveys of WiGLE and Kismet, settings, outputs."""

import csv
import gzip
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reading_tables import NAMES, PLACES, START, iso, sensors, text, truth, walk

import arrivals
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.recordings.networks import Network
from arrivals.trackers.run import Run
from arrivals.typing import Float

N_STEPS = 24
ROWS = walk(N_STEPS, seed=3)
LONG = ("time_s", "sensor", "rss_db")
PLANE = LocalPlane(60.17, 24.94)


def written(folder: Path, table: str) -> Path:
    path = folder / "readings.csv"
    path.write_text(table)
    return path


def jittered(seed: int = 0) -> list[tuple[str, str, float]]:
    """Return the rows with dates that are spread over the second."""
    late = np.random.default_rng(seed).uniform(0, 0.9, len(ROWS))
    return [(iso(row[0] + one), *row[1:]) for row, one in zip(ROWS, late.tolist(), strict=True)]


def error(run: Run, position: Float | None = None) -> float:
    position = run.position[:, 0] if position is None else position
    return float(np.median(np.linalg.norm(position - truth(run.time), axis=-1)))


def test_walk_is_located_without_settings_in_all_forms(tmp_path: Path) -> None:
    seconds = arrivals.locate(written(tmp_path, text(LONG, ROWS)), sensors(tmp_path))
    assert error(seconds.run) < 2.5
    assert len(seconds.run) == N_STEPS
    assert "1 source (--sources auto: estimate it); loss exponent 2.5" in seconds.understood
    table = text(("timestamp", "BSSID", "dBm"), jittered())
    dated = arrivals.locate(written(tmp_path, table), sensors(tmp_path))
    assert error(dated.run) < 2.5
    assert len(dated.run) == N_STEPS
    assert "(from 2026-05-01T12:00:00Z)" in dated.understood
    assert "times are scattered: steps of 1 s" in dated.understood


def test_positions_have_latitude_and_longitude_where_the_sensors_do(tmp_path: Path) -> None:
    lat, lon = PLANE.to_lat_lon(*PLACES.T)
    places = tmp_path / "places.csv"
    places.write_text(text(("name", "lat", "lon"), zip(NAMES, lat, lon, strict=True)))
    path = written(tmp_path, text(("time", "AP", "RSSI"), jittered()))
    located = arrivals.locate(path, places, alpha=2.5)
    run = located.run
    assert error(run, np.stack(PLANE.to_xy(run.lat[:, 0], run.lon[:, 0]), axis=-1)) < 2.5
    located.to_csv(tmp_path / "out.csv")
    rows = list(csv.DictReader((tmp_path / "out.csv").read_text().splitlines()))
    assert list(rows[0])[-3:] == ["lat_deg", "lon_deg", "time_utc"]
    np.testing.assert_allclose([float(row["lon_deg"]) for row in rows], run.lon[:, 0], atol=1e-8)
    assert rows[0]["time_utc"].startswith("2026-05-01T12:00:00.")
    metres = arrivals.locate(path, sensors(tmp_path), alpha=2.5).run
    shift = metres.position - run.position
    np.testing.assert_allclose(shift - shift[0], 0.0, atol=1e-3)


def test_several_devices_are_located_one_by_one(tmp_path: Path) -> None:
    both = [(*row[:2], name, row[2]) for row in ROWS for name in ("tag-1", "tag-2")]
    table = text(("time_s", "sensor", "Device", "rss_db"), both)
    located = arrivals.locate(written(tmp_path, table), sensors(tmp_path), alpha=2.5)
    alone = arrivals.locate(written(tmp_path, text(LONG, ROWS)), sensors(tmp_path), alpha=2.5)
    assert list(located.runs) == ["tag-1", "tag-2"]
    for run in located.runs.values():
        np.testing.assert_array_equal(run.position, alone.run.position)
    assert "device 'Device' (2, each by itself)" in located.understood
    rows = [row for row in located.rows() if row[0] == "tag-2"]
    assert [row[1:] for row in rows] == list(alone.rows())
    assert located.header == ("device", *alone.header)
    with pytest.raises(ValueError, match=r"run must be one of runs.*tag-1, tag-2"):
        located.run  # noqa: B018
    legend: Any = arrivals.plot(located).get_legend()
    assert [one.get_text() for one in legend.get_texts()] == ["sensors", "tag-1", "tag-2"]
    np.testing.assert_array_equal(located.sensors, np.unique(PLACES, axis=0))


def test_group_by_names_the_column_of_the_devices(tmp_path: Path) -> None:
    rows = [(*row, "left" if row[0] < 12 else "right") for row in ROWS]
    path = written(tmp_path, text((*LONG, "Wing"), rows))
    assert list(arrivals.locate(path, sensors(tmp_path), alpha=2.5).runs) == [""]
    grouped = arrivals.locate(path, sensors(tmp_path), group_by="wing", alpha=2.5)
    assert [len(run) for run in grouped.runs.values()] == [12, 12]
    with pytest.raises(ValueError, match="group_by must be a column; got 'floor': found time_s"):
        arrivals.locate(path, sensors(tmp_path), group_by="floor")


def test_table_of_steps_may_have_devices_and_windows(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rows = [(0.25 * k, f"tag {k % 2}", *rng.normal(-60, 5, 12).round(1)) for k in range(40)]
    path = written(tmp_path, text(("time_s", "tag", *NAMES), rows))
    located = arrivals.locate(path, sensors(tmp_path), window=1, alpha=2)
    assert [len(run) for run in located.runs.values()] == [10, 10]
    network = located.networks["tag 1"]
    np.testing.assert_allclose(network.rss_db[0], np.mean([rows[1][2:], rows[3][2:]], axis=0))
    np.testing.assert_allclose(network.time[:2], [0.5, 1.5])
    assert "sensor and step: 240" in located.understood


def survey(seed: int = 1) -> tuple[Float, list[dict[str, Any]]]:
    """Return access points, and readings of them on a drive along two streets."""
    rng = np.random.default_rng(seed)
    t = np.arange(60.0)
    path = np.stack([np.minimum(4 * t, 120), np.maximum(4 * t - 120, 0)], axis=-1)
    path = path + rng.normal(0, 2, path.shape)
    points = np.array([[60.0, 25.0], [100.0, 60.0]])
    lat, lon = PLANE.to_lat_lon(*path.T)
    rows = []
    for k in range(60):
        for j, point in enumerate(points):
            level = -40 - 30 * np.log10(np.hypot(*(path[k] - point))) + rng.normal(0, 3)
            rows.append({
                "MAC": f"02:00:00:00:00:0{j}", "time": k, "RSSI": round(level),
                "lat": float(lat[k].round(6)), "lon": float(lon[k].round(6)),
            })  # fmt: skip
    return points, rows


def wigle(folder: Path, rows: list[dict[str, Any]]) -> Path:
    cells = [
        (row["MAC"], "net, 1", iso(row["time"])[:19].replace("T", " "), row["RSSI"], row["lat"],
         row["lon"], "WIFI")
        for row in rows
    ]  # fmt: skip
    cells.append(("02:00:00:00:00:00", "no fix", "2026-05-01 12:00:00", -50, 0.0, 0.0, "WIFI"))
    header = ("MAC", "SSID", "FirstSeen", "RSSI", "CurrentLatitude", "CurrentLongitude", "Type")
    return written(folder, "WigleWifi-1.6,appRelease=2,model=x\n" + text(header, cells))


def wigle_gz(folder: Path, rows: list[dict[str, Any]]) -> Path:
    path = folder / "wigle.csv.gz"
    path.write_bytes(gzip.compress(wigle(folder, rows).read_bytes()))
    return path


def kismet(folder: Path, rows: list[dict[str, Any]]) -> Path:
    path, unknown = folder / "a.kismet", "00:00:00:00:00:00"
    with sqlite3.connect(path) as log:
        log.execute("CREATE TABLE KISMET (db_version INT)")
        log.execute("INSERT INTO KISMET VALUES (8)")
        log.execute("CREATE TABLE packets (ts_sec INT, ts_usec INT, sourcemac TEXT, transmac TEXT, "
                    "signal INT, lat REAL, lon REAL)")  # fmt: skip
        log.executemany(
            "INSERT INTO packets VALUES (?, 0, ?, ?, ?, ?, ?)",
            [(START.timestamp() + row["time"], row["MAC"], unknown, row["RSSI"], row["lat"],
              row["lon"]) for row in rows] + [(0, "x", unknown, 0, 60.0, 24.0)],
        )  # fmt: skip
    log.close()
    return path


def gpsxml(folder: Path, rows: list[dict[str, Any]]) -> Path:
    path = folder / "a.gpsxml"
    points = [
        f'<gps-point bssid="{row["MAC"]}" source="{row["MAC"]}" time-usec="0" '
        f'time-sec="{START.timestamp() + row["time"]:.0f}" lat="{row["lat"]}" '
        f'lon="{row["lon"]}" signal_dbm="{row["RSSI"]}"/>'
        for row in rows
    ]
    track = '<gps-point bssid="GP:SD:TR:AC:KL:OG" time-sec="1" time-usec="0" lat="1" lon="2"/>'
    path.write_text(f"<?xml version='1.0'?>\n<gps-run>{track}{''.join(points)}</gps-run>")
    return path


@pytest.mark.parametrize("export", [wigle, wigle_gz, kismet, gpsxml])
def test_survey_locates_the_access_points(tmp_path: Path, export: Any) -> None:
    points, rows = survey()
    located = arrivals.locate(export(tmp_path, rows), alpha=3.0)
    assert list(located.runs) == ["02:00:00:00:00:00", "02:00:00:00:00:01"]
    for run, point in zip(located.runs.values(), points, strict=True):
        assert len(run) == 1
        position = PLANE.to_xy(run.lat[0, 0], run.lon[0, 0])
        spread = np.sqrt(np.diag(run.covariance[0, 0]))
        assert np.linalg.norm(np.array(position) - point) < max(3 * spread.max(), 5.0)
        assert spread.max() < 20
    assert "sources at rest" in located.understood
    assert ("rows without level or position left out: 1" in located.understood) == (
        export in (wigle, wigle_gz)
    )


def test_moving_sensors_have_their_positions_in_each_row(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rows = []
    for k in range(20):
        for name, place in zip(NAMES, PLACES + 0.2 * k, strict=True):
            level = -40 - 25 * np.log10(np.hypot(*(place - [30.0, 25.0]))) + rng.normal(0, 1)
            rows.append((k, name, *place, level))
    path = written(tmp_path, text(("time", "receiver", "x_m", "y_m", "rssi"), rows))
    run = arrivals.locate(path, alpha=2.5, sigma_db=1.0, speed=0.1, q=1e-3).run
    assert len(run) == 20
    assert np.linalg.norm(run.position[-1, 0] - [30, 25]) < 3


def test_warnings_of_several_devices_are_raised_once(tmp_path: Path) -> None:
    rows = [(k, name, NAMES[0], -60) for k in range(3) for name in ("p", "q")]
    path = written(tmp_path, text(("time", "device", "sensor", "rssi"), rows))
    with pytest.warns(
        UserWarning, match=r"1 readings are fewer .*\(2 of 2 devices: 'p', 'q'\)"
    ) as caught:
        arrivals.locate(path, sensors(tmp_path), alpha=2)
    assert len(caught) == 1


# networks and arrays


def levels(alpha: float = 3.0, n_steps: int = 30) -> tuple[Float, Float]:
    rng = np.random.default_rng(5)
    far = np.linalg.norm(truth(np.arange(float(n_steps)))[:, None] - PLACES, axis=-1)
    rss_db = -40 - 10 * alpha * np.log10(np.maximum(far, 1)) + rng.normal(0, 3, far.shape)
    return rss_db, far


def test_arrays_mappings_and_networks_are_the_same() -> None:
    rss_db, _ = levels()
    places = dict(zip(NAMES, PLACES.tolist(), strict=True))
    time: Float = np.arange(30, dtype=np.float64)
    network = Network.fixed(NAMES, PLACES, rss_db, time)
    options: dict[str, Any] = {"n_sources": 1, "alpha": 3.0}
    runs = [
        arrivals.locate(rss_db, PLACES, time=time, **options).run,
        arrivals.locate(np.where(rss_db < -85, 100.0, rss_db), places, missing=100, **options).run,
        arrivals.locate(network, **options).run,
    ]
    np.testing.assert_array_equal(runs[0].position, runs[2].position)
    assert error(runs[1]) < 3
    assert (rss_db < -85).any()


def test_loss_exponent_is_chosen_where_the_number_of_sources_is_known() -> None:
    rss_db, _ = levels(alpha=3.5)
    known = arrivals.locate(rss_db, PLACES, n_sources=1, sigma_db=3.0)
    assert "loss exponent 3.5 (--alpha)" in known.understood
    assert error(known.run) < error(arrivals.locate(rss_db, PLACES, n_sources=1, alpha=2.0).run)
    assert "exponent" not in arrivals.locate(rss_db[:3], PLACES).understood
    assert "estimated" in arrivals.locate(rss_db[:3], PLACES, n_sources="auto").understood


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n_sources": "many"}, "n_sources must be a number or 'auto'; got 'many'"),
        ({"window": 1.0}, "window require a table of readings"),
        ({"window": 0.0}, "window must be finite and positive"),
        ({"sensors": None}, "levels require the positions of the sensors"),
        ({"sensors": np.zeros(3)}, r"sensors must have shape \(n_sensors, 2\)"),
        ({"time": [0.0]}, r"time must have shape \(\d+,\); got \(1,\)"),
        ({"sensors": np.eye(2)}, r"readings must have shape \(n_steps, 2\), a column for each"),
        ({"readings": np.ones(12)}, r"readings must have shape \(n_steps, 12\)"),
        ({"readings": Network.fixed("ab", np.eye(2), np.ones((2, 2)))}, "must be left out where"),
        ({"n_source": 1}, "locate has no argument 'n_source': did you mean n_sources?"),
    ],
)
def test_invalid_arguments_raise_one_line(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        arrivals.locate(**{"readings": levels()[0], "sensors": PLACES, **arguments})


def test_levels_without_a_sign_raise_a_warning(tmp_path: Path) -> None:
    rows = [(*row[:2], -row[2]) for row in ROWS]
    with pytest.warns(UserWarning, match="above 20 dB: if they are dBm without their sign"):
        arrivals.locate(written(tmp_path, text(LONG, rows)), sensors(tmp_path), alpha=2.5)


def test_steps_in_which_a_source_leaves_the_network_raise_a_warning(tmp_path: Path) -> None:
    rows = [(1000 * row[0], *row[1:]) for row in ROWS]
    path = written(tmp_path, text(LONG, rows))
    with pytest.warns(UserWarning, match=r"in the 1000 s between steps, .*check the unit of time"):
        arrivals.locate(path, sensors(tmp_path), alpha=2.5)
    path.write_text(text(("time_ms", *LONG[1:]), rows))
    assert error(arrivals.locate(path, sensors(tmp_path), alpha=2.5).run) < 2.5
