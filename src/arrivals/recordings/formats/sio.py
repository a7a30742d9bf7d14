"""SIO files of the Scripps Institution of Oceanography, as of the SWellEx-96 experiment.

A header fills the first record: eight unsigned integers of 32 bits (number, records, bytes of a
record, channels, bytes of a sample, 0 for integers or 1 for reals, points of a channel, and 32677,
which has the order of the bytes), 24 bytes of name, 72 of comment. Records of one channel each
follow, the channels in turn.
"""

from __future__ import annotations

import struct
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.formats.file_contents import (
    FileContents,
    ReadingOptions,
    check_length,
)
from arrivals.recordings.raw_numbers import real_type
from arrivals.recordings.stored_samples import StoredSamples

CHECK, HEADER = 32677, 128  # the check word; bytes of the header
TYPES = {(0, 2): "i2", (0, 4): "i4", (1, 4): "f4"}  # by kind and bytes of a sample
MAX_CHANNELS = 100_000


class SIOHeader(NamedTuple):
    """Layout of an SIO file: bytes and samples of a record, and the type of the samples."""

    record_bytes: int
    n_channels: int
    n_samples: int
    dtype: np.dtype[Any]

    @property
    def per_record(self) -> int:
        """Samples in a record."""
        return self.record_bytes // self.dtype.itemsize

    @classmethod
    def parse(cls, head: bytes) -> SIOHeader:
        """Return the layout in the first bytes of a file, of either byte order."""
        check_length(HEADER, len(head), "bytes of a header")
        order = next((o for o in "><" if struct.unpack_from(o + "8I", head)[7] == CHECK), None)
        if order is None:
            raise ValueError(f"not an SIO file: its eighth word must be {CHECK}")
        _, _, record, channels, width, kind, points, _ = struct.unpack_from(order + "8I", head)
        if (kind, width) not in TYPES:
            raise ValueError(
                "the samples must be integers of 2 or 4 bytes, or reals of 4; "
                f"got {width} bytes of kind {kind}"
            )
        if not 1 <= channels <= MAX_CHANNELS or points < 1:
            raise ValueError(f"damaged header: {channels} channels of {points} samples")
        if record < HEADER or record % width:
            raise ValueError(f"damaged header: a record of {record} bytes")
        return cls(record, channels, points, np.dtype(order + TYPES[kind, width]))


def is_sio(head: bytes) -> bool:
    """Return True for the first bytes of an SIO file of either byte order."""
    return head[28:32] in (struct.pack(">I", CHECK), struct.pack("<I", CHECK))


def read_sio(path: Path, options: ReadingOptions) -> FileContents:
    """Return the samples of an SIO file, unchanged numbers, of which blocks are read on demand.

    Parameters
    ----------
    path : path
        The file; it contains no rate.
    options : ReadingOptions
        None concerns the format.

    Returns
    -------
    FileContents

    Raises
    ------
    ValueError
        If it is not an SIO file, or truncated.
    """
    with path.open("rb") as file:
        header = SIOHeader.parse(file.read(HEADER))
        present = file.seek(0, 2)
    n_rounds, rest = divmod(header.n_samples - 1, header.per_record)
    # the last record need not be filled up
    whole = header.record_bytes * (n_rounds + 1) * header.n_channels
    least = whole + (rest + 1) * header.dtype.itemsize
    check_length(least, present)
    samples = StoredSamples(
        (header.n_samples, header.n_channels),
        real_type(header.dtype.str),
        partial(_rows, path, header),
    )
    return FileContents(samples)


def _rows(path: Path, header: SIOHeader, start: int, stop: int) -> NDArray[Any]:
    """Return rows of all channels, (stop - start, n_channels)."""
    per, n = header.per_record, header.n_channels
    first, last = start // per, -(-stop // per)  # rounds of one record a channel
    with path.open("rb") as file:
        file.seek(header.record_bytes * (1 + first * n))
        data = file.read(header.record_bytes * (last - first) * n)
    numbers = np.frombuffer(data, header.dtype, len(data) // header.dtype.itemsize)
    missing = (last - first) * n * per - len(numbers)
    records = np.pad(numbers, (0, max(0, missing))).reshape(last - first, n, per)
    rows = records.transpose(0, 2, 1).reshape(-1, n)
    return rows[start - first * per : stop - first * per]
