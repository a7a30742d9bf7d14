"""Files with a header on standard input, through a pipe."""

import io
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import soundfile
from command_line import RATE, SHELL, WINDOW, run_cli, run_piped, track
from scipy.io import savemat, wavfile

from arrivals.__main__ import main

CBF = ("--tracker", "cbf")
AsStream = Callable[..., tuple[int, str, str]]  # status, output, messages


@pytest.fixture
def expected(scene: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Return the tracks of the scene's file."""
    assert main(track(scene, *CBF)) == 0
    tracks = capsys.readouterr().out
    assert len(tracks.splitlines()) > 10
    return tracks


@pytest.fixture
def as_stream(scene: Path, capsys: pytest.CaptureFixture[str]) -> AsStream:
    """Return a function that tracks a content on standard input."""

    def run(content: bytes, *more: str) -> tuple[int, str, str]:
        return run_piped(track(scene, *CBF, *more, file="-"), content, capsys)

    return run


def written(scene: Path, path: Path, form: str, subtype: str) -> Path:
    """Write the scene in another format."""
    samples, rate = soundfile.read(scene / "tow.wav")
    soundfile.write(path, samples, rate, format=form, subtype=subtype)
    return path


@pytest.mark.parametrize(
    ("form", "subtype"),
    [("WAV", "PCM_24"), ("RF64", "PCM_16"), ("WAV", "FLOAT"), ("FLAC", "PCM_16"),
     ("AIFF", "PCM_16"), ("W64", "PCM_16")],
)  # fmt: skip
def test_header_on_standard_input_equals_the_file(
    form: str, subtype: str, scene: Path, here: Path, expected: str, as_stream: AsStream
) -> None:
    content = written(scene, here / "a.bin", form, subtype).read_bytes()
    assert as_stream(content) == (0, expected, "")


def test_wav_of_unknown_size_and_with_a_last_chunk_is_read(scene: Path, expected: str) -> None:
    whole = (scene / "tow.wav").read_bytes()
    last = b"LIST" + (400).to_bytes(4, "little") + bytes(range(200)) * 2
    endless = whole[:40] + b"\xff\xff\xff\x7f" + whole[44:]
    for content in (whole + last, endless):
        more = ("--rate", str(RATE), "--dtype", "int16")
        done = run_cli(track(scene, *CBF, *more, file="-"), input=content)
        assert (done.returncode, done.stdout) == (0, expected.encode()), done.stderr


def test_flac_from_an_encoder_that_writes_to_a_pipe_is_read(
    scene: Path, here: Path, expected: str, as_stream: AsStream
) -> None:
    """Its header does not have the number of samples."""
    whole = bytearray(written(scene, here / "a.flac", "FLAC", "PCM_16").read_bytes())
    whole[21] &= 0xF0
    whole[22:26] = bytes(4)
    assert as_stream(bytes(whole)) == (0, expected, "")


def test_npz_file_on_standard_input_is_read_without_a_warning(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez(here / "a.npz", samples=wavfile.read(scene / "tow.wav")[1], rate=RATE)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO((here / "a.npz").read_bytes())))
    assert main(track(scene, *CBF, file="-")) == 0
    printed, message = capsys.readouterr()
    assert len(printed.splitlines()) > 10
    assert message == ""


def test_mislabelled_file_is_tracked_with_one_line(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(scene, here / "a.wav", "FLAC", "PCM_16")
    assert main(track(here, *CBF, file="a.wav", array=str(scene / "array.toml"))) == 0
    message = capsys.readouterr().err
    assert "arrivals: warning: " in message
    assert message.endswith("the suffix is .wav, the content is FLAC: read as FLAC\n")
    assert message.count("\n") == 1


def test_header_that_contradicts_an_argument_is_refused(
    scene: Path, here: Path, as_stream: AsStream
) -> None:
    status, _, message = as_stream((scene / "tow.wav").read_bytes(), "--rate", "16000")
    assert status == 2
    assert "--rate must be 8000, as in the header of standard input; got 16000" in message
    flac = written(scene, here / "a.flac", "FLAC", "PCM_16").read_bytes()
    status, _, message = as_stream(flac, "--channels", "8")
    assert status == 2
    assert "--channels must be left out: standard input is a FLAC file" in message


@pytest.mark.parametrize("start", [b"fLaC", b"OggS", b"FORM1234AIFF", b"RIFF1234WAVE", b"caff\0\1"])
def test_damaged_header_is_not_taken_for_samples(
    start: bytes, scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    content = io.BytesIO(start + bytes(20_000))
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(content))
    assert main(track(scene, *CBF, "--rate", str(RATE), file="-")) == 2
    printed, message = capsys.readouterr()
    assert printed == ""
    assert message.startswith("arrivals: standard input: ")
    assert message.count("\n") == 1


def test_format_without_its_package_is_not_taken_for_samples(scene: Path) -> None:
    blocked = [*SHELL[:-1], f"import sys; sys.modules['soundfile'] = None; {SHELL[-1]}"]
    arguments = track(scene, *CBF, "--rate", str(RATE), file="-")
    done = subprocess.run(
        [*blocked, *arguments], input=b"fLaC" + bytes(20_000), capture_output=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, b"")
    assert b'requires soundfile: pip install "arrivals[io]"' in done.stderr


def test_wav_stream_is_tracked_as_it_arrives(scene: Path) -> None:
    """The pipe stays open: the first line does not wait for the end."""
    content = (scene / "tow.wav").read_bytes()[: 44 + 3 * WINDOW * 16]
    arguments = [*SHELL, *track(scene, *CBF, file="-")]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(arguments, **pipes) as process:  # type: ignore[call-overload]
        process.stdin.write(content)
        process.stdin.flush()
        assert process.stdout.readline().startswith(b"step,time_s")
        assert process.stdout.readline().startswith(b"0,0.016,")
        process.kill()


def test_channels_of_the_header_must_fit_the_array(here: Path, as_stream: AsStream) -> None:
    wavfile.write(here / "a.wav", RATE, np.zeros((4000, 6), np.int16))
    status, _, message = as_stream((here / "a.wav").read_bytes())
    assert status == 2
    assert "must have 8 channels; got 6" in message


def test_matlab_is_read_and_text_refused(
    scene: Path, here: Path, expected: str, as_stream: AsStream
) -> None:
    samples, rate = soundfile.read(scene / "tow.wav", dtype="float32")
    savemat(here / "a.mat", {"samples": samples, "rate": float(rate)})
    assert as_stream((here / "a.mat").read_bytes()) == (0, expected, "")
    status, printed, message = as_stream(b"0.125, 0.250\n" * 1000, "--rate", str(RATE))
    assert (status, printed) == (2, "")
    assert message.startswith("arrivals: standard input is text, not samples: write it to a file")
