"""Raw complex samples (IQ) of interleaved channels, without a header."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.formats.file_contents import FileContents, ReadingOptions
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.validation import count

SHOWN = 65_536  # numbers at the beginning of a file whose size is checked
SMALLEST, LARGEST_REAL = 1e-20, 1e20  # of samples as reals that are not those of another type


class RawType(NamedTuple):
    """Type of the real and imaginary parts: the number stored at 0, and that of full scale."""

    dtype: np.dtype[Any]
    zero: float = 0.0
    full_scale: float = 1.0

    def samples(self, numbers: NDArray[Any], n_channels: int) -> NDArray[np.complexfloating[Any]]:
        """Return interleaved parts as complex samples (n_samples, n_channels), full scale 1."""
        kind = np.float64 if numbers.dtype.itemsize > 2 else np.float32
        parts = np.ascontiguousarray((numbers - kind(self.zero)) * kind(1 / self.full_scale))
        pairs: NDArray[np.complexfloating[Any]] = parts.view(np.result_type(parts, np.complex64))
        return pairs.reshape(-1, n_channels)


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
    return kind.samples(numbers, n_channels)


def _check_plausible(path: Path, name: str, kind: RawType) -> None:
    """Raise a ValueError if most reals are of sizes that bytes of another type have."""
    if kind.dtype.kind != "f":
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
