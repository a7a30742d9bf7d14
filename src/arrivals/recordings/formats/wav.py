"""WAV files of any bit depth, streamed ones and those of 64-bit sizes included."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from arrivals.files import open_input
from arrivals.recordings.formats.audio import read_audio
from arrivals.recordings.formats.file_contents import FileContents, ReadingOptions, check_length
from arrivals.recordings.raw_numbers import RawRows, real_type, scale_of
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.validation import positive

# sizes in the headers of ffmpeg, sox and arecord when they write to a pipe
UNKNOWN_SIZES = (0, 0x7FFFF000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
ENDLESS = 0x7FFF0000  # bytes; larger sizes in the header of a stream mean that it is unknown
INTEGERS, FLOATS, EXTENSIBLE = 1, 3, 0xFFFE  # format tags
MAX_HEADER = 2**20  # bytes of the chunks before the samples of a stream


class SampleFormat(NamedTuple):
    """Format of the samples of a WAV file: its tag, channels, rate, bytes and bits of a sample.

    `kind` is a type code of `raw_numbers`, None if the samples are compressed.
    """

    tag: int
    n_channels: int
    rate: int
    frame: int
    kind: str | None


class WavHeader(NamedTuple):
    """Header of a WAV file: format, first byte and number of bytes of the samples.

    The size is None if the header does not contain it.
    """

    form: SampleFormat
    start: int
    size: int | None


def is_wav(head: bytes) -> bool:
    """Return True for the first bytes of a WAV file, of big-endian and of 64-bit ones too.

    Examples
    --------
    >>> is_wav(b"RIFF....WAVEfmt "), is_wav(b"fLaC")
    (True, False)
    """
    return head[:4] in (b"RIFF", b"RIFX", b"RF64", b"BW64") and head[8:12] == b"WAVE"


def read_wav(path: Path, options: ReadingOptions) -> FileContents:
    """Return the samples of a WAV file, integers scaled to [-1, 1), and its rate."""
    with open_input(path) as file:
        length = file.seek(0, io.SEEK_END)
        file.seek(0)
        form, start, size = wav_header(file, length)
    rate, present = positive("rate", form.rate), length - start
    check_length(size or 0, present, "bytes of samples")
    if form.kind is None:
        return read_audio(path, options)
    n_samples = (present if size is None else size) // form.frame
    rows = RawRows(path, start, form.kind, form.n_channels, 128 if form.kind == "|u1" else 0)
    shape, scale = (n_samples, form.n_channels), scale_of(form.kind)
    return FileContents(StoredSamples(shape, real_type(form.kind), rows, scale=scale), rate)


def wav_header(file: BinaryIO, length: int | None = None) -> WavHeader:
    """Read the header of a WAV file; the file is at its first sample then.

    Parameters
    ----------
    file : binary file
        At its beginning; it need not be positioned, as a pipe.
    length : int, optional
        Size of the file, bytes; None for a stream.

    Returns
    -------
    WavHeader

    Raises
    ------
    ValueError
        If it is not a WAV file, or has no samples.
    """
    head = file.read(12).ljust(12)
    if not is_wav(head):
        raise ValueError("not a WAV file")
    order: Any = "big" if head[:4] == b"RIFX" else "little"
    form, long_size, at = None, 0, 12
    while len(head_of_chunk := file.read(8)) == 8:
        name, size, at = head_of_chunk[:4], int.from_bytes(head_of_chunk[4:], order), at + 8
        if name == b"data":
            if form is None:
                raise ValueError("the header has no format of the samples")
            consistent = int.from_bytes(head[4:8], order) + 8 == length
            endless = length is None and size > ENDLESS
            unknown = (size in UNKNOWN_SIZES or endless) and not consistent and not long_size
            return WavHeader(form, at, None if unknown else long_size or size)
        padded = size + size % 2
        if padded > (MAX_HEADER if length is None else length - at):
            break
        body = file.read(padded)
        at += padded
        if name == b"fmt ":
            form = _sample_format(body, order)
        elif name == b"ds64":
            long_size = int.from_bytes(body[8:16], order)
    raise ValueError("truncated: the header has no samples")


def _sample_format(body: bytes, order: str) -> SampleFormat:
    """Return the format in a chunk `fmt `."""
    mark = ">" if order == "big" else "<"
    if len(body) < 16:
        raise ValueError("truncated: the header has no format of the samples")
    tag, n_channels, rate, _, frame, bits = struct.unpack(f"{mark}HHIIHH", body[:16])
    if tag == EXTENSIBLE and len(body) >= 26:
        tag = struct.unpack(f"{mark}H", body[24:26])[0]
    if n_channels < 1:
        raise ValueError("the header has 0 channels")
    size, rest = divmod(frame, n_channels)
    kind = None
    if tag == INTEGERS and not rest and size in (1, 2, 3, 4, 8) and 0 < bits <= 8 * size:
        kind = f"{mark}i{size}" if size > 1 else "|u1"
    elif tag == FLOATS and not rest and size in (4, 8) and bits == 8 * size:
        kind = f"{mark}f{size}"
    elif tag in (INTEGERS, FLOATS):
        raise ValueError(f"the header has {bits} bits a sample in {frame} bytes of {n_channels}")
    return SampleFormat(tag, n_channels, rate, frame, kind)
