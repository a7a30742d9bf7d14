"""The command line on arrays in a plane, several frequencies and windows a step."""

import io
import os
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_rejected, table
from scipy.io import wavfile

from arrivals.__main__ import main
from arrivals.measurement_models import SensorArray

PLANE = {
    "uca": 'kind = "uca"\nn_sensors = 6\nradius = 0.2\nspeed = 343.0\n',
    "positions": 'kind = "positions"\nspeed = 343.0\npositions = [[0.2, 0.0], [0.1, 0.173205],'
    " [-0.1, 0.173205], [-0.2, 0.0], [-0.1, -0.173205], [0.1, -0.173205]]\n",
}
AZIMUTH = 165.0


@pytest.fixture
def plane(here: Path) -> Path:
    """A recording of a band of noise from 165 degrees, on six sensors on a circle, as WAV."""
    for name, text in PLANE.items():
        Path(f"{name}.toml").write_text(text)
    rate, n = 4000, 4096
    rng = np.random.default_rng(1)
    array = SensorArray.uca(6, 0.2)
    towards = np.array([np.cos(np.deg2rad(AZIMUTH)), np.sin(np.deg2rad(AZIMUTH))])
    t = np.arange(n)[:, None] / rate + array.positions @ towards / 343.0
    f, phase = rng.uniform(400, 900, 100), rng.uniform(0, 2 * np.pi, 100)
    x = np.cos(2 * np.pi * t[..., None] * f + phase).sum(axis=-1) / 10
    x += 0.1 * rng.standard_normal(x.shape)
    wavfile.write("plane.wav", rate, (x / 8).astype(np.float32))
    return here


@pytest.mark.parametrize("tracker", ["music", "mvdr", "sbl", "ssbl", "past"])
def test_track_of_a_band_by_other_trackers_finds_the_azimuth(plane: Path, tracker: str) -> None:
    job = ["track", "plane.wav", "--array", "uca.toml", "--band", "450", "850", "--snapshots", "5"]
    by_music = ["--set", "method=music"] if tracker == "past" else []
    assert main([*job, "--hop", "128", "--tracker", tracker, *by_music, "--out", "t.csv"]) == 0
    rows = table(Path("t.csv").read_text())
    assert {int(row["step"]) for row in rows} == set(range(6))
    loudest = [
        max((row for row in rows if int(row["step"]) == k), key=lambda row: float(row["level_db"]))
        for k in range(6)
    ]
    np.testing.assert_allclose([float(row["doa_deg"]) for row in loudest], AZIMUTH, atol=2.0)


@pytest.mark.parametrize("kind", ["uca", "positions"])
@pytest.mark.parametrize(
    ("per_step", "n_steps"),
    [
        (("--frequency", "700"), 16),
        (("--frequencies", "500", "600", "700"), 16),
        (("--band", "450", "850"), 16),
        (("--frequency", "700", "--snapshots", "4"), 4),
        (("--band", "450", "850", "--snapshots", "5", "--hop", "128"), 6),
    ],
)
@pytest.mark.parametrize("tracker", ["svalse", "cbf"])
def test_track_of_a_planar_array_follows_the_azimuth(
    plane: Path, kind: str, per_step: tuple[str, ...], n_steps: int, tracker: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    job = [
        "track",
        "plane.wav",
        "--array",
        f"{kind}.toml",
        *per_step,
        "--tracker",
        tracker,
    ]
    assert main([*job, "--out", "t.csv", "--plot", "t.png"]) == 0
    printed, message = capsys.readouterr()
    assert printed == ""
    assert message.count("\n") == ("--band" in per_step and "--snapshots" not in per_step)
    rows = table(Path("t.csv").read_text())
    assert {int(row["step"]) for row in rows} == set(range(n_steps))
    loudest = [
        max((row for row in rows if int(row["step"]) == k), key=lambda row: float(row["level_db"]))
        for k in range(n_steps)
    ]
    estimate = np.array([float(row["doa_deg"]) for row in loudest])
    assert np.median(np.abs(estimate - AZIMUTH)) < 4
    assert Path("t.png").stat().st_size > 1000


@pytest.mark.parametrize(
    "per_step",
    [
        ("--frequencies", "500", "700", "--snapshots", "3"),
        ("--band", "450", "850", "--window", "200", "--hop", "111", "--snapshots", "2"),
    ],
)
def test_stream_of_several_per_step_equals_the_file(
    plane: Path, per_step: tuple[str, ...], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    job = ["--array", "uca.toml", *per_step, "--quiet"]
    assert main(["track", "plane.wav", *job]) == 0
    expected = capsys.readouterr().out
    samples = wavfile.read("plane.wav")[1].astype("<f4").tobytes()
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(samples)))
    assert main(["track", "-", *job, "--rate", "4000", "--dtype", "float32"]) == 0
    assert capsys.readouterr().out == expected
    assert len(expected.splitlines()) > 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--frequencies", "500", "2100"), ("half the rate, 2000 Hz", "got 2100 Hz")),
        (("--frequencies", "500", "-5"), ("frequency must be finite and positive",)),
        (("--band", "450", "2100"), ("half the rate, 2000 Hz", "450 and 2100")),
        (("--band", "850", "450"), ("got 850 and 450",)),
        (("--frequency", "500", "--band", "450", "850"), ("pass only one of --frequency",)),
        (("--frequency", "500", "--snapshots", "0"), ("snapshots must be at least 1",)),
        (("--frequency", "500", "--snapshots", "99"), ("16 snapshots; one step requires 99",)),
        (
            ("--frequencies", "500", "700", "--tracker", "esprit"),
            ("requires a line of sensors on a uniform grid", "in 2 dimension"),
        ),
    ],
)
def test_track_of_several_bins_with_invalid_arguments_prints_one_line(
    plane: Path, arguments: tuple[str, ...], words: tuple[str, ...],
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    job = ["track", "plane.wav", "--array", "uca.toml", "--out", "t.csv"]
    assert_rejected([*job, *arguments], capsys, plane, *words)


def test_stream_shorter_than_one_step_is_refused(
    plane: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    job = ["track", "-", "--array", "uca.toml", "--rate", "4000", "--dtype", "float32"]
    several = ["--frequencies", "500", "700", "--snapshots", "9"]
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(bytes(6 * 4 * 600))))
    assert_rejected([*job, *several], capsys, plane, "ended after 2 windows; one step requires 9")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"")))
    complex_frames = ["--dtype", "complex64", "--frequencies", "500", "700"]
    assert_rejected(
        [*job, *complex_frames],
        capsys,
        plane,
        "frequencies must be one for a stream of complex frames",
    )


def test_ambiguous_directions_print_one_warning(
    plane: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = 'kind = "positions"\nspeed = 343.0\npositions = [[0, 0], [0, 1], [1, 0], [1, 1]]\n'
    Path("square.toml").write_text(text + "channels = [1, 2, 3, 4]\n")
    samples = wavfile.read("plane.wav")[1][:, :4]
    wavfile.write("square.wav", 4000, samples)
    job = ["track", "square.wav", "--array", "square.toml", "--frequency", "400", "--out", "t.csv"]
    assert main([*job, "--tracker", "svalse"]) == 0
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert message.startswith("arrivals: warning: directions ")
    assert "are ambiguous: they have the same response at every frequency" in message


def test_infrasound_demo_detects_both_sources_and_none_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Several estimators agree: 320, 250 and 321 degrees from north, or wind alone."""
    assert main(["demo", "brp2012", "--out", str(tmp_path), "--quiet"]) == 0
    names = ["brp2012-cbf.csv", "brp2012-svalse.csv", "brp2012-valse.csv", "brp2012.png"]
    assert sorted(os.listdir(tmp_path)) == names
    assert "240 steps" in capsys.readouterr().out
    rows = table((tmp_path / "brp2012-svalse.csv").read_text())
    time = np.array([float(row["time_s"]) for row in rows])
    doa = np.array([float(row["doa_deg"]) % 360 for row in rows])
    for start, end, expected in ((420, 435, 320), (610, 800, 250), (815, 895, 321)):
        within = (time >= start) & (time <= end)
        assert np.unique(time[within]).size >= (end - start) // 5  # steps of 4.96 s
        assert np.abs(doa[within] - expected).max() < 6.0
    quiet = (time < 410) | (time > 950)
    assert np.unique(time[quiet]).size < 45  # of 130 steps
