"""Samples that stay in their file until rows of them are selected."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.measurements import LARGEST

BLOCK = 2**20  # numbers of the rows that are loaded together when rows are iterated over


@dataclass(frozen=True, eq=False)
class StoredSamples:
    """Samples of a file, of which only selected rows are in memory.

    Parameters
    ----------
    shape : (int, int)
        Numbers of samples and of channels in the file.
    dtype : dtype
        float32, float64 or complex128: the type of the selected rows.
    load : callable
        `load(start, stop)` reads rows of all channels, (stop - start, n_channels), numbers of any
        type.
    channels : tuple of int, optional
        Channels that are selected, in this order; all if None.
    scale : float, optional
        Factor of loaded integers; 1 if None.

    Examples
    --------
    >>> numbers = np.arange(12.0).reshape(6, 2)
    >>> samples = StoredSamples((6, 2), np.dtype(float), lambda start, stop: numbers[start:stop])
    >>> samples[4:].tolist(), len(samples), samples.select([1])[:2].tolist()
    ([[8.0, 9.0], [10.0, 11.0]], 6, [[1.0], [3.0]])
    """

    shape: tuple[int, int]
    dtype: np.dtype[Any]
    load: Callable[[int, int], NDArray[Any]]
    channels: tuple[int, ...] | None = None
    scale: float | None = None

    ndim = 2

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: Any) -> NDArray[Any]:
        rows, columns = index if isinstance(index, tuple) else (index, slice(None))
        if not isinstance(rows, slice):
            raise TypeError(f"rows of stored samples must be a slice; got {type(rows).__name__}")
        start, stop, step = rows.indices(len(self))
        if step < 1:
            raise ValueError(f"the step of rows must be positive; got {step}")
        block = self.load(start, max(start, stop))[::step]
        block = block if self.channels is None else block[:, self.channels]
        block = block[:, columns]
        if self.scale is not None and block.dtype.kind in "iu":  # finite
            return np.asarray(np.multiply(block, self.dtype.type(self.scale), dtype=self.dtype))
        return cleaned(block, self.dtype)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return self[:] if dtype is None else self[:].astype(dtype, copy=False)

    def __iter__(self) -> Iterator[NDArray[Any]]:
        n = max(1, BLOCK // max(1, self.shape[1]))
        for start in range(0, len(self), n):
            yield from self[start : start + n]

    @property
    def n_bytes(self) -> int:
        """Size of all rows in memory, bytes."""
        return self.shape[0] * self.shape[1] * self.dtype.itemsize

    def select(self, channels: Sequence[int]) -> StoredSamples:
        """Return some of the channels, in the given order."""
        known = range(self.shape[1]) if self.channels is None else self.channels
        chosen = tuple(known[channel] for channel in channels)
        return replace(self, shape=(len(self), len(chosen)), channels=chosen)


def row_type(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type of samples in memory: float32 if they are, else float64; or complex128.

    Examples
    --------
    >>> [str(row_type(np.dtype(kind))) for kind in (">f4", "i2", "c8")]
    ['float32', 'float64', 'complex128']
    """
    if dtype.kind == "c":
        return np.dtype(np.complex128)
    return np.dtype(np.float32 if dtype.kind == "f" and dtype.itemsize == 4 else np.float64)


def cleaned(block: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return numbers of a type, NaN where they are infinite or too large.

    Examples
    --------
    >>> cleaned(np.array([1.0, np.inf]), np.dtype("f4"))
    array([ 1., nan], dtype=float32)
    """
    with np.errstate(over="ignore", invalid="ignore"):
        samples = block.astype(dtype, copy=False)
    valid = np.isfinite(samples) if dtype.itemsize == 4 else np.abs(samples) < LARGEST
    return samples if valid.all() else np.where(valid, samples, dtype.type(np.nan))
