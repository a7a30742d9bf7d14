"""Contents of a recording file, and arrays that are loaded only when they are selected."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.stored_samples import StoredSamples, row_type
from arrivals.typing import Float

MAX_BYTES = 2_000_000_000  # of the arrays that are loaded from a file at once
RATES = ("rate", "fs", "Fs", "sample_freq", "sampling_rate", "sample_rate")  # names of a scalar


class FileContents(NamedTuple):
    """Contents of a file; None where unknown.

    The array has the shape (n_samples, n_channels) or (n_samples,), `rate` and `frequency` (centre
    of complex samples) are in Hz, `time` (of complex snapshots, or evenly spaced) is in s. `names`
    are those of the channels, `note` is one line for the user.
    """

    array: NDArray[Any] | StoredSamples
    rate: float | None = None
    time: Float | None = None
    frequency: float | None = None
    names: tuple[str, ...] | None = None
    note: str | None = None


@dataclass(frozen=True)
class ReadingOptions:
    """Options of `read` that concern the contents of a file.

    Parameters
    ----------
    variable : str, optional
        Name of the array in a file of several.
    transpose : bool
        True if the rows of the file are channels; `read` transposes the array.
    max_bytes : float
        Largest size of the numbers that are loaded at once.
    rate_required : bool
        True to refuse real samples without a rate.
    format : str, optional
        Format of a file without a header, such as cs16; it takes the place of the suffix.
    n_channels : int, optional
        Number of channels of a file without a header.

    Examples
    --------
    >>> ReadingOptions(max_bytes=1000).check(2000, is_real=True, has_rate=True)
    Traceback (most recent call last):
    ValueError: the data must have at most 1e-06 GB; got 2e-06 GB: pass max_bytes= to read more
    """

    variable: str | None = None
    transpose: bool = False
    max_bytes: float = MAX_BYTES
    rate_required: bool = False
    format: str | None = None
    n_channels: int | None = None

    def check(self, n_bytes: int, is_real: bool, has_rate: bool) -> None:
        """Refuse data that are too large or lack a rate."""
        check_size(n_bytes, self.max_bytes)
        if self.rate_required and is_real and not has_rate:
            raise ValueError("the rate is unknown: pass rate= (--rate) in Hz")


class StoredArray(NamedTuple):
    """Array of a file whose header has been read: its shape, its type, and how to load it.

    `rows` reads rows from `start` to `stop` after the file was closed, None if it cannot.
    """

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    load: Callable[[], NDArray[Any]]
    rows: Callable[[int, int], NDArray[Any]] | None = None

    @property
    def size(self) -> int:
        """Number of entries."""
        return prod(self.shape)

    @property
    def n_bytes(self) -> int:
        """Size in memory, bytes."""
        return self.size * self.dtype.itemsize

    @property
    def is_numeric(self) -> bool:
        """True if the entries are numbers."""
        return self.dtype.kind in "iufc"

    @property
    def is_real(self) -> bool:
        """True if the entries are real numbers."""
        return self.dtype.kind in "iuf"


def selected(stored: Mapping[str, StoredArray], options: ReadingOptions) -> FileContents:
    """Return the selected array of a file of named arrays, with its rate and times.

    Examples
    --------
    >>> numbers = np.zeros((5, 2))
    >>> array = StoredArray(numbers.shape, numbers.dtype, lambda: numbers)
    >>> rate = StoredArray((), np.dtype(float), lambda: np.array(8.0))
    >>> selected({"samples": array, "fs": rate}, ReadingOptions()).rate
    8.0
    """
    name = _choice(stored, options.variable)
    chosen, time = stored[name], stored.get("time")
    rates = (stored[key] for key in RATES if key in stored)
    one = next((each for each in rates if each.size == 1 and each.is_real), None)
    has_times = time is not None and time.is_numeric and time.size > 1
    if not chosen.is_numeric:
        raise ValueError(f"samples must be numbers; got {chosen.dtype}")
    is_real = chosen.is_real and name != "snapshots"
    array: NDArray[Any] | StoredSamples
    if chosen.rows is not None and len(chosen.shape) == 2 and not options.transpose:
        options.check(0, is_real, one is not None or has_times)
        kind = row_type(chosen.dtype) if is_real else np.dtype(complex)
        array = StoredSamples((chosen.shape[0], chosen.shape[1]), kind, chosen.rows)
    else:
        options.check(chosen.n_bytes, is_real, one is not None or has_times)
        array = chosen.load()
        array = array.astype(complex) if name == "snapshots" else array
    times = None
    if time is not None and has_times:
        check_size(time.n_bytes, options.max_bytes)
        times = np.ravel(time.load())
    return FileContents(array, None if one is None else float(one.load().item()), times)


def _choice(stored: Mapping[str, StoredArray], variable: str | None) -> str:
    names = list(stored)
    if names == [""]:  # of an npy file
        return ""
    if variable is not None:
        if variable not in names:
            raise ValueError(f"variable must be one of {_listed(names)}; got {variable!r}")
        return variable
    arrays = [name for name in names if stored[name].is_numeric and stored[name].size > 1]
    standard = [name for name in arrays if name in ("samples", "snapshots")]
    others = [name for name in arrays if name not in (*RATES, "time")]
    candidates = standard or others
    if len(candidates) != 1:
        number = "several arrays" if candidates else "no array"
        raise ValueError(f"the file has {number}: pass variable=, one of {_listed(names)}")
    return candidates[0]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names)) or "nothing"


def check_size(n_bytes: int, max_bytes: float) -> None:
    """Raise a ValueError if data would need too much memory.

    Examples
    --------
    >>> check_size(3_000_000_000, 2e9)
    Traceback (most recent call last):
    ValueError: the data must have at most 2 GB; got 3 GB: pass max_bytes= to read more
    """
    if n_bytes > max_bytes:
        limit, got = max_bytes / 1e9, n_bytes / 1e9
        raise ValueError(
            f"the data must have at most {limit:.4g} GB; got {got:.4g} GB: "
            "pass max_bytes= to read more"
        )


def check_length(expected: int, present: int, noun: str = "bytes") -> None:
    """Raise a ValueError if a file is shorter than its header says.

    Examples
    --------
    >>> check_length(100, 90)
    Traceback (most recent call last):
    ValueError: truncated: expected 100 bytes; got 90: copy it again
    """
    if present < expected:
        raise ValueError(f"truncated: expected {expected} {noun}; got {present}: copy it again")


@contextmanager
def damage_refused(kind: str) -> Iterator[None]:
    """Turn any error of a parser into a ValueError, as damaged files raise all kinds of errors."""
    try:
        yield
    except Exception as error:
        raise ValueError(f"truncated, or not a {kind}: {error}") from error


def import_reader_package(name: str, what: str) -> Any:
    """Return a package of the extra `io`, or raise an error with the command that installs it.

    Parameters
    ----------
    name : str
        Name of the package, such as soundfile.
    what : str
        What requires it, such as "a .flac file".

    Returns
    -------
    module

    Raises
    ------
    ImportError
        If it cannot be imported.

    Examples
    --------
    >>> import_reader_package("no_such_package", "a .flac file")
    Traceback (most recent call last):
    ImportError: reading a .flac file requires no_such_package: pip install "arrivals[io]"
    """
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:  # OSError: of a library that the package lacks
        raise ImportError(f'reading {what} requires {name}: pip install "arrivals[io]"') from error
