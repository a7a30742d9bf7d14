"""Scene on disk, and calls of the command line on it."""

import contextlib
import csv
import io
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arrivals.__main__ import main
from arrivals.measurement_models import SensorArray

RATE, FREQUENCY, WINDOW = 8000, 1000.0, 256
ARRAY = 'kind = "ula"\nn_sensors = 8\nspacing = 0.17\nspeed = 343.0\n'
DOA = np.linspace(-8.0, 12.0, 20)  # degrees, one per window
SUBSPACE = ("music", "root_music", "esprit", "past")
HEADING = "step,time_s,label,doa_deg,std_deg,existence,level_db"
# as in a terminal, also where the parent ignores SIGINT (`nohup`, `&`) and children inherit that
RESTORED = "import runpy, signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
START = RESTORED + "runpy.run_module('arrivals', run_name='__main__', alter_sys=True)"
SHELL = [sys.executable, "-W", "error", "-c", START]


def pressure(doa: Any, n_sensors: int = 8) -> Any:
    """Return samples of a tone whose direction changes slowly, in noise: (n_samples, n_sensors)."""
    rng = np.random.default_rng(0)
    array = SensorArray.ula(n_sensors, 0.17, speed=343.0)
    a = array.steering_vector(np.deg2rad(doa), array.wavelength(FREQUENCY))
    phasor = np.exp(2j * np.pi * FREQUENCY * np.arange(len(a)) / RATE)
    return 0.3 * (phasor[:, None] * a).real + 0.1 * rng.standard_normal(a.shape)


def track(scene: Path, *more: str, file: str = "tow.wav", array: str = "array.toml") -> list[str]:
    return ["track", str(scene / file) if file != "-" else "-", "--array", str(scene / array),
            "--frequency", "1000", "--tracker", "svalse", *more]  # fmt: skip


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def run_cli(arguments: list[str], **more: Any) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([*SHELL, *arguments], capture_output=True, timeout=60, **more)


def run_piped(
    arguments: list[str], content: bytes, capsys: pytest.CaptureFixture[str]
) -> tuple[int, str, str]:
    """Run the command line in this process, with a content from a pipe as standard input."""
    reads, writes = os.pipe()

    def write() -> None:
        with contextlib.suppress(BrokenPipeError), os.fdopen(writes, "wb") as file:
            file.write(content)

    writer, before = threading.Thread(target=write), sys.stdin
    writer.start()
    try:
        with os.fdopen(reads) as sys.stdin:
            status = main(arguments)
    finally:
        sys.stdin = before
        writer.join()
    return status, *capsys.readouterr()


def assert_rejected(
    arguments: list[str], capsys: pytest.CaptureFixture[str], here: Path, *words: str
) -> None:
    """Check that there is one line with these words, status 2, and nothing new in the folder."""
    before = sorted(os.listdir(here))
    assert main(arguments) == 2
    printed, message = capsys.readouterr()
    assert printed == ""
    assert message.startswith("arrivals: ")
    assert message.count("\n") == 1
    assert message.endswith("\n")
    for word in words:
        assert word in message
    assert sorted(os.listdir(here)) == before
