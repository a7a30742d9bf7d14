"""CPU of the snapshots of a band, beside one transform for each frequency.

Eight channels at 16 kHz, windows of 512 samples every 256, from a recording and from a stream.
"""

from __future__ import annotations

import argparse
import io
import os
import time
from collections.abc import Callable

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from arrivals.recordings import Recording, frame_recording, frame_stream

RATE, WINDOW, HOP, N_CHANNELS = 16000, 512, 256, 8
LIMIT = 0.01  # CPU s per s of audio


def cpu(work: Callable[[], object]) -> float:
    """Return the processor time of a call, s: the least of three."""
    times = []
    for _ in range(3):
        started = time.process_time()
        work()
        times.append(time.process_time() - started)
    return min(times)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=30, help="length of the recording (30)")
    parser.add_argument("--bins", type=int, default=170, help="number of frequencies (170)")
    options = parser.parse_args()
    shape = (options.seconds * RATE, N_CHANNELS)
    samples = np.random.default_rng(0).standard_normal(shape).astype(np.float32)
    recording, raw = Recording(samples, RATE), samples.astype("<f4").tobytes()
    bins = ((10 + np.arange(options.bins)) * RATE / WINDOW).tolist()
    between = [f + 0.3 * RATE / WINDOW for f in bins]
    framing = {"window": WINDOW, "hop": HOP}

    def live() -> None:
        for _ in frame_stream(io.BytesIO(raw), N_CHANNELS, bins, rate=RATE, dtype="float32",
                              n_snapshots=8, **framing):  # fmt: skip
            pass

    ways: list[tuple[str, Callable[[], object]]] = [
        ("one call a frequency", lambda: [recording.snapshots(f, **framing) for f in bins]),
        ("bins of the window", lambda: frame_recording(recording, bins, n_snapshots=8, **framing)),
        ("bins of the window, stream", live),
        ("frequencies between bins",
         lambda: frame_recording(recording, between, n_snapshots=8, **framing)),
    ]  # fmt: skip
    print(
        f"| {options.bins} frequencies | CPU s per s of audio | of one call a frequency | limit |"
    )
    print("|---" * 4 + "|")
    first = 0.0
    for label, work in ways:
        took = cpu(work) / options.seconds
        first = first or took
        limit = f"{LIMIT:g}" if label.startswith("bins") else ""
        print(f"| {label} | {took:.4f} | {took / first:.3f} | {limit} |", flush=True)


if __name__ == "__main__":
    main()
