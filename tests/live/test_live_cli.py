"""Live views and live input of the command line."""

import io
import json
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from command_line import DOA, RATE, SHELL, assert_rejected, table, track
from station_scenes import bearing_rows, stations_file

from arrivals.__main__ import main
from arrivals.live import views

CBF = ("--tracker", "cbf", "--set", "max_sources=1")


class Terminal(io.StringIO):
    """Text stream that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def stream(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the scene on standard input."""
    raw = io.BytesIO((scene / "tow.raw").read_bytes())
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(raw))


def objects(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


# JSON lines


def test_jsonl_on_standard_output_takes_the_place_of_the_table(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, *CBF, "--out", "tracks.csv", "--jsonl", "-")) == 0
    steps = objects(capsys.readouterr().out)
    rows = table((here / "tracks.csv").read_text())
    assert [step["step"] for step in steps] == list(range(len(DOA)))
    listed = [(s["step"], s["time_s"], *one.values()) for s in steps for one in s["sources"]]
    cells = [[float(cell or "nan") for cell in row.values()] for row in rows]
    np.testing.assert_allclose(np.array(listed, dtype=float), cells, rtol=1e-8)
    assert main(track(scene, *CBF, "--jsonl", "-")) == 0
    assert objects(capsys.readouterr().out) == steps


def test_jsonl_file_of_a_stream_leaves_the_table_as_it_is(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], stream: None
) -> None:
    main(track(scene, *CBF))
    expected = capsys.readouterr().out
    live = track(scene, *CBF, "--rate", str(RATE), "--jsonl", "steps.jsonl", file="-")
    assert main(live) == 0
    assert capsys.readouterr().out == expected
    steps = objects((here / "steps.jsonl").read_text())
    assert len(steps) == len(DOA)
    assert {step["lag_s"] for step in steps} == {None}  # the stream is not live


def test_jsonl_of_real_samples_has_a_line_for_each_row(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["track", str(scene / "tow.wav"), "--array", str(scene / "array.toml"),
                 "--tracker", "interpolation_ekf", "--band", "600", "1000"]  # fmt: skip
    assert main([*arguments, "--hop", "500", "--jsonl", "steps.jsonl"]) == 0
    rows = table(capsys.readouterr().out)
    steps = objects((here / "steps.jsonl").read_text())
    assert [str(step["step"]) for step in steps] == [row["step"] for row in rows]
    last = steps[-1]["sources"][0]
    assert last["doa_deg"] == pytest.approx(float(rows[-1]["doa_deg"]), rel=1e-8)


def test_jsonl_is_not_created_by_a_stream_without_samples(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"")))
    live = track(scene, *CBF, "--rate", str(RATE), "--jsonl", "steps.jsonl", "--live", file="-")
    assert_rejected(live, capsys, here, "the stream ended after 0 frames")


def test_jsonl_of_fused_positions(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stations_file(here, recorded=False)
    lines = ["time_s,station,bearing_deg", *(f"{t},{s},{b}" for t, s, b in bearing_rows())]
    (here / "bearings.csv").write_text("\n".join(lines))
    arguments = ["fuse", "stations.toml", "--bearings", "bearings.csv", "--quiet"]
    assert main([*arguments, "--jsonl", "-", "--out", "tracks.csv", "--live"]) == 0
    printed, drawn = capsys.readouterr()
    rows, steps = table((here / "tracks.csv").read_text()), objects(printed)
    assert len(steps) == 12
    assert sum(len(step["sources"]) for step in steps) == len(rows) > 5
    assert steps[-1]["sources"][0]["x_m"] == pytest.approx(float(rows[-1]["x_m"]), rel=1e-8)
    assert drawn.startswith("stations.toml: 3 stations\n")
    assert re.search(r" 11\.0  0: -?[\d.]+, -?[\d.]+ m\n$", drawn)


# terminal


def test_live_draws_on_standard_error_and_prints_the_table(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(track(scene, *CBF))
    expected = capsys.readouterr().out
    assert main(track(scene, *CBF, "--live")) == 0
    printed, drawn = capsys.readouterr()
    assert printed == expected
    lines = drawn.splitlines()
    assert lines[0].endswith("tow.wav: cbf")
    assert "\x1b" not in drawn
    assert all("|" in line for line in lines[2:])


def test_live_on_a_terminal_takes_the_place_of_the_table(
    scene: Path, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, err = Terminal(), Terminal()
    monkeypatch.setattr("sys.stdout", out)
    monkeypatch.setattr("sys.stderr", err)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert main(track(scene, "--live")) == 0
    assert out.getvalue() == ""
    assert "\x1b[1;31m0:\x1b[0m" in err.getvalue()  # no bar of progress is among the lines
    assert "\r" not in err.getvalue()


# page


def test_serve_without_its_port_goes_on_without_a_page(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(track(scene, *CBF))
    expected = capsys.readouterr().out
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(track(scene, *CBF, "--serve", str(port))) == 0
    printed, message = capsys.readouterr()
    assert printed == expected
    assert re.fullmatch(f"arrivals: warning: no page at 127.0.0.1:{port}: .+\n", message)


def test_serve_without_bokeh_goes_on_without_a_page(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "bokeh.server.server", None)
    assert main(track(scene, *CBF, "--serve")) == 0
    printed, message = capsys.readouterr()
    assert len(printed.splitlines()) == len(DOA) + 1
    assert message.count("\n") == 1
    assert 'the page requires bokeh: pip install "arrivals[live]"' in message


def test_serve_without_a_browser_says_so(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("bokeh")
    monkeypatch.setattr("webbrowser.open", lambda url: False)
    monkeypatch.setattr(views, "wait_for_interrupt", lambda: None)
    assert main(track(scene, *CBF, "--serve", "0", "--browser", "--out", "tracks.csv")) == 0
    lines = capsys.readouterr().err.splitlines()
    url = lines[0].removeprefix("arrivals: page: ")
    assert lines[1:] == [
        f"arrivals: warning: no browser was found: open {url}",
        f"arrivals: the run has ended; {url} stays until Ctrl-C",
        "arrivals: the page is closed",
    ]
    assert len(table((here / "tracks.csv").read_text())) == len(DOA)


@pytest.mark.skipif(sys.platform == "win32", reason="interrupts are sent as POSIX does")
def test_serve_keeps_the_page_after_the_run_until_an_interrupt(
    scene: Path, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("bokeh")
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    arguments = track(scene, *CBF, "--serve", "0")
    pipes: dict[str, Any] = {"stderr": subprocess.PIPE, "text": True}
    with (
        (here / "tracks.csv").open("w") as out,
        subprocess.Popen([*SHELL, *arguments], stdout=out, **pipes) as process,
    ):
        assert process.stderr is not None
        url = process.stderr.readline().removeprefix("arrivals: page: ").strip()
        assert "has ended" in process.stderr.readline()
        assert len(table((here / "tracks.csv").read_text())) == len(DOA)
        with urllib.request.urlopen(url, timeout=20) as page:
            text = page.read().decode()
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=30)[1] == "arrivals: the page is closed\n"
    assert process.returncode == 0
    assert "Arrivals" in text
    sources = re.findall(r'(?:src|href)="([^"]+)"', text)
    assert sources
    assert all(re.match(r"/?static/", source) for source in sources), sources


# lag


def test_late_steps_of_a_live_stream_are_left_out(
    scene: Path, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    stream: None,
) -> None:  # fmt: skip
    """The source takes its time by a clock that is ahead by a second."""
    from arrivals.live.input import lag

    class Late(lag.LagMeter):
        def __init__(self, source: Any, late: str) -> None:
            super().__init__(source, late, clock=lambda: 1.0 + self._at, start=0.0)
            self._at, self._source = 0.0, self  # type: ignore[assignment]

        @property
        def received(self) -> float:
            return self._at

        def steps(self, steps: Any) -> Any:
            def timed() -> Any:
                for k, (_, z) in enumerate(steps):
                    self._at = 0.5 * k
                    yield 0.5 * k, z

            return super().steps(timed())

    monkeypatch.setattr("arrivals.cli.track_snapshots.LagMeter", Late)
    live = track(scene, *CBF, "--rate", str(RATE), "--late", "drop", file="-")
    assert main(live) == 0
    printed, message = capsys.readouterr()
    assert message == (
        "arrivals: 1.0 s behind the source at 2.0 s: late steps are left out\n"
        f"arrivals: {len(DOA) - 4} late steps were left out\n"
    )
    assert {row["step"] for row in table(printed)} == {"0", "1", "2", "3"}


# devices


class Recorder(ModuleType):
    """A package whose device plays the scene once."""

    samples = b""

    class PortAudioError(Exception):
        """Not raised."""

    def query_devices(self, device: Any, kind: str) -> dict[str, float]:
        if device != "array":
            raise ValueError(f"No {kind} device matching {device!r}")
        return {"default_samplerate": float(RATE)}

    def RawInputStream(self, **settings: Any) -> "Recorder":
        assert settings == {
            "samplerate": RATE, "device": "array", "channels": 8, "dtype": "float32",
        }  # fmt: skip
        return self

    def read(self, n: int) -> tuple[bytes, bool]:
        block, self.samples = self.samples[: 32 * n], self.samples[32 * n :]
        return block, False

    def start(self) -> None:
        """Do nothing."""

    stop = close = start


@pytest.fixture
def device(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = Recorder("sounddevice")
    counts = np.fromfile(scene / "tow.raw", "<i2")
    package.samples = (counts / 32768).astype("<f4").tobytes()
    monkeypatch.setitem(sys.modules, "sounddevice", package)


def test_device_is_tracked_as_a_stream(
    scene: Path, here: Path, device: None, capsys: pytest.CaptureFixture[str]
) -> None:
    main(track(scene, *CBF))
    expected = capsys.readouterr().out
    _, _, *rest = track(scene, *CBF)
    assert main(["track", *rest, "--device", "array"]) == 0
    assert capsys.readouterr().out == expected


def test_device_that_does_not_exist_is_one_line(
    scene: Path, here: Path, device: None, capsys: pytest.CaptureFixture[str]
) -> None:
    _, _, *rest = track(scene, *CBF)
    words = "--device must be an input with 8 channels; got 'line'", "No input device matching"
    assert_rejected(["track", *rest, "--device", "line", "--out", "a.csv"], capsys, here, *words)


# arguments


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--serve", "port"), "--serve must be PORT or HOST:PORT; got 'port'"),
        (("--browser",), "--browser requires --serve"),
        (("--late", "drop"), "--late requires standard input or --device"),
        (("--late", "skip"), "must be one of wait, drop; got 'skip'"),
        (("--device", "array"), "FILE must be left out with --device; got "),
        (("--jsonl", "missing/a.jsonl"), "the folder does not exist"),
        (("--jsonl", "a.csv", "--out", "./a.csv"), "must be different files"),
        (("--tracker", "ar_kalman_qrd_rls", "--serve"), "--serve requires a tracker of each step"),
    ],
)
def test_views_reject_arguments_that_do_not_fit(
    more: tuple[str, ...], words: str, scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_rejected(track(scene, *more), capsys, here, words)


def test_track_without_a_file_or_a_device_is_rejected(
    scene: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, _, *rest = track(scene)
    assert_rejected(["track", *rest], capsys, here, "FILE must be given, or -", "--device NAME")
