"""Audio files that are read by libsndfile: FLAC, OGG, AIFF, CAF, W64 and compressed WAV."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.files import open_input
from arrivals.recordings.formats.file_contents import (
    FileContents,
    ReadingOptions,
    check_length,
    check_size,
    import_reader_package,
)
from arrivals.recordings.stored_samples import StoredSamples

PRECISE = ("PCM_24", "PCM_32", "DOUBLE", "ALAC_20", "ALAC_24", "ALAC_32")  # beyond float32
MOST_SAMPLES = 2**36 - 1  # of a FLAC file; libsndfile has more for an unknown number
W64 = bytes.fromhex("726966662e91cf11a5d628db04c10000")  # first bytes of a W64 file


def is_flac(head: bytes) -> bool:
    """Return True for the first bytes of a FLAC file."""
    return head.startswith(b"fLaC")


def is_ogg(head: bytes) -> bool:
    """Return True for the first bytes of an OGG file."""
    return head.startswith(b"OggS")


def is_aiff(head: bytes) -> bool:
    """Return True for the first bytes of an AIFF file."""
    return head.startswith(b"FORM") and head[8:12] in (b"AIFF", b"AIFC")


def is_caf(head: bytes) -> bool:
    """Return True for the first bytes of a CAF file."""
    return head.startswith(b"caff\0\1")


def is_w64(head: bytes) -> bool:
    """Return True for the first bytes of a W64 file."""
    return head.startswith(W64)


def read_audio(path: Path, options: ReadingOptions) -> FileContents:
    """Return the samples of a file, integers scaled to [-1, 1), and its rate."""
    package = import_reader_package("soundfile", f"a {path.suffix} file")
    with open_input(path) as opened:
        expected = announced_size(opened.read(24))
    check_length(expected, path.stat().st_size)
    try:
        with package.SoundFile(path) as file:
            shape, rate = (file.frames, file.channels), float(file.samplerate)
            dtype = np.dtype(np.float64 if file.subtype in PRECISE else np.float32)
            if file.frames > MOST_SAMPLES:
                return FileContents(_of_unknown_length(path, file, dtype, options), rate)
            if file.frames:
                file.seek(file.frames - 1)
            if file.frames and not len(file.read(1)):
                raise ValueError(
                    f"truncated: the last of {file.frames} samples is missing: copy it again"
                )
    except package.LibsndfileError as error:
        raise damaged(error) from error
    return FileContents(StoredSamples(shape, dtype, AudioRows(path, dtype)), rate)


def damaged(error: Any) -> ValueError:
    """Return the error of a file that libsndfile refused."""
    reason = error.error_string.strip(" .\n")
    return ValueError(f"truncated, encrypted or damaged: {reason}: copy or export it again")


def announced_size(head: bytes) -> int:
    """Return the size of an AIFF or W64 file by its header, bytes; 0 for other files.

    Examples
    --------
    >>> announced_size(b"FORM" + (1000).to_bytes(4, "big") + b"AIFF")
    1008
    """
    if is_aiff(head):
        return int.from_bytes(head[4:8], "big") + 8
    return int.from_bytes(head[16:24], "little") if is_w64(head) else 0


def _of_unknown_length(
    path: Path, file: Any, dtype: np.dtype[Any], options: ReadingOptions
) -> NDArray[Any]:
    """Return the samples of a FLAC file from a pipe: its header does not have their number."""
    package = import_reader_package("soundfile", "a FLAC file")

    def fails(n: int) -> bool:
        try:
            with package.SoundFile(path) as again:  # a decoder that failed once fails on
                again.seek(n)
        except package.LibsndfileError:
            return True
        return False

    low, high = 0, MOST_SAMPLES
    while high - low > 1:  # `low` is a sample, `high` is not
        middle = (low + high) // 2
        low, high = (low, middle) if fails(middle) else (middle, high)
    check_size(high * file.channels * dtype.itemsize, options.max_bytes)
    whole = bytearray(path.read_bytes())
    whole[21:26] = (whole[21] >> 4 << 36 | high).to_bytes(5, "big")  # of the block STREAMINFO
    samples: NDArray[Any] = package.read(io.BytesIO(whole), dtype=str(dtype), always_2d=True)[0]
    return samples


@dataclass(frozen=True)
class AudioRows:
    """Loader of rows of an audio file, for `StoredSamples`."""

    path: Path
    dtype: np.dtype[Any]

    def __call__(self, start: int, stop: int) -> NDArray[Any]:
        """Return the rows from `start` to `stop`."""
        package = import_reader_package("soundfile", f"a {self.path.suffix} file")
        try:
            with package.SoundFile(self.path) as file:
                file.seek(start)
                rows: NDArray[Any] = file.read(stop - start, str(self.dtype), always_2d=True)
        except package.LibsndfileError as error:
            raise damaged(error) from error
        check_length(stop, start + len(rows), "samples")
        return rows
