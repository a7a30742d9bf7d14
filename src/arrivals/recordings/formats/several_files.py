"""One recording of several files, and the layout of files without a header."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.measurement_models import SensorArray
from arrivals.recordings.formats.file_contents import FileContents
from arrivals.recordings.stored_samples import StoredSamples, row_type
from arrivals.validation import count


def file_names(path: Any) -> list[Path]:
    """Return the files that an argument names; none for an array of numbers.

    Examples
    --------
    >>> [str(each) for each in file_names(["a.wav", Path("b.wav")])], file_names([1.0, 2.0])
    (['a.wav', 'b.wav'], [])
    """
    if isinstance(path, str | PathLike):
        return [Path(fspath(path))]
    several = path if isinstance(path, list | tuple) else []
    are_names = all(isinstance(each, str | PathLike) for each in several)
    return [Path(fspath(each)) for each in several] if are_names else []


def raw_layout(form: str | None, array: SensorArray | None) -> tuple[str | None, int | None]:
    """Return format and number of channels of a file without a header, from cs16 or cs16:5.

    Parameters
    ----------
    form : str or None
        The format.
    array : SensorArray or None
        Array whose channels are recorded, if the format has no number of them.

    Returns
    -------
    form : str or None
    n_channels : int or None

    Raises
    ------
    ValueError
        If the number is not one.

    Examples
    --------
    >>> raw_layout("cs16:5", None), raw_layout("cs16", SensorArray.uca(5, 0.35))
    (('cs16', 5), ('cs16', 5))
    """
    name, colon, number = (form or "").partition(":")
    if colon:
        if not number.isdecimal():
            raise ValueError(f"format must be such as cs16 or cs16:5; got {form!r}")
        return name or None, count("channels", int(number))
    if array is None:
        return form, None
    wired = array.n_sensors if array.channels is None else max(array.channels) + 1
    return form, array.n_channels or wired


def check_channels(contents: Sequence[FileContents], n_channels: int | None) -> None:
    """Raise a ValueError if a file has another number of channels.

    Examples
    --------
    >>> check_channels([FileContents(np.zeros((9, 2)))], 3)
    Traceback (most recent call last):
    ValueError: the number of channels must be 2, that of the file; got 3
    """
    for each in contents:
        present = each.array.shape[1] if each.array.ndim == 2 else 1
        if present != n_channels:
            raise ValueError(
                f"the number of channels must be {present}, that of the file; got {n_channels}"
            )


def joined(
    contents: Sequence[FileContents], paths: Sequence[Path], *, transpose: bool = False
) -> FileContents:
    """Return the contents of several files as one, the channels of the first file first.

    Parameters
    ----------
    contents : sequence of FileContents
        Of each file.
    paths : sequence of path
        Their names, for messages.
    transpose : bool
        True if rows are channels, which is for a single file only.

    Returns
    -------
    FileContents

    Raises
    ------
    ValueError
        If lengths, rates or frequencies differ, or some samples are real and some complex.

    Examples
    --------
    >>> parts = [FileContents(np.full((4, 1), i)) for i in (1, 2)]
    >>> joined(parts, [Path("a.npy"), Path("b.npy")]).array.tolist()[0]
    [1, 2]
    """
    first = contents[0]
    if len(contents) == 1:
        return first
    if transpose:
        raise ValueError("transpose requires a single file")
    arrays = [each.array if each.array.ndim == 2 else each.array[:, None] for each in contents]
    for path, each, array in zip(paths[1:], contents[1:], arrays[1:], strict=True):
        properties = {
            "length": (len(arrays[0]), len(array)),
            "rate": (first.rate, each.rate),
            "frequency": (first.frequency, each.frequency),
            "kind of samples": (_kind(arrays[0]), _kind(array)),
        }
        for noun, (one, other) in properties.items():
            if one != other:
                raise ValueError(f"{path} must have the same {noun}: {one}; got {other}")
    names = [each.names or () for each in contents]
    whole = _side_by_side(arrays)
    together = tuple(name for each in names for name in each)
    return first._replace(array=whole, names=together if all(names) else None, note=None)


def _kind(array: NDArray[Any] | StoredSamples) -> str:
    return "complex" if array.dtype.kind == "c" else "real"


def _side_by_side(
    arrays: Sequence[NDArray[Any] | StoredSamples],
) -> NDArray[Any] | StoredSamples:
    if all(isinstance(array, np.ndarray) for array in arrays):
        return np.hstack(arrays)
    shape = len(arrays[0]), sum(array.shape[1] for array in arrays)
    dtype = np.result_type(*(row_type(array.dtype) for array in arrays))

    def load(start: int, stop: int) -> NDArray[Any]:
        return np.hstack([array[start:stop] for array in arrays])

    return StoredSamples(shape, dtype, load)
