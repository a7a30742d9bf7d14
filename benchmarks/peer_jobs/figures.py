"""Figures without a peer: imports, the command line, memory and the start of `rss_vb`."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

RATE, N_CHANNELS, SPACING, SPEED, TONE = 16000, 8, 0.08, 343.0, 1000.0
ARRAY = f'kind = "ula"\nn_sensors = {N_CHANNELS}\nspacing = {SPACING}\nspeed = {SPEED}\n'
# prints CPU in s, without the start of Python, and the peak of memory in MB: that of Linux, since
# `resource` has that of the parent process, too
MEASURED = """
import pathlib, time
started = time.process_time()
{0}
used = time.process_time() - started
status = pathlib.Path("/proc/self/status").read_text().split()
print(used, int(status[status.index("VmHWM:") + 1]) / 1024)
"""
READ = """
from arrivals.recordings import read
samples = read({0!r}).samples
for start in range(0, len(samples), 65536):
    samples[start : start + 65536]
"""
TRACK = """
from arrivals.__main__ import main
main(["track", {0!r}, "--array", {1!r}, "--frequency", "1000", "--tracker", "svalse",
      "--out", {2!r}, "--quiet"])
"""


class Figure(NamedTuple):
    """A number that this library reaches, and the one wanted."""

    name: str
    value: float
    unit: str
    limit: float


def figures(minutes: float = 10.0) -> Iterator[Figure]:
    """Yield the figures, each of fresh processes."""
    imports = [_measured("import arrivals.trackers")[0] for _ in range(7)]
    yield Figure("import arrivals.trackers", float(np.median(imports)), "s CPU", 0.3)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write_tones(folder / "long.wav", 60.0)
        peak = _measured(READ.format(str(folder / "long.wav")))[1]
        yield Figure("read WAV, 1 h x 8 channels, peak memory", peak, "MB", 600)
        _write_tones(folder / "tones.wav", minutes)
        (folder / "line.toml").write_text(ARRAY, encoding="utf-8")
        files = [str(folder / each) for each in ("tones.wav", "line.toml", "tracks.csv")]
        cpu = _measured(TRACK.format(*files))[0] / (60 * minutes)
        text = f"arrivals track, {minutes:g} min x 8 channels x 16 kHz, svalse"
        yield Figure(text, cpu, "s CPU per s", 0.1)


def _measured(code: str) -> tuple[float, float]:
    """Return CPU time, s, and peak memory, MB, of code in a process of its own."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(
        [sys.executable, "-c", MEASURED.format(code)],
        capture_output=True, check=True, text=True, env=environment,
    )  # fmt: skip
    cpu, peak = done.stdout.split()[-2:]
    return float(cpu), float(peak)


def _write_tones(path: Path, minutes: float) -> None:
    """Write two tones, one from a direction that swings, in noise."""
    import soundfile

    rng, n = np.random.default_rng(0), 60 * RATE
    delay = SPACING / SPEED * np.arange(N_CHANNELS)
    with soundfile.SoundFile(path, "w", RATE, N_CHANNELS, "PCM_16") as file:
        for start in range(0, round(minutes) * n, n):
            t = (start + np.arange(n))[:, None] / RATE
            doa = np.deg2rad(30 + 20 * np.sin(2 * np.pi * t / 300))
            x = 2000 * np.cos(2 * np.pi * TONE * (t + delay * np.sin(doa)))
            drift = 0.003 * np.cumsum(rng.standard_normal((n, 1)), axis=0)
            x += 1500 * np.cos(2 * np.pi * TONE * (t + delay * np.sin(-0.4)) + drift)
            file.write((x + 300 * rng.standard_normal(x.shape)).astype(np.int16))
