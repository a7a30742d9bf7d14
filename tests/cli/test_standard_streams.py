"""Standard streams that are closed, full or of few characters; messages of any error."""

import io
import os
import shlex
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from command_line import RATE, track

from arrivals.__main__ import MAX_MESSAGE_LENGTH, main, message
from arrivals.cli import main as commands

posix = pytest.mark.skipif(sys.platform == "win32", reason="shell and devices are POSIX's")


@posix
@pytest.mark.parametrize(
    ("redirected", "status"),
    [("list >&-", 2), ("-h >&-", 2), ("nonsense <&- >&- 2>&-", 2), ("list >/dev/full", 2)],
)
def test_closed_or_full_stream_has_status_2_without_a_traceback(
    redirected: str, status: int
) -> None:
    command = ["bash", "-c", f"{shlex.quote(sys.executable)} -m arrivals {redirected}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == status
    assert done.stderr.count("\n") == (0 if "2>&-" in redirected else 1)
    assert "Traceback" not in done.stderr


def test_closed_standard_error_changes_no_output(
    scene: Path, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr", None)
    assert main(track(scene, "--out", "tracks.csv", "--quiet", "--tracker", "cbf")) == 0
    assert (here / "tracks.csv").exists()
    assert main(["nonsense"]) == 2
    sys.stderr.close()


def test_closed_standard_input_is_an_empty_stream(
    scene: Path, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", None)
    assert main(track(scene, "--rate", str(RATE), "--out", "live.csv", file="-")) == 2
    sys.stdin.close()
    assert "ended after 0 frames" in capsys.readouterr().err
    assert os.listdir(here) == []


@pytest.mark.parametrize("encoding", ["ascii", "cp437", "cp1252"])
@pytest.mark.parametrize("arguments", [["list"], ["locate", "-h"], ["track", "-h"]])
def test_any_terminal_shows_lists_and_help(
    encoding: str, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    errors = "surrogateescape" if encoding == "ascii" else "strict"  # as in the locale C
    stdout = io.TextIOWrapper(io.BytesIO(), encoding=encoding, errors=errors)
    monkeypatch.setattr("sys.stdout", stdout)
    assert main(arguments) == 0
    assert len(stdout.buffer.getvalue()) > 100


def test_unexpected_error_is_one_line_and_a_traceback_on_request(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise LookupError("two\nlines")

    monkeypatch.setattr(commands, "_parser", fail)
    assert main(["list"]) == 2
    line = "internal error: LookupError: two lines; set ARRIVALS_DEBUG=1 for the traceback"
    assert capsys.readouterr().err == f"arrivals: {line}\n"
    monkeypatch.setenv("ARRIVALS_DEBUG", "1")
    assert main(["list"]) == 2
    assert "Traceback" in capsys.readouterr().err


def test_warning_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(commands, "_parser", lambda: warnings.warn("two\nlines", stacklevel=2))
    main(["list"])
    assert capsys.readouterr().err.startswith("arrivals: warning: two lines\n")


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (MemoryError(), "not enough memory"),
        (OSError(5, "Input/output error"), "standard input or output: Input/output error"),
        (OSError(5, "Input/output error", "a\nb"), "a b: Input/output error"),
        (BlockingIOError("in use"), "in use"),
        (UserWarning("of a filter"), "of a filter"),
    ],
)
def test_message_is_one_line(error: Exception, text: str) -> None:
    assert message(error) == text


def test_message_that_quotes_a_file_is_short() -> None:
    assert len(message(ValueError("x" * 10**6))) < MAX_MESSAGE_LENGTH + 10


@pytest.mark.parametrize("value", ["1+" * 20000 + "1j", "-" * 100000 + "1", "a." * 100000 + "b"])
def test_setting_that_is_nested_deeply_is_one_line(
    value: str, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(track(scene, "--set", f"solver__tolerance={value}")) == 2
    error = capsys.readouterr().err
    assert "solver__tolerance must not be nested so deeply" in error
    assert error.count("\n") == 1
