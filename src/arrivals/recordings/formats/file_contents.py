"""Contents of a recording file, and arrays that are loaded only when they are selected."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from arrivals.typing import Float

MAX_BYTES = 2_000_000_000  # of the arrays that are loaded from a file


class FileContents(NamedTuple):
    """Array as stored in a file, its rate in Hz and times in s, None if unknown."""

    array: NDArray[Any]
    rate: float | None = None
    time: Float | None = None


class StoredArray(NamedTuple):
    """Array of a file whose header has been read: its shape, its type, and how to load it."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    load: Callable[[], NDArray[Any]]

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


@contextmanager
def damage_refused(kind: str) -> Iterator[None]:
    """Turn any error of a parser into a ValueError, as damaged files raise all kinds of errors."""
    try:
        yield
    except Exception as error:
        raise ValueError(f"truncated, or not a {kind}: {error}") from error
