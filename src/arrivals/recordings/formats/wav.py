"""WAV files of any bit depth, streamed ones included."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from arrivals.files import open_input
from arrivals.recordings.formats.file_contents import FileContents, ReadingOptions, check_size
from arrivals.validation import positive

# sizes in the headers of ffmpeg, sox and arecord when they write to a pipe
UNKNOWN_SIZES = (0, 0x7FFFF000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def is_wav(head: bytes) -> bool:
    """Return True for the first bytes of a WAV file, of big and of 64-bit ones too."""
    return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"


def read_wav(path: Path, options: ReadingOptions) -> FileContents:
    """Return the samples of a WAV file, integers scaled to [-1, 1), and its rate."""
    with open_input(path) as file:
        return _contents(file, options.max_bytes)


def _contents(file: BinaryIO, max_bytes: float) -> FileContents:
    from scipy.io import wavfile

    start, announced, frame, streamed = _wav_header(file)
    present = file.seek(0, io.SEEK_END) - start
    if streamed:
        file = _with_sizes(file, start, present // frame * frame)
    elif announced > present:
        raise ValueError(f"truncated: expected {announced} bytes of samples; got {present}")
    check_size(present if streamed else announced, max_bytes)
    file.seek(0)
    rate, samples = wavfile.read(file)
    return FileContents(_scaled(samples), positive("rate", rate))


def _wav_header(file: BinaryIO) -> tuple[int, int, int, bool]:
    """Return start and size of the samples, bytes per frame, and True if the size is unknown."""
    kind, riff_size, form = struct.unpack("4s4s4s", file.read(12).ljust(12))
    if kind not in (b"RIFF", b"RIFX", b"RF64") or form != b"WAVE":
        raise ValueError("not a WAV file")
    order: Any = "big" if kind == b"RIFX" else "little"
    frame = long_size = 0
    while len(head := file.read(8)) == 8:
        name, size, start = head[:4], int.from_bytes(head[4:], order), file.tell()
        if name == b"data":
            consistent = int.from_bytes(riff_size, order) + 8 == file.seek(0, io.SEEK_END)
            streamed = size in UNKNOWN_SIZES and not consistent and not long_size
            return start, long_size or size, max(frame, 1), streamed
        body = file.read(16)
        if name == b"fmt ":
            frame = int.from_bytes(body[12:14], order)
        elif name == b"ds64":
            long_size = int.from_bytes(body[8:16], order)
        file.seek(start + size + size % 2)
    raise ValueError("truncated: the header has no samples")


def _with_sizes(file: BinaryIO, start: int, size: int) -> BinaryIO:
    """Return a streamed file with correct sizes in its header."""
    file.seek(0)
    raw = bytearray(file.read(start + size))
    order: Any = "big" if raw[:4] == b"RIFX" else "little"
    raw[4:8] = (start + size - 8).to_bytes(4, order)
    raw[start - 4 : start] = size.to_bytes(4, order)
    return io.BytesIO(raw)


def _scaled(samples: NDArray[Any]) -> NDArray[Any]:
    """Return integers scaled exactly to [-1, 1); 8 bits are unsigned, more are signed."""
    if samples.dtype.kind == "f":
        return samples
    if samples.dtype.kind == "u":
        return np.asarray((samples - np.float32(128)) / np.float32(128))
    kind: Any = np.float32 if samples.dtype.itemsize <= 2 else np.float64
    return np.asarray(samples.astype(kind) * kind(2.0 ** (1 - 8 * samples.dtype.itemsize)))
