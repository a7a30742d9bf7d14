"""Samples that stay in their file until rows of them are selected."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.measurements import LARGEST


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

    ndim = 2

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        start, stop, step = rows.indices(len(self))
        block = self.load(start, max(start, stop))
        block = block if self.channels is None else block[:, self.channels]
        return cleaned(block[::step], self.dtype)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return self[:] if dtype is None else self[:].astype(dtype, copy=False)

    def select(self, channels: Sequence[int]) -> StoredSamples:
        """Return some of the channels, in the given order."""
        known = range(self.shape[1]) if self.channels is None else self.channels
        chosen = tuple(known[channel] for channel in channels)
        return replace(self, shape=(len(self), len(chosen)), channels=chosen)


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
