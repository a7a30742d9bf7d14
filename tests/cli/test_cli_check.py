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
