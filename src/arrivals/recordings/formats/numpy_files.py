"""NumPy files: headers first, arrays on demand."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib.format import (
    read_array,
    read_array_header_1_0,
    read_array_header_2_0,
    read_magic,
)
from numpy.typing import NDArray

from arrivals.files import open_input
from arrivals.recordings.formats.file_contents import (
    FileContents,
    ReadingOptions,
    StoredArray,
    damage_refused,
    selected,
)
from arrivals.recordings.raw_numbers import RawRows

ZIP = b"PK"  # first bytes of a zip file
KIND = "NumPy file of numbers"


def is_numpy(head: bytes) -> bool:
    """Return True for the first bytes of an npy or npz file."""
    return head.startswith((b"\x93NUMPY", b"PK\x03\x04"))


def read_numpy(path: Path, options: ReadingOptions) -> FileContents:
    """Return the selected array of an npz file, or the array of an npy file."""
    with open_input(path) as file:
        return selected(numpy_arrays(file, path), options)


def numpy_arrays(file: BinaryIO, path: Path | None = None) -> dict[str, StoredArray]:
    """Return the arrays of an npz file by name, or the array of an npy file under no name.

    Parameters
    ----------
    file : binary file
        Regular file; the arrays can be loaded while it is open.
    path : path, optional
        Its name, by which rows of an npy file can be read after it was closed.

    Returns
    -------
    dict of str to StoredArray
        Arrays whose headers agree with the sizes in the file.

    Raises
    ------
    ValueError
        If it is not such a file, or is damaged.

    Examples
    --------
    >>> import io
    >>> file = io.BytesIO()
    >>> np.savez(file, samples=np.zeros((500, 4)), rate=1000)
    >>> arrays = numpy_arrays(file)
    >>> list(arrays), arrays["samples"].shape, arrays["samples"].n_bytes
    (['samples', 'rate'], (500, 4), 16000)
    """
    with damage_refused(KIND):
        file.seek(0)
        if file.read(2) != ZIP:
            size = file.seek(0, os.SEEK_END)
            file.seek(0)
            return {"": _stored(file, size, lambda: _at_start(file), path)}
        archive = zipfile.ZipFile(file)
        members = [each for each in archive.infolist() if each.filename.endswith(".npy")]
    if any(each.flag_bits & 1 for each in members):
        raise ValueError("the file is encrypted: save it without a password")
    with damage_refused(KIND):
        return {each.filename.removesuffix(".npy"): _member(archive, each) for each in members}


def _at_start(file: BinaryIO) -> BinaryIO:
    file.seek(0)
    return file


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> StoredArray:
    with archive.open(info) as file:
        return _stored(file, info.file_size, lambda: archive.open(info))


def _stored(
    file: Any, size: int, again: Callable[[], Any], path: Path | None = None
) -> StoredArray:
    """Return the array whose header is at the beginning of a file of so many bytes."""
    version = read_magic(file)
    if version == (3, 0):  # of records with names
        return StoredArray((), np.dtype(object), lambda: np.zeros((), object))
    is_first = version == (1, 0)
    read_header = read_array_header_1_0 if is_first else read_array_header_2_0
    shape, by_columns, dtype = read_header(file)
    if any(n < 0 for n in shape):
        raise ValueError(f"the header has the shape {shape}")
    stored = StoredArray(shape, dtype, lambda: _loaded(again()))
    present = size - file.tell()
    if not dtype.hasobject and stored.n_bytes > present:
        raise ValueError(f"expected {stored.n_bytes} bytes of data; got {present}")
    if path is None or len(shape) != 2 or dtype.kind not in "iufc":
        return stored
    if by_columns:
        return stored._replace(rows=ColumnRows(path, file.tell(), dtype, shape))
    return stored._replace(rows=RawRows(path, file.tell(), dtype.str, shape[1]))


@dataclass(frozen=True)
class ColumnRows:
    """Loader of rows of an array that is stored column by column, as `RawRows`."""

    path: Path
    offset: int
    dtype: np.dtype[Any]
    shape: tuple[int, int]

    def __call__(self, start: int, stop: int) -> NDArray[Any]:
        """Return the rows from `start` to `stop`."""
        size, rows = self.dtype.itemsize, np.empty((stop - start, self.shape[1]), self.dtype)
        for column in range(self.shape[1]):
            before = self.offset + (column * self.shape[0] + start) * size
            rows[:, column] = np.fromfile(self.path, self.dtype, stop - start, offset=before)
        return rows


def _loaded(file: Any) -> NDArray[Any]:
    with damage_refused(KIND):
        return np.asarray(read_array(file, allow_pickle=False))
