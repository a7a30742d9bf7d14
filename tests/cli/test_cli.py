"""The command line: recordings, demos, bands and studies."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import DOA, FREQUENCY, HEADING, RATE, SUBSPACE, pressure, table, track
from scipy.io import wavfile

from arrivals.__main__ import main
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios.demos.swellex96 import demo
from arrivals.scenarios.reproduce.interpolation import table_1
from arrivals.trackers import available


def test_track_of_a_moving_source_has_one_label_within_a_degree(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, "--out", "tracks.csv", "--plot", "tracks.png")) == 0
    assert capsys.readouterr() == ("", "")
    rows = table((here / "tracks.csv").read_text())
    kept = [row for row in rows if row["label"] == rows[0]["label"]]
    assert [int(row["step"]) for row in kept] == list(range(20))
    np.testing.assert_allclose([float(row["doa_deg"]) for row in kept], DOA, atol=1.0)
    assert np.median([float(row["level_db"]) for row in kept]) == pytest.approx(-10.46, abs=0.2)
    assert [float(row["time_s"]) for row in kept[:2]] == [0.016, 0.048]
    assert (here / "tracks.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(os.listdir(here)) == ["tracks.csv", "tracks.png"]


def test_track_without_out_prints_the_table(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, "--tracker", "cbf")) == 0
    printed = capsys.readouterr().out
    main(track(scene, "--tracker", "cbf", "--out", "tracks.csv"))
    assert printed == (here / "tracks.csv").read_text()
    assert printed.startswith(HEADING + "\n")


def test_track_shows_progress_on_a_terminal_unless_quiet(
    scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    main(track(scene, "--tracker", "cbf"))
    assert "20/20" in capsys.readouterr().err
    main(track(scene, "--tracker", "cbf", "--quiet"))
    assert capsys.readouterr().err == ""


def test_track_sets_parameters_by_nested_names(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, "--tracker", "cbf", "--set", "max_sources=1")) == 0
    assert len(table(capsys.readouterr().out)) == 20
    settings = ("--set", "motion__sigma_doa=0.02", "--set", "reference=first")
    assert main(track(scene, *settings)) == 0
    settings = ("--set", "motion__kappa=300", "--set", "motion__sigma_doa=None")
    assert main(track(scene, *settings)) == 0


def test_track_of_complex_snapshots_keeps_their_times(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    array = SensorArray.ula(8, 0.17, speed=343.0)
    model = ArraySnapshot(array, array.wavelength(FREQUENCY), noise=1e-4)
    z = model.simulate(np.deg2rad([[10.0], [11.0]]), 1.0, np.random.default_rng(0))
    np.savez(here / "timed.npz", snapshots=z, time=[3.0, 5.0])
    np.save(here / "bare.npy", z.T)
    assert main(track(here, file="timed.npz", array=str(scene / "array.toml"))) == 0
    assert [float(row["time_s"]) for row in table(capsys.readouterr().out)] == [3.0, 5.0]
    transposed = track(here, "--transpose", file="bare.npy", array=str(scene / "array.toml"))
    assert main([*transposed, "--out", "t.csv", "--plot", "t.png"]) == 0
    rows = table((here / "t.csv").read_text())
    assert [float(row["time_s"]) for row in rows] == [0.0, 1.0]
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], [10, 11], atol=0.3)


@pytest.mark.parametrize("name", SUBSPACE)
def test_track_by_subspace_methods_with_given_number_of_sources(
    scene: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    more = ("--tracker", name, "--set", "n_sources=1", "--set", "forgetting=0.5")
    assert main(track(scene, *more)) == 0
    rows = table(capsys.readouterr().out)
    assert {row["label"] for row in rows} == {"-1"}
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], DOA, atol=2.0)
    assert main(track(scene, "--tracker", name, "--set", "n_sources=8")) == 2
    assert "n_sources must be at most 7" in capsys.readouterr().err


def test_track_of_zeros_says_that_no_source_was_found(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wavfile.write(here / "zeros.wav", RATE, np.zeros((2000, 8), "<i2"))
    for tracker in ("cbf", "mvdr", "svalse", "valse", *SUBSPACE):
        arguments = ("--tracker", tracker, "--out", "t.csv", "--plot", "t.png")
        array = str(scene / "array.toml")
        assert main(track(here, *arguments, file="zeros.wav", array=array)) == 0
        assert capsys.readouterr() == ("", "arrivals: no source was found in 7 steps\n")
        assert (here / "t.csv").read_text() == HEADING + "\n"


def test_track_leaves_out_a_sensor_without_finite_samples(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples = pressure(np.full(1000, 12.0))
    samples[:, 3] = np.inf
    np.savez(here / "lame.npz", samples=samples, rate=RATE)
    assert main(track(here, file="lame.npz", array=str(scene / "array.toml"))) == 0
    rows = table(capsys.readouterr().out)
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], 12.0, atol=0.5)


def test_list_names_all_trackers_arrays_and_scenarios(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    listed = capsys.readouterr().out
    assert all(f"  {name} " in listed for name in [*available(), "uma-8", "svalse_fig4"])
    assert "Peaks of the conventional beamformer" in listed


def test_demo_writes_a_table_of_each_tracker_and_a_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    demo(tmp_path / "new" / "folder", n_steps=10)
    folder = tmp_path / "new" / "folder"
    tables = ["cbf.csv", "svalse-range.csv", "svalse.csv", "valse.csv"]
    assert sorted(os.listdir(folder)) == sorted([*tables, "swellex96-range.png", "swellex96.png"])
    assert str(folder / "swellex96.png") in capsys.readouterr().out
    rows = table((folder / "svalse.csv").read_text())
    loudest = [
        max((row for row in rows if row["step"] == str(k)), key=lambda row: float(row["level_db"]))
        for k in range(10)
    ]
    # the strongest paths of the scene's first steps: BSBSBS, BSBSBSB and BSBSB
    assert all(10 < abs(float(row["doa_deg"])) < 20 for row in loudest)
    with_range = table((folder / "svalse-range.csv").read_text())
    assert list(with_range[0])[-4:-2] == ["range_m", "range_std_m"]


@pytest.fixture
def band(here: Path) -> Path:
    """A recording of a band of noise from 25 degrees, float WAV, and its array."""
    Path("line.toml").write_text('kind = "ula"\nn_sensors = 6\nspacing = 0.05\nspeed = 343.0\n')
    rate, n = 4000, 1500
    rng = np.random.default_rng(1)
    f = rng.uniform(600, 1400, 200)
    phase = rng.uniform(0, 2 * np.pi, 200)
    early = 0.05 * (np.arange(6) - 2.5) * np.sin(np.deg2rad(25.0)) / 343.0
    t = np.arange(n)[:, None] / rate + early
    x = np.cos(2 * np.pi * t[..., None] * f + phase).sum(axis=-1) / 10
    x += 0.1 * rng.standard_normal(x.shape)
    wavfile.write("band.wav", rate, (x / 8).astype(np.float32))
    return here


BAND = ("--array", "line.toml", "--band", "600", "1400", "--tracker", "interpolation_ekf")


def test_track_of_a_band_is_equal_for_wav_and_stream(
    band: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = [*BAND, "--snr", "15", "--hop", "100", "--quiet"]
    assert main(["track", "band.wav", *job, "--out", "t.csv", "--plot", "t.png"]) == 0
    rows = table(Path("t.csv").read_text())
    assert len(rows) == 15
    assert float(rows[-1]["doa_deg"]) == pytest.approx(25.0, abs=1.0)
    assert Path("t.png").stat().st_size > 1000
    samples = wavfile.read("band.wav")[1].astype("<f4").tobytes()
    command = [sys.executable, "-m", "arrivals", "track", "-", *job, "--rate", "4000"]
    live = subprocess.run(
        [*command, "--dtype", "float32"], input=samples, capture_output=True, check=True
    )
    assert table(live.stdout.decode()) == rows


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--frequency", "1000"), "--frequency requires snapshots"),
        (("--window", "64"), "--window requires snapshots"),
        (("--snapshots", "3"), "--snapshots requires snapshots"),
        (
            ("--tracker", "mvdr", "--frequencies", "700"),
            "pass only one of --frequency, --frequencies",
        ),
        (("--tracker", "svalse", "--band", "600", "2500"), "half the rate, 2000 Hz"),
        (("--band", "600", "3000"), "half the rate, 2000 Hz"),
        (("--tracker", "ekf"), "requires motion, measurement, x, P, not an array file"),
        (("--set", "variant=Z"), "variant must be one of 'literal', 'B'"),
    ],
)
def test_track_of_a_band_with_invalid_arguments_is_refused(
    band: Path, more: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["track", "band.wav", *BAND, "--out", "t.csv", *more]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not Path("t.csv").exists()


def test_reproduce_writes_table_page_and_pictures(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table_1, "ANGLES", (15.0, 30.0))
    command = ["reproduce", "interpolation-table1", "--runs", "2", "--jobs", "1", "--out", "found"]
    assert main(command) == 0
    assert Path("found/interpolation-table1.csv").exists()
    assert Path("found/interpolation-table1.md").exists()
    assert main(["reproduce", "interpolation-tabel1"]) == 2
    assert "interpolation-table1" in capsys.readouterr().err
