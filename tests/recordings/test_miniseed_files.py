"""Seismic traces of miniSEED files."""

from pathlib import Path
from typing import Any

import numpy as np
import pymseed
import pytest
from numpy.testing import assert_array_equal

import arrivals
from arrivals.recordings import read
from arrivals.recordings.formats.file_contents import ReadingOptions
from arrivals.recordings.formats.miniseed import read_miniseed

START = 1_500_000_000_000_000_000  # ns
STEP = 50_000_000  # ns, of 20 Hz
X = np.random.default_rng(0).integers(-1000, 1000, (2000, 3)).astype("i4")


def write(path: Path, *traces: tuple[str, float, Any], rate: float = 20.0) -> Path:
    """Write traces (name NET.STA.LOC.CHA, first sample, samples) in records of 512 bytes."""
    file = pymseed.MS3TraceList()
    for name, first, samples in traces:
        source = pymseed.nslc2sourceid(*name.split("."))
        kind = {"i": "i", "f": "f" if samples.dtype.itemsize == 4 else "d"}[samples.dtype.kind]
        start = START + round(first * STEP)
        file.add_data(source, samples, kind, rate, starttime=start)
    file.to_file(path, max_record_length=512)
    return path


def test_traces_are_aligned_by_time_and_gaps_are_missing(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.mseed",
        ("XX.C..SHZ", 30, X[30:, 2]), ("XX.A..SHZ", 0, X[:, 0]),
        ("XX.B..SHZ", 0, X[:700, 1]), ("XX.B..SHZ", 900, X[900:1999, 1]),
    )  # fmt: skip
    expected = X.astype(float)
    expected[:30, 2] = expected[700:900, 1] = expected[1999:, 1] = np.nan
    contents = read_miniseed(path, ReadingOptions())
    assert (contents.rate, contents.note) == (20.0, None)
    assert contents.names == ("XX.A..SHZ", "XX.B..SHZ", "XX.C..SHZ")
    assert_array_equal(contents.array[:], expected)
    for start, stop in ((0, 1), (650, 950), (1990, 2000), (5, 5)):
        assert_array_equal(contents.array[start:stop], expected[start:stop])
    recording = read(path)
    assert_array_equal(recording.samples, expected)
    assert recording.names == contents.names


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_reals_are_unchanged(tmp_path: Path, kind: str) -> None:
    x = np.random.default_rng(1).random(500).astype(kind)
    path = write(tmp_path / "a.mseed", ("XX.A..SHZ", 0, x))
    assert_array_equal(read(path).samples[:, 0], x)


def test_small_clock_offset_is_noted(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mseed", ("XX.A..SHZ", 0, X[:, 0]), ("XX.B..SHZ", 0.3, X[:, 1]))
    contents = read_miniseed(path, ReadingOptions())
    assert contents.note == "clocks differ by up to 0.30 of a sample, 15 ms"
    assert_array_equal(contents.array[:], X[:, :2])
    small = write(tmp_path / "b.mseed", ("XX.A..SHZ", 0, X[:, 0]), ("XX.B..SHZ", 0.02, X[:, 1]))
    assert read_miniseed(small, ReadingOptions()).note is None


def test_one_component_is_selected(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.mseed",
        ("XX.A.00.SHZ", 0, X[:, 0]), ("XX.A.00.SHN", 0, X[:, 1]), ("XX.A.10.SHZ", 0, X[:, 2]),
        ("XX.B..SHN", 0, X[:, 0]),
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"several components: .* one of SHN, SHZ$"):
        read(path)
    assert read(path, variable="SHN").names == ("XX.A.00.SHN", "XX.B..SHN")
    with pytest.raises(ValueError, match=r"a station has several traces: .* one of 00.SHZ, 10.SHZ"):
        read(path, variable="SHZ")
    assert_array_equal(read(path, variable="10.SHZ").samples[:, 0], X[:, 2])
    with pytest.raises(ValueError, match=r"must be one of .*; got 'BHZ'"):
        read(path, variable="BHZ")


def test_different_rates_are_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.mseed", ("XX.A..SHZ", 0, X[:, 0]))
    write(tmp_path / "b.mseed", ("XX.B..SHZ", 0, X[:, 0]), rate=40.0)
    both = tmp_path / "c.mseed"
    both.write_bytes((tmp_path / "a.mseed").read_bytes() + (tmp_path / "b.mseed").read_bytes())
    with pytest.raises(ValueError, match="several rates, 20, 40 Hz: resample them"):
        read(both)


def test_records_of_different_years_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mseed", ("XX.A..SHZ", 0, X[:, 0]), ("XX.A..SHZ", 1e9, X[:, 0]))
    with pytest.raises(ValueError, match=r"too far apart: 4000 samples a trace in 5e.07 s"):
        read(path)


def test_damaged_file_is_refused(tmp_path: Path) -> None:
    whole = write(tmp_path / "a.mseed", ("XX.A..SHZ", 0, X[:, 0])).read_bytes()
    for content in (whole[:-100], whole[:100], b"abc" * 100, whole[:512] + b"abc" * 200):
        (tmp_path / "b.mseed").write_bytes(content)
        with pytest.raises(ValueError, match=r"b\.mseed: truncated, or not a miniSEED file: "):
            read(tmp_path / "b.mseed")
    (tmp_path / "b.mseed").write_bytes(whole[:200] + bytes(300) + whole[500:])
    with pytest.raises(ValueError, match=r"b\.mseed: "):
        read(tmp_path / "b.mseed")


def test_wrong_suffix_is_read_by_its_content(tmp_path: Path) -> None:
    path = write(tmp_path / "a.dat", ("XX.A..SHZ", 0, X[:, 0]))
    with pytest.warns(UserWarning, match="read as miniSEED"):
        assert read(path).rate == 20.0


def test_wave_across_stations_is_tracked_in_compass_bearings(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    places = rng.uniform(-6e3, 6e3, (9, 2))
    bearing, speed, t = np.deg2rad(305.0), 16e3, np.arange(1200)[:, None] / 20
    ahead = places @ [np.sin(bearing), np.cos(bearing)] / speed  # s earlier than at the origin
    phases = rng.uniform(0, 2 * np.pi, 60)
    waves = [
        np.cos(2 * np.pi * f * (t + ahead) + phase)
        for f, phase in zip(np.linspace(0.5, 5, 60), phases, strict=True)
    ]
    counts = (100 * np.sum(waves, axis=0) + 20 * rng.standard_normal((1200, 9))).astype("i4")
    names = [f"S{i}" for i in range(9)]
    traces = [(f"XX.{n}..SHZ", 0, x) for n, x in zip(names, counts.T, strict=True)]
    write(tmp_path / "a.mseed", *traces)
    rows = "".join(f"{n},{x},{y}\n" for n, (x, y) in zip(names, places, strict=True))
    (tmp_path / "s.csv").write_text("name,x_m,y_m\n" + rows)
    keys = 'kind = "stations"\nstations = "s.csv"\nspeed = 16000.0\nclockwise = true\n'
    (tmp_path / "a.toml").write_text(keys)
    run = arrivals.track(tmp_path / "a.mseed", tmp_path / "a.toml")
    bearings = np.rad2deg(run.doa[np.isfinite(run.doa)]) % 360
    assert len(bearings) > 5
    assert abs(np.median(bearings) - 305) < 2


def test_check_names_the_channels_of_stations(tmp_path: Path) -> None:
    silent = np.zeros(2000, "i4")
    path = write(
        tmp_path / "a.mseed",
        ("XX.A..SHZ", 0, X[:, 0]), ("XX.B..SHZ", 0, silent), ("XX.C..SHZ", 0, X[:, 2]),
    )  # fmt: skip
    (tmp_path / "s.csv").write_text("name,x_m,y_m\nC,0,0\nB,900,0\nD,0,900\n")
    keys = 'kind = "stations"\nstations = "s.csv"\nspeed = 6000.0\n'
    (tmp_path / "array.toml").write_text(keys)
    with pytest.warns(UserWarning, match="are left out"):
        report = arrivals.check(path, tmp_path / "array.toml")
    assert [each.channel for each in report.channels] == [3, 2]
    assert [(each.kind, each.channels) for each in report.faults] == [("silent", (2,))]
