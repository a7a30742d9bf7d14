"""Fused positions of recordings, ready-made bearings and signal strength, against the truth."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from station_scenes import (
    ARRAY,
    HEADINGS,
    PLACES,
    RATE,
    bearing_rows,
    path_of,
    samples_at,
    stations_file,
    wav_files,
)

import arrivals
from arrivals.measurement_models import ArraySnapshot, SensorArray, Station
from arrivals.motion_models import ConstantVelocity
from arrivals.recordings import Recording, frame_recording, read
from arrivals.recordings.fusion import BearingTable, FusedRun
from arrivals.recordings.fusion.station_recordings import without_start
from arrivals.recordings.networks import Network
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.trackers import Fused
from arrivals.typing import Float

BAND = (500.0, 1500.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write stations and recordings of two sources."""
    folder = tmp_path_factory.mktemp("stations")
    wav_files(folder, n_sources=2)
    stations_file(folder)
    return folder


def errors(run: FusedRun, source: int = 0) -> Float:
    """Return the distance of the nearest position to a source in each step; NaN without one."""
    away = np.linalg.norm(run.position - path_of(run.time, source)[:, None], axis=-1)
    return np.asarray(np.where(np.isnan(away), np.inf, away).min(axis=1))


def table_text(rows: Sequence[tuple[Any, ...]], std: float | None = 1.0) -> str:
    deviation = "" if std is None else f",{std}"
    header = "time_s,station,bearing_deg" + ("" if std is None else ",std_deg")
    lines = (",".join(map(str, row)) + deviation for row in rows)
    return "\n".join([header, *lines])


def bearings_scene(folder: Path, n_sources: int = 1) -> Path:
    (folder / "b.csv").write_text(table_text(bearing_rows(n_sources=n_sources)))
    return stations_file(folder, recorded=False)


def test_recordings_of_two_sources_are_tracked_within_a_decimetre(folder: Path) -> None:
    run = arrivals.fuse(folder / "stations.toml", speed=1.0, q=0.01)
    for source in (0, 1):
        assert np.median(errors(run, source)) < 0.05
    assert run.n_found[10:].min() == 2
    assert run.n_found[10:].mean() < 2.1
    assert (np.bincount(run.label[run.label >= 0]) > len(run) / 2).sum() == 2
    assert run.received[-1, :2].min() > 0.5
    assert run.existence[-1, :2].min() > 0.99
    assert [station.name for station in run.stations] == list(PLACES)
    assert "3 stations (mast, roof, gate); wideband sources, " in run.understood
    assert " bins: --tracker wideband_mixture --band 280.094 " in run.understood
    assert f"{len(run)} steps of 0.064 s; --speed 1 --q 0.01" in run.understood


def test_bearings_of_the_last_step_pass_the_last_positions(folder: Path) -> None:
    run = arrivals.fuse(folder / "stations.toml", band=BAND, window=256, snapshots=16,
                        tracker="svalse", speed=1.0)  # fmt: skip
    for station, azimuths in zip(run.stations, run.bearings, strict=True):
        d = run.position[-1] - station.position
        assert azimuths is not None
        apart = np.angle(np.exp(1j * (np.arctan2(*d.T[::-1])[:, None] - azimuths)))
        assert np.abs(apart).min(axis=1).max() < np.deg2rad(3)


def test_fuse_equals_the_tracker_on_framed_recordings(folder: Path) -> None:
    settings: dict[str, Any] = {"window": 256, "hop": 128, "snapshots": 30}
    frequencies = [562.5, 750.0, 1000.0]
    run = arrivals.fuse(folder / "stations.toml", frequencies=frequencies, tracker="svalse",
                        speed=1.0, q=0.01, area=(0, 0, 30, 30), **settings)  # fmt: skip
    model = ArraySnapshot(ARRAY, [343.0 / f for f in frequencies], n_snapshots=30)
    stations = [Station(model, place, np.deg2rad(HEADINGS[name]), name=name)
                for name, place in PLACES.items()]  # fmt: skip
    frames = [
        frame_recording(read(folder / f"{name}.wav"), frequencies, window=256, hop=128,
                        n_snapshots=30)
        for name in PLACES
    ]  # fmt: skip
    tracker = Fused(ConstantVelocity(0.01), stations, area=(0, 0, 30, 30), speed_std=1.0)
    expected = tracker.run(zip(*(each.values for each in frames), strict=True), dt=30 * 128 / RATE)
    np.testing.assert_allclose(run.time, frames[0].time)
    np.testing.assert_allclose(run.position, expected.position)
    np.testing.assert_allclose(run.covariance, expected.covariance)


def test_recordings_that_begin_at_other_times_have_steps_of_common_time(tmp_path: Path) -> None:
    starts = {"mast": 0.0, "roof": 1.4, "gate": 2.13}
    wav_files(tmp_path, starts)
    more = {name: f"start_s = {start}" for name, start in starts.items()}
    path = stations_file(tmp_path, more=more)
    run = arrivals.fuse(path, band=BAND, window=256, snapshots=8, tracker="svalse", speed=1.0)
    np.testing.assert_allclose(np.diff(run.time), 256 * 8 / RATE)
    present = [run.received[run.time < starts[name], :, k] for k, name in enumerate(PLACES)]
    assert all((each == 0).all() for each in present)
    found = errors(run)[np.isfinite(errors(run))]
    assert len(found) > 15
    assert np.median(found) < 0.08
    # steps that were not aligned would be 0.1 s, and positions 0.1 m, apart
    ahead = (run.position[:, 0] - path_of(run.time)) @ [0.87, 0.49]
    assert abs(np.nanmedian(ahead)) < 0.03


def test_stored_samples_without_their_start_stay_in_their_file() -> None:
    numbers = np.arange(40.0).reshape(20, 2)
    stored = StoredSamples((20, 2), np.dtype(float), lambda start, stop: numbers[start:stop])
    late = without_start(Recording(stored, 10.0), 7)
    assert isinstance(late.samples, StoredSamples)
    np.testing.assert_array_equal(late.samples[:], numbers[7:])
    np.testing.assert_array_equal(late.samples[3:5], numbers[10:12])


def test_arrays_and_recordings_may_be_objects_with_settings_by_name() -> None:
    recordings = [Recording(samples_at(name, duration=2.0), RATE) for name in PLACES]
    keys = [{"name": name, "x_m": x, "y_m": y, "heading_deg": HEADINGS[name]}
            for name, (x, y) in PLACES.items()]  # fmt: skip
    options: dict[str, Any] = {"motion__p_activate": 0.2, "hypotheses__challenge": 5}
    run = arrivals.fuse({"station": keys, "array": ARRAY}, recordings, tracker="svalse",
                        band=BAND, snapshots=4, **options)  # fmt: skip
    assert "--set motion__p_activate=0.2" in run.understood
    assert np.median(errors(run)) < 0.2


def test_complex_snapshots_of_a_radio_are_fused() -> None:
    rng = np.random.default_rng(0)
    circle = SensorArray.uca(8, radius=0.45, speed=3e8)
    frequency, rate, n = 433e6, 100.0, 600
    places = {"a": (100.0, 100.0), "b": (900.0, 150.0), "c": (450.0, 900.0)}
    source, recordings, keys = np.array([520.0, 400.0]), [], []
    for name, place in places.items():
        azimuth = np.arctan2(*(source - place)[::-1])
        a = circle.steering_vector(azimuth - 0.3, 3e8 / frequency)
        w = [1, 1j] @ rng.standard_normal((2, n))
        noise = rng.standard_normal((2, n, 8))
        recordings.append(Recording(w[:, None] * a + 0.3 * (noise[0] + 1j * noise[1]), rate))
        keys.append({"name": name, "x_m": place[0], "y_m": place[1], "array": circle,
                     "heading_deg": np.rad2deg(0.3)})  # fmt: skip
    run = arrivals.fuse({"station": keys, "frequency": frequency, "snapshots": 20}, recordings)
    assert len(run) == n / 20
    assert run.time[0] == pytest.approx(0.095)
    assert np.linalg.norm(run.position[-1] - source, axis=-1).max() < 5
    assert "--speed 20" not in run.understood  # a hundredth of 800 m and half of it at each end
    assert "--speed 16 --q 2.56" in run.understood


def test_lines_are_fused_although_each_has_a_mirror_image() -> None:
    rng, line = np.random.default_rng(0), SensorArray.ula(8, spacing=0.1, speed=343.0)
    source = np.array([12.0, 9.0])
    places = {"a": (0.0, 0.0, 20.0), "b": (25.0, 2.0, 100.0), "c": (8.0, 25.0, -10.0),
              "d": (24.0, 22.0, 60.0)}  # fmt: skip
    recordings, keys = [], []
    for name, (x, y, degrees) in places.items():
        doa = np.pi / 2 - (np.arctan2(*(source - [x, y])[::-1]) - np.deg2rad(degrees))
        a = line.steering_vector(np.arcsin(np.sin(doa)), 343.0 / 1000)
        w, noise = [1, 1j] @ rng.standard_normal((2, 200)), rng.standard_normal((2, 200, 8))
        recordings.append(Recording(w[:, None] * a + 0.2 * (noise[0] + 1j * noise[1]), 20.0))
        keys.append({"name": name, "x_m": x, "y_m": y, "array": line, "heading_deg": degrees})
    run = arrivals.fuse({"station": keys}, recordings, frequencies=1000.0, snapshots=10)
    assert run.n_found[-1] == 1
    assert np.linalg.norm(run.position[-1, 0] - source) < 0.5


def test_bearings_equal_the_tracker_on_azimuths(tmp_path: Path) -> None:
    run = arrivals.fuse(bearings_scene(tmp_path, n_sources=2), bearings=tmp_path / "b.csv",
                        speed=1.0, q=0.02, area=(0, 0, 30, 30))  # fmt: skip
    tracker = Fused(ConstantVelocity(0.02), run.stations, area=(0, 0, 30, 30), speed_std=1.0)
    rows = np.array([(b + HEADINGS[name]) for _, name, b in bearing_rows(n_sources=2)])
    steps = np.deg2rad(rows).reshape(12, 3, 2)
    z = [[(azimuth, np.full(2, np.deg2rad(1.0) ** 2)) for azimuth in step] for step in steps]
    expected = tracker.run(z, dt=1.0)
    np.testing.assert_allclose(run.position, expected.position, atol=1e-6)
    np.testing.assert_allclose(run.existence, expected.existence, atol=1e-6)
    assert np.median(errors(run)) < 0.5
    assert np.median(errors(run, 1)) < 0.5


def test_compass_bearings_give_the_same_positions(tmp_path: Path) -> None:
    path = bearings_scene(tmp_path)
    expected = arrivals.fuse(path, bearings=tmp_path / "b.csv")
    rows = [(t, name, 90 - (b + HEADINGS[name])) for t, name, b in bearing_rows()]
    (tmp_path / "north.csv").write_text(table_text(rows))
    more = dict.fromkeys(PLACES, 'bearings = "compass"')
    run = arrivals.fuse(stations_file(tmp_path, recorded=False, more=more),
                        bearings=tmp_path / "north.csv")  # fmt: skip
    np.testing.assert_allclose(run.position, expected.position, atol=1e-6)


def test_scattered_bearings_are_tracked_in_intervals(tmp_path: Path) -> None:
    late = {"mast": 0.0, "roof": 0.27, "gate": 0.61}
    rows = []
    for time in np.arange(20.0):
        for name, place in PLACES.items():
            d = path_of(np.array([time + late[name]]))[0] - place
            rows.append((time + late[name], name, np.rad2deg(np.arctan2(d[1], d[0]))
                         - HEADINGS[name]))  # fmt: skip
    (tmp_path / "b.csv").write_text(table_text(rows, None))
    path = stations_file(tmp_path, recorded=False)
    run = arrivals.fuse(path, bearings=tmp_path / "b.csv", speed=1.0)
    assert "21 steps of 1 s" in run.understood
    assert "no deviations: 3 degrees assumed" in run.understood
    assert np.median(errors(run)) < 0.5
    slow = arrivals.fuse(path, bearings=tmp_path / "b.csv", step=4.0)
    assert len(slow) == 6


def test_bearings_and_recordings_are_fused_together(folder: Path, tmp_path: Path) -> None:
    rows = [row for row in bearing_rows(6, 2) if row[1] == "gate"]
    (tmp_path / "gate.csv").write_text(table_text(rows))
    run = arrivals.fuse(folder / "stations.toml", bearings=tmp_path / "gate.csv", speed=1.0,
                        tracker="svalse", band=BAND, window=256, snapshots=16)  # fmt: skip
    assert run.stations[2].measurement is None
    assert run.stations[0].measurement is not None
    received_at = run.received[..., 2].max(axis=1) > 0.5
    assert 3 <= received_at.sum() <= 6  # one step in two has a bearing of the gate
    for source in (0, 1):
        assert np.median(errors(run, source)[2:]) < 0.3


def readings(n_steps: int, rng: np.random.Generator) -> tuple[Float, Float]:
    """Return sensors, and levels of source 0, dB, with -97 dB of noise."""
    sensors = rng.uniform(0, 35, (8, 2))
    away = np.linalg.norm(path_of(np.arange(float(n_steps)))[:, None] - sensors, axis=-1)
    level = 10 * np.log10(10 ** (-3 - 3 * np.log10(np.maximum(away, 0.5))) + 10**-9.7)
    return sensors, level + rng.normal(0, 2.0, level.shape)


def test_one_array_and_signal_strength_give_positions() -> None:
    rng = np.random.default_rng(1)
    sensors, level = readings(20, rng)
    d = path_of(np.arange(20.0)) - PLACES["mast"]
    azimuth = np.arctan2(*d.T[::-1]) + rng.normal(0, 0.01, 20)
    table = BearingTable(np.arange(20.0), np.zeros(20, dtype=np.int64), azimuth, np.full(20, 1e-4))
    keys = {"name": "mast", "x_m": 4.0, "y_m": 5.0, "heading_deg": 0.0}
    network = Network.fixed(list("abcdefgh"), sensors, level, np.arange(20.0) + 0.2)
    run = arrivals.fuse({"station": [keys]}, bearings=table, rss=network, alpha=3, sigma=2,
                        floor=-97, power=-30, speed=1.0, q=0.01)  # fmt: skip
    assert np.median(errors(run)[5:]) < 3
    assert np.isfinite(run.log_amplitude[-1, 0])
    np.testing.assert_array_equal(run.sensors, sensors)
    assert "signal strength: --alpha 3" in run.understood


def test_table_without_a_station_of_the_file_is_a_warning(tmp_path: Path) -> None:
    path = bearings_scene(tmp_path)
    rows = [row for row in bearing_rows() if row[1] != "gate"]
    (tmp_path / "b.csv").write_text(table_text(rows))
    with pytest.warns(UserWarning, match="station 'gate' has no bearings"):
        run = arrivals.fuse(path, bearings=tmp_path / "b.csv")
    assert run.received[..., 2].max() == 0
    assert np.median(errors(run)[3:]) < 0.6
