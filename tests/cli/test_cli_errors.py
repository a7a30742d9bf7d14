"""Command line: messages and exit status for invalid input."""

import io
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import (
    ARRAY,
    RATE,
    assert_rejected,
    run_cli,
    track,
)
from scipy.io import wavfile

from arrivals.__main__ import main

OUT = ("--out", "tracks.csv", "--plot", "tracks.png")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--frequency", "1010"), ("alias limit, 1008.82 Hz", "got 1010 Hz")),
        (("--frequency", "1010", "--tracker", "cbf"), ("alias limit, 1008.82 Hz",)),
        (("--frequency", "-5"), ("frequency must be finite and positive",)),
        (("--frequency", "high"), ("invalid float value: 'high'",)),
        (("--tracker", "svlase"), ("no tracker 'svlase'", "did you mean svalse")),
        (("--set", "kapa=3"), ("no parameter 'kapa'", "did you mean motion__kappa?")),
        (("--set", "motion__kapa=3"), ("no parameter 'kapa'", "did you mean motion__kappa?")),
        (("--set", "motion.kappa=3"), ("did you mean motion__kappa?",)),
        (("--set", "motion=3"), ("motion must be a BernoulliVonMises; got 3",)),
        (("--set", "merge"), ("NAME=VALUE",)),
        (("--set", "solver__tolerance=small"), ("tolerance must be a number; got 'small'",)),
        (("--window", "1"), ("window must be at least 2",)),
        (("--window", "100000"), ("one window requires 100000",)),
        (("--hop", "0"), ("hop must be at least 1",)),
        (("--out", "nowhere/tracks.csv"), ("nowhere: the folder does not exist",)),
        (("--plot", "nowhere/tracks.png"), ("nowhere: the folder does not exist",)),
        (("--plot", "tracks.xyz"), (".png", "'.xyz'")),
        (("--out", "."), ("this is a folder",)),
        (("--variable", "z"), ("variable must be None without named arrays",)),
        (("--dtype", "int16"), ("--dtype requires samples from standard input",)),
        (("--frobnicate",), ("unrecognized arguments",)),
        (
            ("--frequncy", "1000"),
            ("unrecognized", "did you mean --frequency?", "arrivals track -h"),
        ),
    ],
)
def test_track_invalid_argument_prints_one_line(
    arguments: tuple[str, ...], words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert_rejected(track(scene, *OUT, *arguments), capsys, here, *words)


def test_track_frequency_above_nyquist_is_refused(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "fine.toml").write_text(ARRAY.replace("0.17", "0.01"))
    arguments = track(scene, *OUT, "--frequency", "4500", array=str(here / "fine.toml"))
    assert_rejected(arguments, capsys, here, "frequency", "4000 Hz", "got 4500 Hz")


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        (ARRAY.replace("n_sensors = 8", "n_sensors = 6"), ("6 channels", "got 8")),
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
            ("collinear", "azimuths 120 and 60 degrees"),
        ),
    ],
)
def test_track_invalid_array_file_prints_one_line(
    toml: str, words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (here / "array.toml").write_text(toml)
    assert_rejected(track(scene, *OUT, array=str(here / "array.toml")), capsys, here, *words)


def write_wav(path: Path, samples: Any) -> None:
    wavfile.write(path, RATE, samples)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.wav", b"", ("empty.wav: the file is empty",)),
        ("short.wav", np.zeros((100, 8), "<i2"), ("one window requires 256",)),
        ("nan.wav", np.full((1000, 8), np.nan, "<f4"), ("no sample of the recording is finite",)),
        ("narrow.wav", np.zeros((1000, 3), "<i2"), ("must have 8 channels; got 3",)),
        ("absent.wav", None, ("absent.wav", "No such file")),
        ("tow.xyz", b"abcd", ("suffix must be one of",)),
        ("tow.ogg", b"OggS", ("tow.ogg: truncated, encrypted or damaged",)),
    ],
)
def test_track_invalid_recording_prints_one_line(
    name: str, content: Any, words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    if isinstance(content, bytes):
        (here / name).write_bytes(content)
    elif content is not None:
        write_wav(here / name, content)
    arguments = track(here, *OUT, file=name, array=str(scene / "array.toml"))
    assert_rejected(arguments, capsys, here, *words)


def test_missing_file_is_reported_with_similar_names_of_its_folder(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_wav(here / "talk.wav", np.zeros((1000, 8), "<i2"))
    array = str(scene / "array.toml")
    for file, names in (("talk.wva", "talk.wav"), ("./talk1.wav", "talk.wav")):
        assert_rejected(track(here, *OUT, file=file, array=array), capsys, here, f"mean {names}?")
    assert main(track(here, *OUT, file="nowhere/talk.wav", array=array)) == 2
    assert "did you mean" not in capsys.readouterr().err


def test_track_truncated_recording_prints_one_line(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "cut.wav").write_bytes((scene / "tow.wav").read_bytes()[:-1000])
    arguments = track(here, *OUT, file="cut.wav", array=str(scene / "array.toml"))
    assert_rejected(arguments, capsys, here, "cut.wav: truncated")


def test_track_without_finite_samples_of_the_array_is_refused(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples = np.zeros((1000, 9), "<f4")
    samples[:, :8] = np.nan
    write_wav(here / "invalid.wav", samples)
    (here / "array.toml").write_text(ARRAY.replace("= 8", "= 9") + "missing = [9]\n")
    arguments = track(here, *OUT, file="invalid.wav")
    assert_rejected(arguments, capsys, here, "no sample of the recording is finite")


@pytest.mark.parametrize(
    ("raw", "arguments", "words"),
    [
        (b"", (), ("ended after 0 frames", "one window requires 256")),
        (b"\0" * 16 * 255, (), ("ended after 255 frames",)),
        (np.full((300, 8), np.nan, "<f4").tobytes(), ("--dtype", "float32"), ("finite",)),
        (b"", ("--dtype", "complex64"), ("ended after 0 frames",)),
        (b"", ("--dtype", "complex64", "--hop", "5"), ("window and hop must be None",)),
        (b"", ("--dtype", "int12"), ("must be one of int16, ", "got 'int12': did you mean int")),
        (b"", ("--rate", "1500"), ("750 Hz", "got 1000 Hz")),
        (b"", ("--channels", "7"), ("must have 8 channels; got 7",)),
        (b"", ("--channels", "0"), ("channels must be at least 1",)),
        (b"", ("--plot", "tracks.png"), ("--plot requires a file",)),
        (b"", ("--transpose",), ("--transpose requires a file",)),
    ],
)
def test_track_invalid_stream_prints_one_line(
    raw: bytes, arguments: tuple[str, ...], words: tuple[str, ...], scene: Path, here: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(raw)))
    live = track(scene, "--rate", str(RATE), "--out", "live.csv", *arguments, file="-")
    assert_rejected(live, capsys, here, *words)


def test_track_of_a_stream_requires_rate_and_channels(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"")))
    assert_rejected(track(scene, file="-"), capsys, here, "require a rate")
    (here / "array.toml").write_text(ARRAY + "channels = [1, 3, 5, 7, 9, 11, 13, 15]\n")
    live = track(here, "--rate", str(RATE), file="-")
    assert_rejected(live, capsys, here, "pass --channels")


@pytest.mark.parametrize("arguments", [[], ["fly"], ["track"], ["demo", "--out"]])
def test_cli_invalid_command_prints_one_line(
    arguments: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_rejected(arguments, capsys, here)


def test_demo_without_folder_prints_one_line(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "taken").write_text("")
    assert_rejected(["demo", "--out", "taken"], capsys, here, "taken: ")


def test_track_after_an_error_keeps_the_old_file(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (here / "tracks.csv").write_text("of yesterday")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"\0" * 100)))
    live = track(scene, "--rate", str(RATE), "--out", "tracks.csv", file="-")
    assert_rejected(live, capsys, here, "ended after")
    assert (here / "tracks.csv").read_text() == "of yesterday"


def test_cli_error_has_status_2_and_one_line(scene: Path, here: Path) -> None:
    done = run_cli(track(scene, "--tracker", "unknown", "--out", "tracks.csv"))
    assert done.returncode == 2
    assert done.stdout == b""
    assert done.stderr.count(b"\n") == 1
    assert done.stderr.startswith(b"arrivals: there is no tracker 'unknown'")


def test_interrupt_has_status_130_and_leaves_no_file(
    scene: Path, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("arrivals.trackers.run.csv.writer", interrupted)
    assert main(track(scene, "--out", "tracks.csv")) == 130
    assert capsys.readouterr() == ("", "")
    assert os.listdir(here) == []


def test_output_equal_to_an_input_is_refused(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save("in.npy", np.ones((4, 4), complex))
    Path("a.toml").write_text('kind = "ula"\nn_sensors = 4\nspacing = 0.5\nspeed = 100.0\n')
    job = ["track", "in.npy", "--array", "a.toml", "--frequency", "50"]
    for more in (["--out", "in.npy"], ["--out", "a.toml"], ["--out", "x.png", "--plot", "x.png"]):
        assert main([*job, *more]) == 2
        assert "must be different files" in capsys.readouterr().err
    assert main([*job, "--set", "measurement__wavelength=9"]) == 2
    assert "comes from array (--array) and frequencies" in capsys.readouterr().err
