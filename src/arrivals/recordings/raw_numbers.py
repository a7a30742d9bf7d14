"""Interleaved numbers of files and streams: integers of 8 to 64 bits, floats, complex numbers."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

CHUNK = 2**13  # numbers that are converted together, in the processor's cache
DTYPES = {  # of streams
    "int16": "<i2",
    "int24": "<i3",
    "int32": "<i4",
    "float32": "<f4",
    "float64": "<f8",
    "complex64": "<c8",
    "complex128": "<c16",
}


def item_size(kind: str) -> int:
    """Return the number of bytes of a number.

    Examples
    --------
    >>> item_size("<i3"), item_size("<c8")
    (3, 8)
    """
    return 3 if kind[1:] == "i3" else np.dtype(kind).itemsize


def stored_numbers(raw: bytes | NDArray[np.uint8], kind: str) -> NDArray[Any]:
    r"""Return the numbers in some bytes; those of 24 bits as the upper ones of 32.

    Parameters
    ----------
    raw : bytes or ndarray of uint8
        A whole number of numbers.
    kind : str
        Type code of numpy with byte order; `<i3` and `>i3` are integers of 24 bits.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> stored_numbers(b"\0\0\1\2\0\0\3\4", ">i2"), stored_numbers(b"\1\0\0", "<i3")
    (array([  0, 258,   0, 772], dtype='>i2'), array([256], dtype=int32))
    """
    return _of_24_bits(raw, kind[0]) if kind[1:] == "i3" else np.frombuffer(raw, kind)


def scale_of(kind: str) -> float | None:
    """Return the factor by which `stored_numbers` are in [-1, 1); None for floats.

    Examples
    --------
    >>> scale_of("<i2") * 2**15, scale_of("<i3") * 2**31, scale_of("<f4")
    (1.0, 1.0, None)
    """
    if kind[1] not in "iu":
        return None
    return float(2.0 ** (1 - 8 * (4 if kind[1:] == "i3" else np.dtype(kind).itemsize)))


def real_type(kind: str) -> np.dtype[Any]:
    """Return the type of scaled numbers: float32 for up to 16 bits and float32, else float64.

    Examples
    --------
    >>> [str(real_type(kind)) for kind in ("<i2", "<i3", ">f4")]
    ['float32', 'float64', 'float32']
    """
    return np.dtype(np.float32 if kind[1:] in ("f4", "i2", "i1", "u1") else np.float64)


def decoded(raw: bytes, kind: str) -> NDArray[Any]:
    r"""Return the numbers in some bytes, integers as float64 in [-1, 1).

    Examples
    --------
    >>> decoded(b"\0\0\0\0\0\xc0", "<i3")
    array([ 0. , -0.5])
    """
    numbers, scale = stored_numbers(raw, kind), scale_of(kind)
    return numbers if scale is None else np.asarray(numbers * scale)


def _of_24_bits(raw: bytes | NDArray[np.uint8], order: str) -> NDArray[np.int32]:
    """Return integers of 24 bits as the upper bits of those of 32."""
    n, octets = len(raw) // 3, np.frombuffer(raw, np.uint8)
    numbers, little = np.empty(n, np.int32), int(order == "<")
    padded = np.zeros(3 * CHUNK + 1, np.uint8)  # with a byte before, or after, the numbers
    words = np.ndarray((CHUNK,), f"{order}i4", padded, strides=(3,))  # each with a byte too many
    for first in range(0, n, CHUNK):
        m = min(CHUNK, n - first)
        padded[little : 3 * m + little] = octets[3 * first : 3 * (first + m)]
        np.bitwise_and(words[:m], np.int32(-256), out=numbers[first : first + m])
    return numbers


@dataclass(frozen=True)
class RawRows:
    """Loader of rows of interleaved numbers in a file, for `StoredSamples`.

    Parameters
    ----------
    path : path
        The file.
    offset : int
        Bytes before the first row.
    kind : str
        Type code, as in `stored_numbers`.
    n_channels : int
        Numbers of a row.
    zero : int
        Stored value of zero, which is subtracted.

    Examples
    --------
    >>> import os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "raw")
    ...     _ = path.write_bytes(np.arange(6, dtype="<i2").tobytes())
    ...     RawRows(path, 0, "<i2", 2)(1, 3).tolist()
    [[2, 3], [4, 5]]
    """

    path: Path
    offset: int
    kind: str
    n_channels: int
    zero: int = 0

    def __call__(self, start: int, stop: int) -> NDArray[Any]:
        """Return the rows from `start` to `stop`."""
        row = self.n_channels * item_size(self.kind)
        n_bytes = (stop - start) * row
        raw = np.fromfile(self.path, np.uint8, n_bytes, offset=self.offset + start * row)
        if len(raw) < n_bytes:
            raise ValueError(f"truncated: expected {n_bytes} bytes of samples; got {len(raw)}")
        numbers = stored_numbers(raw, self.kind)
        numbers = numbers.astype(np.int16) - np.int16(self.zero) if self.zero else numbers
        return numbers.reshape(stop - start, self.n_channels)


class Replay:
    """Bytes that were read before, followed by the rest of their source.

    Parameters
    ----------
    head : bytes
        The first bytes.
    source : binary file
        Continues them.
    size : int, optional
        Number of bytes at which it ends; the end of the source if None.

    Examples
    --------
    >>> Replay(b"abc", BytesIO(b"defg"), size=5).read(100)
    b'abcde'
    """

    def __init__(self, head: bytes, source: BinaryIO, size: int | None = None) -> None:
        self._head, self._source, self._left = BytesIO(head), source, size

    def read(self, size: int) -> bytes:
        """Return the next bytes, fewer at the end only."""
        if self._left is not None:
            size = min(size, self._left)
            self._left -= size
        block = self._head.read(size)
        return block if len(block) == size else block + self._source.read(size - len(block))
