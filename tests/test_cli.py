import csv
import io
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

from arrivals.__main__ import main
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.scenarios.demo import demo
from arrivals.trackers import available

RATE, FREQUENCY, WINDOW = 8000, 1000.0, 256
ARRAY = 'kind = "ula"\nn_sensors = 8\nspacing = 0.17\nspeed = 343.0\n'
DOA = np.linspace(-8.0, 12.0, 20)  # degrees, one a window
SUBSPACE = ("music", "root_music", "esprit", "past")
HEADING = "step,time_s,label,doa_deg,std_deg,existence,level_db"
SHELL = [sys.executable, "-W", "error", "-m", "arrivals"]


def pressure(doa: Any, n_sensors: int = 8) -> Any:
    """Return samples of a tone whose direction changes slowly, in noise: (n_samples, n_sensors)."""
    rng = np.random.default_rng(0)
    array = SensorArray.ula(n_sensors, 0.17, speed=343.0)
    a = array.steering_vector(np.deg2rad(doa), array.wavelength(FREQUENCY))
    turn = np.exp(2j * np.pi * FREQUENCY * np.arange(len(a)) / RATE)
    return 0.3 * (turn[:, None] * a).real + 0.1 * rng.standard_normal(a.shape)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a folder with an array file, and one moving source as WAV and as raw samples."""
    folder = tmp_path_factory.mktemp("scene")
    (folder / "array.toml").write_text(ARRAY)
    at = (np.arange(len(DOA) * WINDOW) - WINDOW / 2) / WINDOW
    samples = pressure(np.interp(at, np.arange(len(DOA)), DOA))
    counts = np.rint(samples * 32768).astype("<i2")
    wavfile.write(folder / "tow.wav", RATE, counts)
    (folder / "tow.raw").write_bytes(counts.tobytes())
    return folder


@pytest.fixture
def here(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def track(scene: Path, *more: str, file: str = "tow.wav", array: str = "array.toml") -> list[str]:
    return ["track", str(scene / file) if file != "-" else "-", "--array", str(scene / array),
            "--frequency", "1000", *more]  # fmt: skip


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


# -- the main job --------------------------------------------------------------------------


def test_a_moving_source_in_a_wav_is_tracked_within_a_degree_under_one_label(
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


def test_without_out_the_table_goes_to_standard_output(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, "--tracker", "cbf")) == 0
    printed = capsys.readouterr().out
    main(track(scene, "--tracker", "cbf", "--out", "tracks.csv"))
    assert printed == (here / "tracks.csv").read_text()
    assert printed.startswith(HEADING + "\n")


def test_progress_is_shown_on_a_terminal_and_not_if_it_is_not_wanted(
    scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    main(track(scene, "--tracker", "cbf"))
    assert "20/20" in capsys.readouterr().err
    main(track(scene, "--tracker", "cbf", "--quiet"))
    assert capsys.readouterr().err == ""


def test_parameters_are_set_by_nested_names(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, "--tracker", "cbf", "--set", "max_sources=1")) == 0
    assert len(table(capsys.readouterr().out)) == 20
    settings = ("--set", "motion__sigma_doa=0.02", "--set", "reference=first")
    assert main(track(scene, *settings)) == 0
    settings = ("--set", "motion__kappa=300", "--set", "motion__sigma_doa=None")
    assert main(track(scene, *settings)) == 0


def test_complex_snapshots_of_a_file_need_no_rate_and_their_time_is_kept(
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
def test_subspace_methods_track_with_the_number_of_sources_given(
    scene: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    more = ("--tracker", name, "--set", "n_sources=1", "--set", "forgetting=0.5")
    assert main(track(scene, *more)) == 0
    rows = table(capsys.readouterr().out)
    assert {row["label"] for row in rows} == {"-1"}
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], DOA, atol=2.0)
    assert main(track(scene, "--tracker", name, "--set", "n_sources=8")) == 2
    assert "n_sources must be at most 7" in capsys.readouterr().err


def test_silence_holds_no_sources_and_makes_no_noise(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wavfile.write(here / "silence.wav", RATE, np.zeros((2000, 8), "<i2"))
    for tracker in ("cbf", "mvdr", "svalse", "valse", *SUBSPACE):
        arguments = ("--tracker", tracker, "--out", "t.csv", "--plot", "t.png")
        array = str(scene / "array.toml")
        assert main(track(here, *arguments, file="silence.wav", array=array)) == 0
        assert capsys.readouterr() == ("", "")
        assert (here / "t.csv").read_text() == HEADING + "\n"


def test_a_sensor_without_finite_samples_is_left_out(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples = pressure(np.full(1000, 12.0))
    samples[:, 3] = np.inf
    np.savez(here / "lame.npz", samples=samples, rate=RATE)
    assert main(track(here, file="lame.npz", array=str(scene / "array.toml"))) == 0
    rows = table(capsys.readouterr().out)
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], 12.0, atol=0.5)


def test_list_names_all_trackers_and_scenarios(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    listed = capsys.readouterr().out
    assert all(f"  {name} " in listed for name in [*available(), "svalse_fig4"])
    assert "Peaks of the conventional beamformer" in listed


def test_the_demo_leaves_a_table_of_each_tracker_and_a_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    demo(tmp_path / "new" / "folder", n_steps=10)
    folder = tmp_path / "new" / "folder"
    assert sorted(os.listdir(folder)) == ["cbf.csv", "svalse.csv", "swellex96.png", "valse.csv"]
    assert str(folder / "swellex96.png") in capsys.readouterr().out
    rows = table((folder / "svalse.csv").read_text())
    loudest = [
        max((row for row in rows if row["step"] == str(k)), key=lambda row: float(row["level_db"]))
        for k in range(10)
    ]
    # the strongest paths of the scene's first steps: BSBSBS, BSBSBSB and BSBSB
    assert all(10 < abs(float(row["doa_deg"])) < 20 for row in loudest)


# -- streams -------------------------------------------------------------------------------


def shell(arguments: list[str], **more: Any) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([*SHELL, *arguments], capture_output=True, timeout=60, **more)


def test_a_stream_gives_the_numbers_of_the_file_and_drops_the_tail(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    windows = ("--window", "300", "--hop", "170")
    main(track(scene, *windows))
    expected = capsys.readouterr().out
    live = track(scene, *windows, "--rate", str(RATE), file="-")
    raw = (scene / "tow.raw").read_bytes()
    done = shell(live, input=raw + b"\x01\x02\x03")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.decode() == expected
    done = shell([*live, "--out", "live.csv"], input=raw)
    assert (done.returncode, done.stdout) == (0, b"")
    assert (here / "live.csv").read_text() == expected


@pytest.mark.parametrize(
    ("dtype", "hop"), [("int32", 512), ("float32", 100), ("float64", 256), ("int16", 999)]
)
def test_every_type_of_sample_and_any_hop_gives_what_the_file_gives(
    dtype: str, hop: int, scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    samples = pressure(np.linspace(-10, 10, 3000))
    whole = np.dtype(dtype).kind == "i"
    scale = 2.0 ** (8 * np.dtype(dtype).itemsize - 1) if whole else 1.0
    samples = (samples * scale).astype(dtype)
    wavfile.write(here / "a.wav", RATE, samples)
    more = ("--tracker", "cbf", "--hop", str(hop))
    main(track(here, *more, file="a.wav", array=str(scene / "array.toml")))
    expected = capsys.readouterr().out
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(samples.tobytes())))
    assert main(track(scene, *more, "--rate", str(RATE), "--dtype", dtype, file="-")) == 0
    assert capsys.readouterr().out == expected
    assert len(expected.splitlines()) > 2


@pytest.mark.parametrize("dtype", ["complex64", "complex128"])
def test_each_complex_frame_is_a_snapshot(
    dtype: str, scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    array = SensorArray.ula(8, 0.17, speed=343.0)
    z = array.steering_vector(np.deg2rad([5.0, 6.0]), array.wavelength(FREQUENCY)).astype(dtype)
    z[0, 2] = np.inf
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(z.tobytes())))
    more = ("--tracker", "cbf", "--set", "max_sources=1", "--dtype", dtype)
    assert main(track(scene, *more, file="-")) == 0
    rows = table(capsys.readouterr().out)
    assert [float(row["time_s"]) for row in rows] == [0.0, 1.0]
    np.testing.assert_allclose([float(row["doa_deg"]) for row in rows], [5, 6], atol=0.5)


@pytest.fixture
def live(scene: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Start a live tracker."""
    arguments = track(scene, "--rate", str(RATE), file="-")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([*SHELL, *arguments], **pipes) as process:  # type: ignore[call-overload]
        yield process
        process.kill()


def feed(process: subprocess.Popen[bytes], scene: Path) -> bytes:
    """Give it three windows, and take its heading and the line that shows that it runs."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write((scene / "tow.raw").read_bytes()[: 3 * WINDOW * 16])
    process.stdin.flush()
    return process.stdout.readline() + process.stdout.readline()


def test_estimates_come_while_the_stream_goes_on_and_an_interrupt_leaves_them_whole(
    live: subprocess.Popen[bytes], scene: Path
) -> None:
    first = feed(live, scene)
    assert first.decode().startswith(HEADING + "\n0,0.016,0,")
    live.send_signal(signal.SIGINT)
    assert live.stdout is not None
    assert live.stderr is not None
    rest = live.stdout.read()
    assert live.wait(timeout=30) == 130
    assert live.stderr.read() == b""
    lines = (first + rest).decode()
    assert lines.endswith("\n")
    assert all(line.count(",") == 6 for line in lines.splitlines())


def test_a_reader_that_has_seen_enough_ends_it_quietly(
    live: subprocess.Popen[bytes], scene: Path
) -> None:
    feed(live, scene)
    assert live.stdout is not None
    assert live.stdin is not None
    assert live.stderr is not None
    live.stdout.close()
    live.stdin.write((scene / "tow.raw").read_bytes()[: 3 * WINDOW * 16])
    live.stdin.flush()
    assert live.wait(timeout=30) == 0
    assert live.stderr.read() == b""


# -- bad input -----------------------------------------------------------------------------


def refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str], here: Path, *words: str
) -> None:
    """Check that there is one line with these words, status 2, and nothing new in the folder."""
    before = sorted(os.listdir(here))
    assert main(arguments) == 2
    printed, told = capsys.readouterr()
    assert printed == ""
    assert told.startswith("arrivals: ")
    assert told.count("\n") == 1
    assert told.endswith("\n")
    for word in words:
        assert word in told
    assert sorted(os.listdir(here)) == before


OUT = ("--out", "tracks.csv", "--plot", "tracks.png")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--frequency", "1010"), ("alias limit, 1008.82 Hz", "got 1010 Hz")),
        (("--frequency", "1010", "--tracker", "cbf"), ("alias limit, 1008.82 Hz",)),
        (("--frequency", "-5"), ("frequency must be finite and positive",)),
        (("--frequency", "high"), ("invalid float value: 'high'",)),
        (("--tracker", "svlase"), ("no tracker 'svlase'", "did you mean svalse")),
        (("--set", "kapa=3"), ("no parameter 'kapa'",)),
        (("--set", "motion__kapa=3"), ("no parameter 'kapa'",)),
        (("--set", "motion=3"), ("motion must be a BernoulliVonMises; got 3",)),
        (("--set", "merge"), ("NAME=VALUE",)),
        (("--set", "tolerance=small"), ("tolerance must be a number; got 'small'",)),
        (("--window", "1"), ("window must be at least 2",)),
        (("--window", "100000"), ("one window takes 100000",)),
        (("--hop", "0"), ("hop must be at least 1",)),
        (("--out", "nowhere/tracks.csv"), ("nowhere: the folder does not exist",)),
        (("--plot", "nowhere/tracks.png"), ("nowhere: the folder does not exist",)),
        (("--plot", "tracks.xyz"), (".png", "'.xyz'")),
        (("--out", "."), ("this is a folder",)),
        (("--variable", "z"), ("variable is for npz and mat",)),
        (("--dtype", "int16"), ("--dtype goes with samples from standard input",)),
        (("--frobnicate",), ("unrecognized arguments",)),
    ],
)
def test_a_wrong_argument_is_told_in_one_line(
    arguments: tuple[str, ...], words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    refused(track(scene, *OUT, *arguments), capsys, here, *words)


def test_nyquist_is_named_where_the_array_would_allow_more(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "fine.toml").write_text(ARRAY.replace("0.17", "0.01"))
    arguments = track(scene, *OUT, "--frequency", "4500", array=str(here / "fine.toml"))
    refused(arguments, capsys, here, "frequency", "4000 Hz", "got 4500 Hz")


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        (ARRAY.replace("n_sensors = 8", "n_sensors = 6"), ("6 channels", "recording has 8")),
        (ARRAY.replace("spacing = 0.17\n", ""), ("needs the key 'spacing'",)),
        (ARRAY.replace("speed = 343.0\n", ""), ("'speed' is missing",)),
        (ARRAY.replace('kind = "ula"\n', ""), ("'kind' is missing",)),
        ('kind = "positions"\nspeed = 343.0\npositions = [0, 1, 1]\n', ("share the position",)),
        ("sensors: 8\n", ("array.toml: ",)),
        (
            'kind = "positions"\npositions = [[0, 0], [0, 1]]\nchannels = [1, 2]\nspeed = 343.0\n',
            ("at least 3 sensors",),
        ),
        (
            'kind = "positions"\npositions = [[0, 0], [0, 0.1], [0, 0.3]]\nchannels = [1, 2, 3]\n'
            "speed = 343.0\n",
            ("front from back", "azimuths 120 and 60 degrees"),
        ),
    ],
)
def test_a_wrong_array_file_is_told_in_one_line(
    toml: str, words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (here / "array.toml").write_text(toml)
    refused(track(scene, *OUT, array=str(here / "array.toml")), capsys, here, *words)


def write_wav(path: Path, samples: Any) -> None:
    wavfile.write(path, RATE, samples)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.wav", b"", ("empty.wav: the file is empty",)),
        ("short.wav", np.zeros((100, 8), "<i2"), ("one window takes 256",)),
        ("nan.wav", np.full((1000, 8), np.nan, "<f4"), ("no sample of the recording is finite",)),
        ("narrow.wav", np.zeros((1000, 3), "<i2"), ("wants 8 channels; the recording has 3",)),
        ("absent.wav", None, ("absent.wav", "No such file")),
        ("tow.ogg", b"OggS", ("suffix must be one of",)),
    ],
)
def test_a_wrong_recording_is_told_in_one_line(
    name: str, content: Any, words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    if isinstance(content, bytes):
        (here / name).write_bytes(content)
    elif content is not None:
        write_wav(here / name, content)
    arguments = track(here, *OUT, file=name, array=str(scene / "array.toml"))
    refused(arguments, capsys, here, *words)


def test_a_truncated_recording_is_told_in_one_line(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "cut.wav").write_bytes((scene / "tow.wav").read_bytes()[:-1000])
    arguments = track(here, *OUT, file="cut.wav", array=str(scene / "array.toml"))
    refused(arguments, capsys, here, "cut.wav: truncated")


def test_the_array_s_own_channels_must_hold_something_finite(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples = np.zeros((1000, 9), "<f4")
    samples[:, :8] = np.nan
    write_wav(here / "deaf.wav", samples)
    (here / "array.toml").write_text(ARRAY.replace("= 8", "= 9") + "missing = [9]\n")
    arguments = track(here, *OUT, file="deaf.wav")
    refused(arguments, capsys, here, "no sample of the recording is finite")


@pytest.mark.parametrize(
    ("raw", "arguments", "words"),
    [
        (b"", (), ("ended after 0 frames", "one window takes 256")),
        (b"\0" * 16 * 255, (), ("ended after 255 frames",)),
        (np.full((300, 8), np.nan, "<f4").tobytes(), ("--dtype", "float32"), ("finite",)),
        (b"", ("--dtype", "complex64"), ("ended after 0 frames",)),
        (b"", ("--dtype", "complex64", "--hop", "5"), ("no window or hop",)),
        (b"", ("--dtype", "int24"), ("invalid choice: 'int24'",)),
        (b"", ("--rate", "1500"), ("750 Hz", "got 1000 Hz")),
        (b"", ("--channels", "7"), ("wants 8 channels; the recording has 7",)),
        (b"", ("--channels", "0"), ("channels must be at least 1",)),
        (b"", ("--plot", "tracks.png"), ("--plot goes with a file",)),
        (b"", ("--transpose",), ("--transpose goes with a file",)),
    ],
)
def test_a_wrong_stream_is_told_in_one_line(
    raw: bytes, arguments: tuple[str, ...], words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(raw)))
    live = track(scene, "--rate", str(RATE), "--out", "live.csv", *arguments, file="-")
    refused(live, capsys, here, *words)


def test_a_stream_wants_a_rate_and_channels_that_are_known(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refused(track(scene, file="-"), capsys, here, "want a rate")
    (here / "array.toml").write_text(ARRAY + "channels = [1, 3, 5, 7, 9, 11, 13, 15]\n")
    live = track(here, "--rate", str(RATE), file="-")
    refused(live, capsys, here, "pass --channels")


@pytest.mark.parametrize("arguments", [[], ["fly"], ["track"], ["demo", "--out"]])
def test_a_wrong_command_is_told_in_one_line(
    arguments: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refused(arguments, capsys, here)


def test_a_demo_that_cannot_make_its_folder_is_told_in_one_line(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "taken").write_text("")
    refused(["demo", "--out", "taken"], capsys, here, "taken: ")


def test_an_error_keeps_what_was_there_before(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (here / "tracks.csv").write_text("of yesterday")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"\0" * 100)))
    live = track(scene, "--rate", str(RATE), "--out", "tracks.csv", file="-")
    refused(live, capsys, here, "ended after")
    assert (here / "tracks.csv").read_text() == "of yesterday"


def test_the_shell_sees_status_and_line(scene: Path, here: Path) -> None:
    done = shell(track(scene, "--tracker", "nobody", "--out", "tracks.csv"))
    assert done.returncode == 2
    assert done.stdout == b""
    assert done.stderr.count(b"\n") == 1
    assert done.stderr.startswith(b"arrivals: there is no tracker 'nobody'")


def test_an_interrupt_is_status_130_and_leaves_no_file(
    scene: Path, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("arrivals.trackers.recorder.csv.writer", interrupted)
    assert main(track(scene, "--out", "tracks.csv")) == 130
    assert capsys.readouterr() == ("", "")
    assert os.listdir(here) == []


def test_an_output_never_takes_the_place_of_an_input(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save("in.npy", np.ones((4, 4), complex))
    Path("a.toml").write_text('kind = "ula"\nn_sensors = 4\nspacing = 0.5\nspeed = 100.0\n')
    job = ["track", "in.npy", "--array", "a.toml", "--frequency", "50"]
    for more in (["--out", "in.npy"], ["--out", "a.toml"], ["--out", "x.png", "--plot", "x.png"]):
        assert main([*job, *more]) == 2
        assert "must be different files" in capsys.readouterr().err
    assert main([*job, "--set", "measurement__wavelength=9"]) == 2
    assert "comes from --array and --frequency" in capsys.readouterr().err


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


def test_a_band_is_tracked_sample_by_sample_from_a_wav_and_from_a_stream(
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
    ("more", "told"),
    [
        (("--frequency", "1000"), "--frequency goes with snapshots, not with --band"),
        (("--window", "64"), "--window goes with snapshots"),
        (("--snapshots", "3"), "--snapshots goes with snapshots"),
        (("--tracker", "mvdr", "--frequencies", "700"), "give one of --frequency, --frequencies"),
        (("--tracker", "mvdr"), "mvdr takes one snapshot a step"),
        (("--tracker", "svalse", "--band", "600", "2500"), "half the rate, 2000 Hz"),
        (("--band", "600", "3000"), "half the rate, 2000 Hz"),
        (("--tracker", "ekf"), "is made from motion, measurement, x, P, not from an array file"),
        (("--set", "variant=Z"), "variant must be one of 'B'"),
    ],
)
def test_what_does_not_go_with_a_band_is_refused(
    band: Path, more: tuple[str, ...], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["track", "band.wav", *BAND, "--out", "t.csv", *more]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
    assert not Path("t.csv").exists()


def test_neither_frequency_nor_band_is_an_error(
    band: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["track", "band.wav", "--array", "line.toml"]) == 2
    assert "give --frequency, or --band" in capsys.readouterr().err


def test_reproduce_writes_table_page_and_pictures(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["reproduce", "interpolation-table1", "--runs", "2", "--jobs", "2", "--out", "found"]
    assert main(command) == 0
    assert Path("found/interpolation-table1.csv").exists()
    assert Path("found/interpolation-table1.md").exists()
    assert main(["reproduce", "interpolation-tabel1"]) == 2
    assert "interpolation-table1" in capsys.readouterr().err


# -- arrays in a plane, several frequencies and windows a step ---------------------------------


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


@pytest.mark.parametrize("kind", ["uca", "positions"])
@pytest.mark.parametrize(
    ("looks", "n_steps"),
    [
        (("--frequency", "700"), 16),
        (("--frequencies", "500", "600", "700"), 16),
        (("--band", "450", "850"), 16),
        (("--frequency", "700", "--snapshots", "4"), 4),
        (("--band", "450", "850", "--snapshots", "5", "--hop", "128"), 6),
    ],
)
@pytest.mark.parametrize("tracker", ["svalse", "cbf"])
def test_a_source_around_a_plane_array_is_tracked(
    plane: Path, kind: str, looks: tuple[str, ...], n_steps: int, tracker: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    job = ["track", "plane.wav", "--array", f"{kind}.toml", *looks, "--tracker", tracker]
    assert main([*job, "--out", "t.csv", "--plot", "t.png"]) == 0
    assert capsys.readouterr() == ("", "")
    rows = table(Path("t.csv").read_text())
    assert {int(row["step"]) for row in rows} == set(range(n_steps))
    loudest = [
        max((row for row in rows if int(row["step"]) == k), key=lambda row: float(row["level_db"]))
        for k in range(n_steps)
    ]
    found = np.array([float(row["doa_deg"]) for row in loudest])
    assert np.median(np.abs(found - AZIMUTH)) < 4
    assert Path("t.png").stat().st_size > 1000


@pytest.mark.parametrize(
    "looks",
    [
        ("--frequencies", "500", "700", "--snapshots", "3"),
        ("--band", "450", "850", "--window", "200", "--hop", "111", "--snapshots", "2"),
    ],
)
def test_a_stream_of_several_looks_gives_the_numbers_of_the_file(
    plane: Path, looks: tuple[str, ...], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    job = ["--array", "uca.toml", *looks, "--quiet"]
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
        (("--frequency", "500", "--band", "450", "850"), ("give one of --frequency",)),
        (("--frequency", "500", "--snapshots", "0"), ("snapshots must be at least 1",)),
        (("--frequency", "500", "--snapshots", "99"), ("16 snapshots; one step takes 99",)),
        (("--frequencies", "500", "700", "--tracker", "mvdr"), ("mvdr takes one snapshot a step",)),
    ],
)
def test_what_does_not_fit_several_looks_is_told_in_one_line(
    plane: Path, arguments: tuple[str, ...], words: tuple[str, ...],
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    job = ["track", "plane.wav", "--array", "uca.toml", "--out", "t.csv"]
    refused([*job, *arguments], capsys, plane, *words)


def test_a_stream_that_ends_within_its_first_step_is_told(
    plane: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    job = ["track", "-", "--array", "uca.toml", "--rate", "4000", "--dtype", "float32"]
    several = ["--frequencies", "500", "700", "--snapshots", "9"]
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(bytes(6 * 4 * 600))))
    refused([*job, *several], capsys, plane, "ended after 2 windows; one step takes 9")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"")))
    complex_frames = ["--dtype", "complex64", "--frequencies", "500", "700"]
    refused([*job, *complex_frames], capsys, plane, "complex frames are snapshots already")


def test_directions_that_look_alike_are_told_once(
    plane: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = 'kind = "positions"\nspeed = 343.0\npositions = [[0, 0], [0, 1], [1, 0], [1, 1]]\n'
    Path("square.toml").write_text(text + "channels = [1, 2, 3, 4]\n")
    samples = wavfile.read("plane.wav")[1][:, :4]
    wavfile.write("square.wav", 4000, samples)
    job = ["track", "square.wav", "--array", "square.toml", "--frequency", "400", "--out", "t.csv"]
    assert main(job) == 0
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert told.startswith("arrivals: warning: directions ")
    assert "look alike to this array at every frequency" in told


def test_the_infrasound_demo_finds_silence_and_both_sources(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What several estimators agree on: 320, 250 and 321 degrees from north, or wind alone."""
    assert main(["demo", "brp2012", "--out", str(tmp_path), "--quiet"]) == 0
    names = ["brp2012-cbf.csv", "brp2012-svalse.csv", "brp2012-valse.csv", "brp2012.png"]
    assert sorted(os.listdir(tmp_path)) == names
    assert "240 steps" in capsys.readouterr().out
    rows = table((tmp_path / "brp2012-svalse.csv").read_text())
    time = np.array([float(row["time_s"]) for row in rows])
    doa = np.array([float(row["doa_deg"]) % 360 for row in rows])
    for start, end, wanted in ((420, 435, 320), (610, 800, 250), (815, 895, 321)):
        within = (time >= start) & (time <= end)
        assert np.unique(time[within]).size >= (end - start) // 5  # steps of 4.96 s
        assert np.abs(doa[within] - wanted).max() < 6.0
    quiet = (time < 410) | (time > 950)
    assert np.unique(time[quiet]).size < 45  # of 130 steps
