"""Raw complex samples (IQ) of interleaved channels, without a header: files and streams."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.formats.file_contents import FileContents, ReadingOptions
from arrivals.recordings.raw_numbers import real_type
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.validation import count

SHOWN = 65_536  # numbers at the beginning of a file whose size is checked
SMALLEST, LARGEST_REAL = 1e-20, 1e20  # of samples as reals that are not those of another type
FLOATS, LEAST_FLOATS = (1e-6, 1e4), 64  # sizes of nearly all bytes that are float32, and number


class RawType(NamedTuple):
    """Type of the real and imaginary parts: the number stored at 0, and that of full scale."""

    dtype: np.dtype[Any]
    zero: float = 0.0
    full_scale: float = 1.0

    @property
    def pair_type(self) -> np.dtype[Any]:
        """complex64 for parts of up to 16 bits and float32, else complex128."""
        return np.result_type(real_type(self.dtype.str), np.complex64)

    def decoded(self, raw: bytes | NDArray[Any]) -> NDArray[np.complexfloating[Any]]:
        """Return pairs of parts as complex numbers, full scale 1."""
        numbers = np.frombuffer(raw, self.dtype)
        real = real_type(self.dtype.str).type
        parts = numbers.astype(real)
        if numbers.dtype.kind != "f":
            parts -= real(self.zero)
            parts *= real(1 / self.full_scale)
        return np.asarray(parts.view(self.pair_type))


RAW_TYPES = {
    "cf32": RawType(np.dtype("<f4")),
    "cf64": RawType(np.dtype("<f8")),
    "cs32": RawType(np.dtype("<i4"), full_scale=2.0**31),
    "cs16": RawType(np.dtype("<i2"), full_scale=2.0**15),
    "cs8": RawType(np.dtype("i1"), full_scale=2.0**7),
    "cu8": RawType(np.dtype("u1"), 127.5, 127.5),
}
SUFFIXES = {
    ".cf32": "cf32", ".fc32": "cf32", ".cfile": "cf32", ".cf64": "cf64", ".fc64": "cf64",
    ".cs32": "cs32", ".sc32": "cs32", ".cs16": "cs16", ".sc16": "cs16", ".cs8": "cs8",
    ".sc8": "cs8", ".cu8": "cu8", ".uc8": "cu8", ".iq": "", ".bin": "", ".dat": "", ".raw": "",
}  # fmt: skip


def read_iq(path: Path, options: ReadingOptions) -> FileContents:
    """Return the complex samples of a raw file, of which blocks are read on demand.

    Parameters
    ----------
    path : path
        Little-endian pairs of real and imaginary part, one pair a channel in turn.
    options : ReadingOptions
        `format` is one of `RAW_TYPES`, that of the suffix if None; `n_channels` is one if None.

    Returns
    -------
    FileContents
        Integers are scaled to [-1, 1].

    Raises
    ------
    ValueError
        If the type is unknown, the file is not a whole number of samples of all channels, or its
        numbers cannot be of that type.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "two.cs8")
    ...     _ = path.write_bytes(bytes([64, 0, 0, 64]))
    ...     read_iq(path, ReadingOptions(n_channels=2)).array[:].tolist()
    [[(0.5+0j), 0.5j]]
    """
    name = SUFFIXES.get(f".{options.format}" if options.format else path.suffix.lower(), "")
    if not name:
        raise ValueError(
            f"the type of raw samples is unknown: pass format= (--format), one of "
            f"{', '.join(RAW_TYPES)}"
        )
    kind, n_channels = RAW_TYPES[name], count("n_channels", options.n_channels or 1)
    n_bytes, frame = path.stat().st_size, 2 * kind.dtype.itemsize * n_channels
    n_samples, rest = divmod(n_bytes, frame)
    if rest or not n_samples:
        channels = f"{n_channels} channel{'s' * (n_channels > 1)}"
        raise ValueError(
            f"truncated, or not {name} of {channels}: {n_bytes} bytes are not a whole number of "
            f"samples of {frame} bytes: pass the right format and number of channels, or remove "
            f"the last {rest} bytes"
        )
    _check_plausible(path, name, kind)
    load = partial(_rows, path, kind, n_channels)
    return FileContents(StoredSamples((n_samples, n_channels), np.dtype(complex), load))


def _rows(
    path: Path, kind: RawType, n_channels: int, start: int, stop: int
) -> NDArray[np.complexfloating[Any]]:
    """Return rows of all channels, (stop - start, n_channels)."""
    n = 2 * n_channels
    numbers = np.fromfile(
        path, kind.dtype, (stop - start) * n, offset=start * n * kind.dtype.itemsize
    )
    return kind.decoded(numbers).reshape(-1, n_channels)


def _check_plausible(path: Path, name: str, kind: RawType) -> None:
    """Raise a ValueError if most numbers are of sizes that those of another type have."""
    if kind.dtype.kind != "f":
        with np.errstate(invalid="ignore"):
            size = np.abs(np.fromfile(path, "<f4", SHOWN))
            are_floats = ((size > FLOATS[0]) & (size < FLOATS[1])).mean() > 0.99
        if size.size >= LEAST_FLOATS and are_floats:
            raise ValueError(f"the samples are not {name} but cf32: pass another format (--format)")
        return
    numbers = np.fromfile(path, kind.dtype, SHOWN)
    with np.errstate(invalid="ignore"):
        size = np.abs(numbers[numbers != 0])
        implausible = ~((size > SMALLEST) & (size < LARGEST_REAL)) & ~np.isnan(size)
    if implausible.sum() > 0.1 * size.size:
        raise ValueError(
            f"the samples are not {name}: {implausible.mean():.0%} of the numbers are below "
            f"{SMALLEST:g} or above {LARGEST_REAL:g}: pass another format (--format cs16)"
        )


def complex_frames(source: BinaryIO, dtype: str) -> tuple[BinaryIO, str]:
    """Return a source whose type is in `DTYPES`, and its type.

    Parameters
    ----------
    source : binary file
        As in `live_snapshots`.
    dtype : str
        One of `DTYPES` or of `RAW_TYPES`; pairs of the latter are converted to complex numbers.

    Returns
    -------
    source : binary file
    dtype : str

    Examples
    --------
    >>> import io, numpy as np
    >>> source, dtype = complex_frames(io.BytesIO(bytes([64, 0, 0, 64])), "cs8")
    >>> dtype, np.frombuffer(source.read(16), dtype).tolist()
    ('complex64', [(0.5+0j), 0.5j])
    """
    if dtype not in RAW_TYPES:
        return source, dtype
    kind = RAW_TYPES[dtype]
    return cast(BinaryIO, _Converted(source, kind)), kind.pair_type.name


class _Converted:
    """Complex numbers of a source of pairs of another type."""

    def __init__(self, source: BinaryIO, kind: RawType) -> None:
        self._source, self._kind = source, kind

    def read(self, size: int) -> bytes:
        """Return the next bytes of complex numbers of the type `pair_type`."""
        pair = 2 * self._kind.dtype.itemsize
        block = self._source.read(size // self._kind.pair_type.itemsize * pair)
        return self._kind.decoded(block[: len(block) // pair * pair]).tobytes()
