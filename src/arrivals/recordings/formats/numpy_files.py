"""NumPy files: headers first, arrays on demand."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
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

ZIP = b"PK"  # first bytes of a zip file
KIND = "NumPy file of numbers"


def is_numpy(head: bytes) -> bool:
    """Return True for the first bytes of an npy or npz file."""
    return head.startswith((b"\x93NUMPY", b"PK\x03\x04"))


def read_numpy(path: Path, options: ReadingOptions) -> FileContents:
    """Return the selected array of an npz file, or the array of an npy file."""
    with open_input(path) as file:
        return selected(numpy_arrays(file), options)


def numpy_arrays(file: BinaryIO) -> dict[str, StoredArray]:
    """Return the arrays of an npz file by name, or the array of an npy file under no name.

    Parameters
    ----------
    file : binary file
        Regular file; the arrays can be loaded while it is open.

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
            return {"": _stored(file, size, lambda: _at_start(file))}
        archive = zipfile.ZipFile(file)
        members = [each for each in archive.infolist() if each.filename.endswith(".npy")]
        return {each.filename.removesuffix(".npy"): _member(archive, each) for each in members}


def _at_start(file: BinaryIO) -> BinaryIO:
    file.seek(0)
    return file


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> StoredArray:
    with archive.open(info) as file:
        return _stored(file, info.file_size, lambda: archive.open(info))


def _stored(file: Any, size: int, again: Callable[[], Any]) -> StoredArray:
    """Return the array whose header is at the beginning of a file of so many bytes."""
    version = read_magic(file)
    if version == (3, 0):  # of records with names
        return StoredArray((), np.dtype(object), lambda: np.zeros((), object))
    is_first = version == (1, 0)
    read_header = read_array_header_1_0 if is_first else read_array_header_2_0
    shape, _, dtype = read_header(file)
    if any(n < 0 for n in shape):
        raise ValueError(f"the header has the shape {shape}")
    stored = StoredArray(shape, dtype, lambda: _loaded(again()))
    present = size - file.tell()
    if not dtype.hasobject and stored.n_bytes > present:
        raise ValueError(f"expected {stored.n_bytes} bytes of data; got {present}")
    return stored


def _loaded(file: Any) -> NDArray[Any]:
    with damage_refused(KIND):
        return np.asarray(read_array(file, allow_pickle=False))
