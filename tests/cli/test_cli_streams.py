"""Command line on streams."""

import io
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from command_line import FREQUENCY, HEADING, RATE, SHELL, WINDOW, pressure, run_cli, table, track
from scipy.io import wavfile

from arrivals.__main__ import main
from arrivals.measurement_models import SensorArray


def test_stream_equals_the_file_and_drops_an_incomplete_frame(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    windows = ("--window", "300", "--hop", "170")
    main(track(scene, *windows))
    expected = capsys.readouterr().out
    live = track(scene, *windows, "--rate", str(RATE), file="-")
    raw = (scene / "tow.raw").read_bytes()
    done = run_cli(live, input=raw + b"\x01\x02\x03")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.decode() == expected
    done = run_cli([*live, "--out", "live.csv"], input=raw)
    assert (done.returncode, done.stdout) == (0, b"")
    assert (here / "live.csv").read_text() == expected


@pytest.mark.parametrize(
    ("dtype", "hop"), [("int32", 512), ("float32", 100), ("float64", 256), ("int16", 999)]
)
def test_stream_of_any_type_and_hop_equals_the_file(
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
def test_stream_of_complex_frames_has_one_snapshot_per_frame(
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


def start(scene: Path) -> subprocess.Popen[bytes]:
    arguments = track(scene, "--rate", str(RATE), file="-")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([*SHELL, *arguments], **pipes)  # type: ignore[call-overload, no-any-return]


@pytest.fixture
def live(scene: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Start a live tracker."""
    with start(scene) as process:
        yield process
        process.kill()


def feed(process: subprocess.Popen[bytes], scene: Path) -> bytes:
    """Write three windows to the process, and return the heading and the first line."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write((scene / "tow.raw").read_bytes()[: 3 * WINDOW * 16])
    process.stdin.flush()
    return process.stdout.readline() + process.stdout.readline()


def test_stream_prints_estimates_at_once_and_whole_lines_after_an_interrupt(
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


def test_stream_ends_with_status_0_when_its_output_is_closed(
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


def test_interrupt_ends_a_stream_where_the_parent_ignores_it(scene: Path) -> None:
    """A child of `nohup pytest &` inherits that SIGINT is ignored."""
    inherited = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        process = start(scene)
    finally:
        signal.signal(signal.SIGINT, inherited)
    with process:
        feed(process, scene)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == 130
