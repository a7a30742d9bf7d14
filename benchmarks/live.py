"""Lag and memory of `arrivals track` on a stream of eight channels at 16 kHz, with its page."""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from live_scene import BLOCK, RATE, TURN, moving_sources

from arrivals.live.input.lag import START
from arrivals.measurement_models import SensorArray

ARRAY = 'kind = "uca"\nn_sensors = 8\nradius = 0.05\nspeed = 343.0\n'
STEP = 0.064  # s, as `track` chooses it for this stream
N_READINGS = 9  # of the memory


def started(folder: Path, *more: str) -> subprocess.Popen[bytes]:
    """Start a run on a stream, with a page that no browser has opened unless one does."""
    (folder / "array.toml").write_text(ARRAY)
    arguments = ["track", "-", "--array", "array.toml", "--rate", f"{RATE:g}", "--serve", "0",
                 "--out", "tracks.csv", "--quiet", *more]  # fmt: skip
    return subprocess.Popen(
        [sys.executable, "-m", "arrivals", *arguments],
        cwd=folder, stdin=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def scene() -> list[bytes]:
    """Return one turn of the scene, in blocks of 20 ms of 16-bit samples."""
    array = SensorArray.uca(8, radius=0.05, speed=343.0)
    return [
        np.rint(32767 * np.clip(block, -1, 1)).astype("<i2").tobytes()
        for block in moving_sources(array, TURN)
    ]


def lag(seconds: float, browser: bool) -> None:
    """Print the lag of a stream in real time."""
    blocks, spacing = scene(), BLOCK / RATE
    with tempfile.TemporaryDirectory() as name, started(Path(name), "--jsonl", "a.jsonl") as run:
        assert run.stdin is not None
        pipe, start = run.stdin, time.monotonic()

        def feed() -> None:
            for k in range(round(seconds / spacing)):
                time.sleep(max(0.0, start + (k + 1) * spacing - time.monotonic()))
                pipe.write(blocks[k % len(blocks)])
                pipe.flush()
            pipe.close()

        watch(run, feed, browser)
        cpu = processor_time(run.pid)
        run.kill()
        steps = [json.loads(line) for line in (Path(name) / "a.jsonl").read_text().splitlines()]
    known = [(step["time_s"], step["lag_s"]) for step in steps if step["lag_s"] is not None]
    at, late = np.array(known).T
    behind = at[late > 2 * STEP]
    caught_up = behind[behind < START].max(initial=0.0)
    late = late[at >= START]
    median, p95, p99 = np.quantile(late, [0.5, 0.95, 0.99])
    print(
        f"two steps behind until {caught_up:.1f} s; from {START:.0f} s on, "
        f"lag of {len(late)} steps of {1e3 * STEP:.0f} ms, "
        f"{'with' if browser else 'without'} a browser: median {1e3 * median:.0f} ms, "
        f"p95 {1e3 * p95:.0f} ms ({p95 / STEP:.2f} steps), p99 {1e3 * p99:.0f} ms, "
        f"largest {1e3 * late.max():.0f} ms; CPU {cpu:.0f} s"
    )


def watch(run: subprocess.Popen[bytes], feed: Callable[[], None], browser: bool) -> None:
    """Feed the stream of a run to its end, with its page open if wanted."""
    assert run.stderr is not None
    feeder = threading.Thread(target=feed)
    feeder.start()
    url = run.stderr.readline().decode().removeprefix("arrivals: page: ").strip()
    if browser:
        show(url, feeder)
    feeder.join()
    wait_for_end(run)


def wait_for_end(run: subprocess.Popen[bytes]) -> None:
    """Wait for the end of a run whose stream has ended, and print its other messages."""
    for line in run.stderr or ():
        if b"has ended" in line:
            return
        print(line.decode().strip())


def show(url: str, feeder: threading.Thread) -> None:
    """Show the page in chromium as long as the stream is fed."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        program = shutil.which("chromium")
        flags = ["--no-sandbox", "--disable-gpu"]
        chromium = playwright.chromium.launch(executable_path=program, args=flags)
        chromium.new_page(viewport={"width": 1280, "height": 860}).goto(url)
        feeder.join()
        chromium.close()


def memory(seconds: float, browser: bool) -> None:
    """Print the memory of a run while a stream is fed as fast as it is read."""
    blocks, readings = scene(), list[tuple[float, float]]()
    n_blocks = round(seconds * RATE / BLOCK)
    with tempfile.TemporaryDirectory() as name, started(Path(name)) as run:
        assert run.stdin is not None
        pipe, begun = run.stdin, time.monotonic()

        def feed() -> None:
            for k in range(n_blocks):
                pipe.write(blocks[k % len(blocks)])
                if (k + 1) % (n_blocks // N_READINGS) == 0:
                    at, size = BLOCK / RATE * (k + 1), resident(run.pid)
                    readings.append((at, size))
                    print(f"{at:6.0f} s of the stream: {size:.1f} MB", flush=True)
            pipe.close()

        watch(run, feed, browser)
        elapsed, cpu = time.monotonic() - begun, processor_time(run.pid)
        run.kill()
    at, size = np.array(readings[1:]).T  # the first one fills the ring of the page
    slope = np.polyfit(at / 3600, size, 1)[0]
    print(
        f"{seconds:.0f} s of the stream in {elapsed:.0f} s, "
        f"{'with' if browser else 'without'} a browser, CPU {cpu:.0f} s: "
        f"slope {slope:+.2f} MB an hour"
    )


def resident(pid: int) -> float:
    """Return the resident memory of a process, MB."""
    text = Path(f"/proc/{pid}/status").read_text()
    return int(text.split("VmRSS:")[1].split()[0]) / 1024


def processor_time(pid: int) -> float:
    """Return the processor time of a process, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100


def main() -> None:
    """Print one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("lag", "memory"))
    parser.add_argument("--seconds", type=float, help="of the stream (60; 3600)")
    parser.add_argument("--browser", action="store_true", help="show the page in chromium")
    options = parser.parse_args()
    if options.part == "lag":
        lag(options.seconds or 60.0, options.browser)
    else:
        memory(options.seconds or 3600.0, options.browser)


if __name__ == "__main__":
    main()
