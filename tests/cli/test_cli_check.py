"""`arrivals check`, and the warnings of `arrivals track`."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from command_line import ARRAY, RATE, assert_rejected, pressure, track
from scipy.io import wavfile

from arrivals.__main__ import main


@pytest.fixture
def files(here: Path) -> Path:
    """Folder with a recording, one with a silent channel, and the array file."""
    noise = np.random.default_rng(0).standard_normal((RATE, 8))
    wavfile.write(here / "noise.wav", RATE, np.round(3000 * noise).astype("<i2"))
    noise[:, 4] = 0
    wavfile.write(here / "silent.wav", RATE, np.round(3000 * noise).astype("<i2"))
    (here / "array.toml").write_text(ARRAY)
    return here


def test_check_prints_the_table_with_status_0_without_a_fault(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", "noise.wav", "--array", "array.toml"]) == 0
    printed, errors = capsys.readouterr()
    lines = printed.splitlines()
    assert lines[0] == "8 channels, 1 s, 8000 Hz, array of 8 sensors, alias limit 1009 Hz"
    assert lines[-1] == "no fault found"
    assert (len(lines), errors) == (12, "")


def test_check_with_a_fault_has_status_1_and_json_the_same(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", "silent.wav", "--array", "array.toml", "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert [fault["kind"] for fault in report["faults"]] == ["silent"]
    assert main(["check", "silent.wav", "--out", "report.txt"]) == 1
    assert capsys.readouterr() == ("", "")
    assert "FAULT: channel 5 is silent" in Path("report.txt").read_text()


def test_check_refuses_bad_input_with_status_2(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_rejected(["check", "none.wav"], capsys, files)
    assert_rejected(["check"], capsys, files)
    assert_rejected(["check", "noise.wav", "--array", "none.toml"], capsys, files)
    assert_rejected(["check", "noise.wav", "--out", "noise.wav"], capsys, files)
    assert_rejected(["check", "noise.wav", "--frequency", "100"], capsys, files)
    assert_rejected(["check", "noise.wav", "--out", os.path.join("no", "r.txt")], capsys, files)


def test_track_prints_a_warning_line_a_fault(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples = pressure(np.zeros(3000))
    samples[:, 2] = 0
    wavfile.write(here / "tow.wav", RATE, samples.astype("<f4"))
    arguments = track(here, "--out", "t.csv", array=str(scene / "array.toml"))
    for more in ([], ["--tracker", "ar_kalman_qrd_rls"]):
        assert main([*arguments, *more, "--quiet"]) == 0
        lines = capsys.readouterr().err.splitlines()
        assert [line for line in lines if "is silent" in line] == [
            "arrivals: warning: channel 3 is silent: connect its sensor, or add missing = [3] "
            "to the array file"
        ]


def test_check_takes_the_files_of_track(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(0)
    z = rng.standard_normal((4000, 8)) + 1j * rng.standard_normal((4000, 8))
    z[:, 5] = 0
    np.save(files / "z.npy", z)
    z.astype("c8").tofile(files / "z.bin")
    for i, channel in enumerate(z.T):
        channel.astype("c8").tofile(files / f"z{i}.cf32")
    options = ["--array", "array.toml", "--rate", "4000", "--center", "900"]
    texts = []
    for names in (
        ["z.npy"],
        ["z.bin", "--format", "cf32"],
        ["z.bin", "--format", "cf32", "--channels", "8"],
        [f"z{i}.cf32" for i in range(8)],
    ):
        assert main(["check", *names, *options]) == 1
        texts.append(capsys.readouterr().out)
    assert "FAULT: channel 6 is silent" in texts[0]
    assert texts == texts[:1] * 4


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("-",), "FILE must be a file, not standard input"),
        (("noise.wav", "--center", "9"), "--center requires complex samples; got real ones"),
        (("noise.wav", "--center", "9", "--frequency", "9"), "pass only one of"),
        (("noise.wav", "--channels", "7"), "the number of channels must be 8"),
        (("noise.wav", "--variable", "x"), "without named arrays"),
        (("noise.wav", "b.txt", "--out", "b.txt"), "must be different files"),
    ],
)
def test_check_refuses_options_of_files_that_do_not_fit(
    arguments: tuple[str, ...], words: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (files / "b.txt").write_text("1\n")
    assert_rejected(["check", *arguments], capsys, files, words)
