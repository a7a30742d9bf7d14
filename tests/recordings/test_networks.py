"""Tests of the files of measured networks, their calibration, and the measured data."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import db_to_neper, neper_to_db
from arrivals.recordings.networks import Network, calibrate, read_network, read_sensors
from arrivals.scenarios.reproduce.rss.measured_network import (
    FLOOR_DB,
    centre,
    snapshot,
    steps_of,
    strongest,
    track_transmitter,
)
from arrivals.typing import Float

SENSORS = "name,x_m,y_m\na,0,0\nb,50,0\nc,0,50\n"
WIDE = "time_s,a,b,c\n0,-60,-71.5,\n4,-61,,-80\n"
LONG = "time_s,sensor,rss_dbm\n0,a,-60\n0,b,-71.5\n4,c,-80\n4,a,-61\n"


def files(folder: Path, readings: str, sensors: str = SENSORS) -> tuple[Path, Path]:
    one, other = folder / "readings.csv", folder / "sensors.csv"
    one.write_text(readings)
    other.write_text(sensors)
    return one, other


@pytest.mark.parametrize("readings", [WIDE, LONG])
def test_both_forms_of_a_table_are_read(tmp_path: Path, readings: str) -> None:
    network = read_network(*files(tmp_path, readings))
    assert network.name == ("a", "b", "c")
    np.testing.assert_array_equal(network.time, [0.0, 4.0])
    np.testing.assert_array_equal(network.rss_db, [[-60, -71.5, np.nan], [-61, np.nan, -80]])
    np.testing.assert_allclose(network.readings[0, 0], db_to_neper(-60.0))
    np.testing.assert_array_equal(network.sensors[1], [[0, 0], [50, 0], [0, 50]])


@pytest.mark.parametrize(
    ("readings", "sensors", "message"),
    [
        (WIDE, SENSORS + "b,9,9\n", "the sensor 'b' is listed twice"),
        (WIDE, "name,x_m\na,0\n", "the column 'y_m' is missing"),
        (WIDE, "name,x_m,y_m\na,0,0\nb,50,\nc,0,50\n", "a position is missing"),
        (WIDE, "name,x_m,y_m\na,0,east\n", "'east' is not a number"),
        (WIDE.replace(",c\n", ",d\n"), SENSORS, "the sensor 'd' is not in the table"),
        (WIDE.replace(",c\n", ",a\n"), SENSORS, "the column 'a' is listed twice"),
        ("sensor,rss_db\na,-60\n", SENSORS, "the column 'time_s' is missing"),
        ("time_s,a,b,c\n0,,,\n", SENSORS, "rss_db must have a valid reading"),
        ("time_s,a,b,c\n", SENSORS, "there is no row below the header"),
        ("time_s,a,b,c\n0,1,2,3,4\n", SENSORS, "more cells than the header"),
        (WIDE.replace("-61", "loud"), SENSORS, "'loud' is not a number"),
    ],
)
def test_invalid_tables_raise_a_one_line_error(
    tmp_path: Path, readings: str, sensors: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read_network(*files(tmp_path, readings, sensors))


@pytest.mark.parametrize(
    ("readings", "sensors"),
    [
        ("time_s;a;b;c\r\n0;-60;-71,5;\r\n4;-61;;-80\r\n", "name;x_m;y_m\na;0;0\nb;50,0;0\nc;0;50"),
        ("time_s\ta\tb\tc\n0\t-60\t-71,5\tNA\n4\t-61\tnan\t-80\n", SENSORS.replace(",", "\t")),
        ("time_s,a,b,c,,\n0,-60,-71.5,,,\n4,-61,,-80,,\n", SENSORS.replace("\n", ",,\n")),
        ('"time_s","a","b","c"\n0,"-60",-71.5,None\n4,-61,#N/A,-80\n', "\ufeff" + SENSORS),
    ],
)
def test_tables_of_any_spreadsheet_are_read(tmp_path: Path, readings: str, sensors: str) -> None:
    network = read_network(*files(tmp_path, readings, sensors))
    np.testing.assert_array_equal(network.rss_db, [[-60, -71.5, np.nan], [-61, np.nan, -80]])
    np.testing.assert_array_equal(network.sensors[0], [[0, 0], [50, 0], [0, 50]])


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("readings.csv", "time_s,a\n0,-60\nä".encode("latin-1"), "line 3 must be UTF-8 text"),
        ("sensors.csv", "name,x_m,y_m\nä,0,0\n".encode("latin-1"), "line 2 must be UTF-8 text"),
        ("sensors.csv", b"name,x_m,y_m\na,0,1\nb,east,0\n", "line 3: 'east' is not a number"),
        ("readings.csv", b'time_s,a\n0,-60\n0,"-61\n', "line 3: unexpected end of data"),
        ("readings.csv", b"time_s,a\nNA,-60\n", "line 2: the time is missing"),
        ("readings.csv", b"time_s,a\n0,1e999\n", "rss_db must have a valid reading"),
        ("readings.csv", b"time_s,a\n0,-6000\n", r"rss_db must lie within ±340 dB; got -6000"),
        ("readings.csv", b"\0" * 100, "the sensor .* is not in the table|no row below"),
    ],
)
def test_message_about_a_table_begins_with_its_name(
    tmp_path: Path, name: str, content: bytes, message: str
) -> None:
    tables = files(tmp_path, WIDE)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message) as error:
        read_network(*tables)
    assert str(error.value).startswith(str(tmp_path / name))


def test_row_that_begins_like_a_comment_is_a_row(tmp_path: Path) -> None:
    readings, sensors = files(tmp_path, "time_s,#1,%2\n0,-60,-70\n", "name,x_m,y_m\n#1,0,0\n%2,1,0")
    assert read_network(readings, sensors).name == ("#1", "%2")


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"rss_db": np.ones(4)}, r"rss_db must have shape \(n_steps, n_sensors\); got \(4,\)"),
        ({"sensor_xy": np.ones((3, 2))}, r"sensor_xy must have shape .* or \(8, 2\); got \(3, 2\)"),
        ({"rss_db": np.full((4, 8), "x")}, "rss_db must hold numbers"),
        ({"time": [0.0, 1.0]}, r"rss_db must have shape \(2, 8\)"),
        ({"tx_xy": np.ones((4, 2))}, r"truth must have shape \(4, n_sources, 2\); got \(4, 2\)"),
        ({"rss_db": np.full((4, 8), None)}, "truncated, or not a NumPy file of numbers: Object"),
        ({"sensor_name": np.array(["a"] * 8)}, "name must have no duplicates"),
    ],
)
def test_npz_with_other_shapes_is_refused(tmp_path: Path, arrays: Any, message: str) -> None:
    path = tmp_path / "n.npz"
    np.savez(path, **{"rss_db": np.ones((4, 8)), "sensor_xy": np.ones((8, 2))} | arrays)
    with pytest.raises(ValueError, match=message) as error:
        read_network(path)
    assert str(error.value).startswith(f"{path}: ")


def test_damaged_npz_is_a_value_error_with_its_name(tmp_path: Path) -> None:
    path, rng = tmp_path / "n.npz", np.random.default_rng(2)
    np.savez(path, rss_db=np.ones((4, 8)), sensor_xy=np.ones((8, 2)))
    whole = path.read_bytes()
    for _ in range(100):
        damaged = bytearray(whole[: rng.integers(len(whole))] if rng.random() < 0.3 else whole)
        for at in rng.integers(0, max(1, len(damaged)), 2 * (len(damaged) > 0)):
            damaged[at] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            read_network(path)
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")  # noqa: PT017  (some are right)


@pytest.mark.parametrize("suffix", ["csv", "npz"])
def test_impossible_level_is_an_error_unless_it_is_named_as_missing(
    tmp_path: Path, suffix: str
) -> None:
    readings, sensors = files(tmp_path, WIDE.replace("-71.5", "-999"))
    paths: dict[str, Any] = {"readings": readings, "sensors": sensors}
    if suffix == "npz":
        network = read_network(**paths, missing=[-999.0])
        rss_db = np.where(np.isnan(network.rss_db), -999.0, network.rss_db)
        paths = {"readings": tmp_path / "n.npz"}
        np.savez(paths["readings"], rss_db=rss_db, sensor_xy=network.sensors)
    with pytest.raises(ValueError, match="got -999: pass missing=") as error:
        read_network(**paths)
    assert str(error.value).startswith(f"{paths['readings']}: ")
    assert np.isnan(read_network(**paths, missing=[-999.0]).rss_db).sum() == 3


def test_masked_readings_are_missing() -> None:
    masked = np.ma.masked_less([[-60.0, -200.0], [-61.0, -70.0]], -100)
    network = Network.fixed(["a", "b"], np.eye(2), masked)
    np.testing.assert_array_equal(network.rss_db, [[-60, np.nan], [-61, -70]])


def test_a_table_of_readings_needs_its_sensors(tmp_path: Path) -> None:
    readings, _ = files(tmp_path, LONG)
    with pytest.raises(ValueError, match="require a table of sensors"):
        read_network(readings)


def test_two_sensors_at_one_position_raise_a_warning(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="two sensors have the same position"):
        read_network(*files(tmp_path, WIDE, "name,x_m,y_m\na,0,0\nb,0,0\nc,0,50\n"))
    assert read_sensors(tmp_path / "sensors.csv")[0] == ["a", "b", "c"]


def moving(n_steps: int = 300, seed: int = 0, sigma_db: float = 4.0) -> Network:
    """Simulate a walk among sensors with offsets; one sensor moves, some readings are missing."""
    rng = np.random.default_rng(seed)
    sensors = np.broadcast_to(rng.uniform(-400, 400, (14, 2)), (n_steps, 14, 2)).copy()
    sensors[:, 13, 0] += np.linspace(0, 200, n_steps)
    truth = np.stack([np.linspace(-200, 250, n_steps), np.linspace(100, -150, n_steps)], axis=-1)
    far = np.maximum(np.linalg.norm(truth[:, None] - sensors, axis=-1), 20.0)
    offsets = np.random.default_rng(1).normal(0, 6, 14)
    noise: Float = sigma_db * rng.standard_normal(far.shape)
    rss_db = noise + offsets - 10 - 25 * np.log10(far)
    rss_db[rng.random(far.shape) < 0.2] = np.nan
    name = tuple(f"s{k}" for k in range(14))
    return Network(name, np.arange(0.0, 4 * n_steps, 4.0), rss_db, sensors, truth[:, None])


def test_npz_is_a_round_trip(tmp_path: Path) -> None:
    network = moving(20)
    truth = np.asarray(network.truth)
    np.savez(tmp_path / "n.npz", rss_db=network.rss_db, sensor_xy=network.sensors,
             sensor_name=network.name, time=network.time, tx_xy=truth)  # fmt: skip
    back = read_network(tmp_path / "n.npz")
    assert back.name == network.name
    np.testing.assert_array_equal(back.rss_db, network.rss_db)
    np.testing.assert_array_equal(back.truth, network.truth)
    np.savez(tmp_path / "m.npz", rss_db=network.rss_db)
    with pytest.raises(ValueError, match="the array 'sensor_xy' is missing"):
        read_network(tmp_path / "m.npz")


def test_a_reading_without_a_position_is_an_error() -> None:
    network = moving(3)
    sensors = network.sensors.copy()
    sensors[0, np.flatnonzero(np.isfinite(network.rss_db[0]))[0]] = np.nan
    with pytest.raises(ValueError, match="has a reading, but no position, in step 0"):
        Network(network.name, network.time, network.rss_db, sensors)


def test_calibration_recovers_the_simulated_values_with_outliers() -> None:
    network = moving()
    rss_db = network.rss_db.copy()
    rss_db[::15] += 40.0
    result = calibrate(Network(network.name, network.time, rss_db, network.sensors, network.truth))
    assert result.alpha == pytest.approx(2.5, abs=0.25)
    offsets = np.random.default_rng(1).normal(0, 6, 14)
    error = neper_to_db(result.offsets) - offsets
    assert np.std(error) < 1.5
    clean = calibrate(network)
    assert float(neper_to_db(clean.sigma)) == pytest.approx(4.0, rel=0.1)


def test_uncalibrated_sensors_have_a_larger_variance() -> None:
    network = moving()
    rss_db = network.rss_db.copy()
    rss_db[:, 2] = np.nan
    result = calibrate(Network(network.name, network.time, rss_db, network.sensors, network.truth))
    model = result.model(network.sensors[0])
    assert result.offsets[2] == 0
    assert model.variance[2] == pytest.approx(result.sigma**2 + float(db_to_neper(7.0)) ** 2)


def test_calibration_requires_one_known_transmitter() -> None:
    network = moving(20)
    one = np.asarray(network.truth)
    for truth in (None, np.concatenate([one, one], axis=1)):
        other = Network(network.name, network.time, network.rss_db, network.sensors, truth)
        with pytest.raises(ValueError, match="true positions of one transmitter"):
            calibrate(other)
    few = np.where(np.arange(14) < 5, -60.0, np.nan)[None]
    short = Network(network.name, network.time[:1], few, network.sensors[:1], one[:1])
    with pytest.raises(ValueError, match="at least 10 readings"):
        calibrate(short)


def test_track_transmitter_follows_a_walk() -> None:
    known = calibrate(moving(seed=5))
    result = track_transmitter(moving(120), known, tau=4.0)
    assert np.median(result.error[20:]) < 40
    assert np.mean(result.nees[20:] < 5.991) > 0.8


# measured data


def shared() -> Path:
    folder = os.environ.get("ARRIVALS_DATA")
    if folder is None or not (Path(folder) / "rss" / "powder_single_tx.npz").is_file():
        pytest.skip("ARRIVALS_DATA does not name the measured data")
    return Path(folder) / "rss" / "powder_single_tx.npz"


def test_measured_transmitter_snapshots_and_track() -> None:
    single = read_network(shared())
    known = calibrate(single, floor_db=FLOOR_DB)
    assert known.alpha == pytest.approx(2.5, abs=0.1)
    assert float(neper_to_db(known.sigma)) == pytest.approx(6.6, abs=0.3)
    eighth = single.select(np.arange(0, len(single), 8))
    starts = {"strongest": lambda readings: strongest(readings) + 20.0, "centre": centre}
    for start in starts.values():
        far = [distance(snapshot(one, known, start(one)[None])[0], eighth, one.step)
               for one in steps_of(eighth, known)]  # fmt: skip
        assert 145 <= np.median(far) <= 190
    july = int(np.argmax(np.diff(single.time))) + 1
    result = track_transmitter(single.select(np.arange(july, july + 700)), known)
    assert 110 <= np.median(result.error) <= 140
    assert 0.7 <= np.median(result.nees) <= 2


def distance(place: Float, network: Network, step: int) -> float:
    assert network.truth is not None
    return float(np.hypot(*(place - network.truth[step, 0])))
