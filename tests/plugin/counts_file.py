"""Recordings in files of integers below one line of text: `COUNTS <rate> <n_channels>`."""

from functools import partial
from pathlib import Path

import numpy as np

from arrivals.recordings import FileContents, Reader, ReadingOptions, StoredSamples


def read_counts(path: Path, options: ReadingOptions) -> FileContents:
    """Return the samples, which stay in the file, and their rate."""
    head = path.read_bytes()[:100].split(b"\n")[0]
    rate, n_channels = (int(word) for word in head.split()[1:])
    n_samples, rest = divmod(path.stat().st_size - len(head) - 1, 4 * n_channels)
    if rest:
        raise ValueError(f"truncated: {rest} bytes after {n_samples} samples")
    load = partial(rows, path, len(head) + 1, n_channels)
    samples = StoredSamples((n_samples, n_channels), np.dtype(float), load, scale=2.0**-31)
    return FileContents(samples, rate)


def rows(path: Path, offset: int, n_channels: int, start: int, stop: int) -> np.ndarray:
    """Return the rows from `start` to `stop`."""
    count, before = (stop - start) * n_channels, start * n_channels * 4
    return np.fromfile(path, "<i4", count, offset=offset + before).reshape(-1, n_channels)


READER = Reader("COUNTS", (".counts",), read_counts, lambda head: head.startswith(b"COUNTS "))
