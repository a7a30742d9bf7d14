"""Speed of reading recordings in blocks, beside soundfile's own blocks of the same numbers.

    python benchmarks/reading.py [--minutes 5] [--rounds 5]

A row for each kind of file: megabytes of samples a second of `read(path).samples[start:stop]` and
of soundfile, both in blocks of 65536 samples of 8 channels, and the ratio of their times; the best
of several rounds, one after the other.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import soundfile

import arrivals.recordings.readers
from arrivals.recordings import read

RATE, N_CHANNELS, BLOCK = 16000, 8, 65536
KINDS = {"WAV int16": ("wav", "PCM_16", "float32"), "WAV int24": ("wav", "PCM_24", "float64"),
         "WAV float32": ("wav", "FLOAT", "float32"), "FLAC": ("flac", "PCM_16", "float32"),
         "W64": ("w64", "PCM_16", "float32")}  # fmt: skip


def ours(path: Path) -> None:
    samples = read(path).samples
    for start in range(0, len(samples), BLOCK):
        samples[start : start + BLOCK]


def theirs(path: Path, dtype: str) -> None:
    for _ in soundfile.blocks(path, BLOCK, dtype=dtype, always_2d=True):
        pass


def seconds(run: Callable[[], None]) -> float:
    started = time.perf_counter()
    run()
    return time.perf_counter() - started


def rows(minutes: float, rounds: int) -> Iterator[str]:
    shape = int(60 * minutes * RATE), N_CHANNELS
    samples = (np.random.default_rng(0).standard_normal(shape) * 3000).astype(np.int16)
    for name, (suffix, subtype, dtype) in KINDS.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"a.{suffix}")
            soundfile.write(path, samples, RATE, subtype=subtype)
            times = [
                (seconds(lambda: ours(path)), seconds(lambda: theirs(path, dtype)))  # noqa: B023
                for _ in range(rounds)
            ]
        one, other = np.min(times, axis=0)
        size = samples.size * np.dtype(dtype).itemsize / 1e6
        yield f"| {name} | {size / one:.0f} | {size / other:.0f} | {one / other:.2f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    arrivals.recordings.readers.LOADED_AT_ONCE = 0  # short files, too, stay on disk
    print("| file | MB/s | soundfile, MB/s | ratio of times |\n| --- | --- | --- | --- |")
    for row in rows(arguments.minutes, arguments.rounds):
        print(row)


if __name__ == "__main__":
    main()
