"""Arrays of numbers in MATLAB files of level 4 and 5 (versions up to 7.2).

Every size in a file is compared with the bytes that are there before it is used, so that no
file can crash the interpreter or fill the memory. Other variables than full arrays of numbers
have their names and no data.

References
----------
MathWorks, *MAT-File Format*, R2024a, chapters 1 and 2.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.files import open_input
from arrivals.recordings.formats.file_contents import (
    FileContents,
    ReadingOptions,
    StoredArray,
    damage_refused,
    selected,
)

MATRIX, COMPRESSED = 14, 15  # data types of elements
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8",
           13: "u8"}  # fmt: skip
CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8",
           15: "u8"}  # fmt: skip
COMPLEX_FLAG, OPAQUE = 0x0800, 17
LEVEL_4 = {0: "f8", 1: "f4", 2: "i4", 3: "i2", 4: "u2", 5: "u1"}
MAX_HEADER = 4096  # bytes of a variable before its data
HDF5_VERSIONS = (b"\0\2IM", b"\2\0MI")  # versions and byte orders of 7.3
KIND = "MATLAB file"


def is_matlab(head: bytes) -> bool:
    """Return True for the header of level 5."""
    named = head.startswith(b"MATLAB") and head[126:128] in (b"IM", b"MI")
    return named and head[124:128] not in HDF5_VERSIONS


def read_matlab(path: Path, options: ReadingOptions) -> FileContents:
    """Return the selected array of a MATLAB file."""
    with open_input(path) as file:
        return selected(matlab_arrays(file), options)


def matlab_arrays(file: BinaryIO) -> dict[str, StoredArray]:
    """Return the variables of a MATLAB file by name.

    Parameters
    ----------
    file : binary file
        Regular file; the arrays can be loaded while it is open.

    Returns
    -------
    dict of str to StoredArray
        Variables; those that are not full arrays of numbers have the type object.

    Raises
    ------
    ValueError
        If it is not such a file, or is damaged.
    """
    file.seek(0)
    head = file.read(128)
    with damage_refused(KIND):
        if 0 in head[:4]:
            return dict(_level_4(file))
        if head[126:] not in (b"IM", b"MI"):
            raise ValueError("the header names no version")
        return dict(_level_5(file, "<" if head[126:] == b"IM" else ">"))


# level 5


class _Element(NamedTuple):
    """Tag of an element: its type, and where its data begin and end."""

    kind: int
    start: int
    size: int
    end: int


def _element(data: bytes, at: int, order: str, *, cut: bool = False) -> _Element:
    """Return the element at a place; with `cut`, its data may be incomplete."""
    if at + 8 > len(data):
        raise ValueError("an element has no tag")
    byteorder: Any = "little" if order == "<" else "big"
    first = int.from_bytes(data[at : at + 4], byteorder)
    kind, size, start = first & 0xFFFF, first >> 16, at + 4
    if size == 0:  # not a small element
        kind, size, start = first, int.from_bytes(data[at + 4 : at + 8], byteorder), at + 8
    elif size > 4:
        raise ValueError(f"a small element has {size} bytes")
    if start + size > len(data) and not cut:
        raise ValueError(f"expected {size} bytes of an element; got {len(data) - start}")
    return _Element(kind, start, size, at + 8 if start == at + 4 else start + size + -size % 8)


def _level_5(file: BinaryIO, order: str) -> Iterator[tuple[str, StoredArray]]:
    length, at = file.seek(0, 2), 128
    while at < length:
        file.seek(at)
        tag = _element(file.read(8), 0, order, cut=True)
        start, end = at + 8, at + 8 + tag.size
        if end > length:
            raise ValueError(f"expected {tag.size} bytes of an element; got {length - start}")
        if tag.kind == COMPRESSED:
            name, array = _compressed(file, start, tag.size, order)
        elif tag.kind == MATRIX:
            head = file.read(min(tag.size, MAX_HEADER))
            data = partial(_bytes_at, file, start, tag.size)
            name, array = _variable(head, tag.size, order, data)
        else:
            raise ValueError(f"an element has the type {tag.kind}")
        if name:
            yield name, array
        at = end


def _compressed(file: BinaryIO, start: int, size: int, order: str) -> tuple[str, StoredArray]:
    """Return the variable in a compressed element; it is decompressed only to be loaded."""
    head = _decompressed(file, start, size, MAX_HEADER + 8)
    tag = _element(head, 0, order, cut=True)
    if tag.kind != MATRIX:
        raise ValueError(f"a compressed element has the type {tag.kind}")

    def data() -> bytes:
        whole = _decompressed(file, start, size, tag.size + 8)
        if len(whole) != tag.size + 8:
            raise ValueError(f"{tag.size + 8} bytes decompress to {len(whole)}")
        return whole[8:]

    return _variable(head[8:], tag.size, order, data)


def _decompressed(file: BinaryIO, start: int, size: int, n_bytes: int) -> bytes:
    """Return so many bytes of a stream, and one more if it does not end there."""
    file.seek(start)
    stream = zlib.decompressobj()
    data = stream.decompress(file.read(size), n_bytes + 1)
    if len(data) <= n_bytes and not stream.eof:
        raise ValueError("a compressed element is not complete")
    return data


def _variable(
    head: bytes, size: int, order: str, data: Callable[[], bytes]
) -> tuple[str, StoredArray]:
    """Return name and array of a matrix element of `size` bytes, from the first of them."""
    nothing = StoredArray((), np.dtype(object), lambda: np.zeros((), object))
    if size == 0:
        return "", nothing
    flags = _element(head, 0, order)
    if flags.kind != 6 or flags.size != 8:
        raise ValueError("a variable has no flags")
    bits = int(np.frombuffer(head, order + "u4", 1, flags.start)[0])
    if bits & 0xFF == OPAQUE:
        return "", nothing
    dims = _element(head, flags.end, order)
    if dims.kind not in (5, 6) or not 8 <= dims.size <= 256:
        raise ValueError("a variable has no dimensions")
    shape = tuple(np.frombuffer(head, order + "i4", dims.size // 4, dims.start).tolist())
    label = _element(head, dims.end, order)
    name = head[label.start : label.start + label.size].decode("latin-1").rstrip("\0")
    if label.kind not in (1, 2, 16):
        raise ValueError("a variable has no name")
    if bits & 0xFF not in CLASSES:
        return name, nothing
    if any(n < 0 for n in shape):
        raise ValueError(f"{name!r} has the shape {shape}")
    kind, is_complex = CLASSES[bits & 0xFF], bool(bits & COMPLEX_FLAG)
    dtype = np.dtype("c8" if kind == "f4" else "c16") if is_complex else np.dtype(kind)
    n = math.prod(shape)
    if not n <= size <= MAX_HEADER + 16 * n:  # a number has 1 to 16 bytes
        raise ValueError(f"{name!r} has the shape {shape} in {size} bytes")

    def load() -> NDArray[Any]:
        with damage_refused(KIND):
            at, whole = label.end, data()
            parts: list[NDArray[Any]] = []
            for _ in range(1 + is_complex):
                part = _element(whole, at, order)
                parts.append(_numbers(whole, part, order, n))
                at = part.end
            array = parts[0] + 1j * parts[1] if is_complex else parts[0]
            return array.astype(dtype).reshape(shape, order="F")

    return name, StoredArray(shape, dtype, load)


def _numbers(data: bytes, part: _Element, order: str, n: int) -> NDArray[Any]:
    if part.kind not in NUMBERS:
        raise ValueError(f"numbers have the type {part.kind}")
    stored = np.dtype(order + NUMBERS[part.kind])
    if n * stored.itemsize != part.size:
        raise ValueError(f"{n} numbers of {stored.itemsize} bytes have {part.size} bytes")
    return np.frombuffer(data, stored, n, part.start)


def _bytes_at(file: BinaryIO, start: int, size: int) -> bytes:
    file.seek(start)
    return file.read(size)


# level 4


def _level_4(file: BinaryIO) -> Iterator[tuple[str, StoredArray]]:
    length, at = file.seek(0, 2), 0
    while at < length:
        file.seek(at)
        head = file.read(20)
        if len(head) < 20:
            raise ValueError("a variable has no header")
        order = "<" if int.from_bytes(head[:4], "little") < 10000 else ">"
        code, rows, columns, is_complex, n_name = np.frombuffer(head, order + "i4").tolist()
        kind, text = code // 10 % 10, code % 10
        is_known = 0 <= code < 2000 and code % 1000 < 100 and kind in LEVEL_4 and text < 3
        if not is_known or min(rows, columns) < 0 or is_complex not in (0, 1):
            raise ValueError("a variable has no header")
        if not 1 <= n_name <= MAX_HEADER:
            raise ValueError(f"a name has {n_name} bytes")
        name = file.read(n_name).split(b"\0")[0].decode("latin-1")
        stored, start = np.dtype(order + LEVEL_4[kind]), at + 20 + n_name
        at = start + rows * columns * stored.itemsize * (1 + is_complex)
        if at > length:
            raise ValueError(f"expected {at - start} bytes of {name!r}; got {length - start}")
        array = _level_4_array(file, start, (rows, columns), stored, bool(is_complex))
        yield name, array if text == 0 else array._replace(dtype=np.dtype(object))


def _level_4_array(
    file: BinaryIO, start: int, shape: tuple[int, int], stored: np.dtype[Any], is_complex: bool
) -> StoredArray:
    n = shape[0] * shape[1]
    native = np.dtype("c8" if stored.itemsize == 4 else "c16") if is_complex else stored
    native = native.newbyteorder("=")

    def load() -> NDArray[Any]:
        with damage_refused(KIND):
            data = _bytes_at(file, start, n * stored.itemsize * (1 + is_complex))
            values = np.frombuffer(data, stored, n * (1 + is_complex))
            array = values[:n] + 1j * values[n:] if is_complex else values
            return array.astype(native).reshape(shape, order="F")

    return StoredArray(shape, native, load)
