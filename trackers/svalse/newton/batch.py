"""Records of arrays with a common leading axis, one row a problem."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from arrivals.typing import Bool, Int


def any_set(rows: Bool) -> bool:
    """Return True if any of the rows, (B,), is set: for few, a list is faster than an array.

    Examples
    --------
    >>> any_set(np.array([False, True])), all_set(np.array([False, True]))
    (True, False)
    """
    return True in rows.tolist()


def all_set(rows: Bool) -> bool:
    """Return True if all rows, (B,), are set."""
    return False not in rows.tolist()


@dataclass(eq=False)
class BatchRecord:
    """A record whose fields are arrays, or such records, with the same leading axis.

    A selection of all rows is the record itself, not a copy, so that one problem alone has no
    overhead: select rows, change them, replace them.
    """

    def __len__(self) -> int:
        return len(next(iter(vars(self).values())))

    def select(self, rows: Bool) -> Self:
        """Return the rows that are set."""
        if all_set(rows):
            return self
        return self._at(np.flatnonzero(rows))

    def _at(self, index: Int) -> Self:
        return type(self)(
            **{
                name: part._at(index) if isinstance(part, BatchRecord) else part.take(index, axis=0)
                for name, part in vars(self).items()
            }
        )

    def replace_rows(self, rows: Bool, other: Self) -> Self:
        """Return the record with the set rows replaced; shorter arrays are filled up with 0."""
        return other if all_set(rows) else self._replaced(np.flatnonzero(rows), other)

    def _replaced(self, index: Int, other: Self) -> Self:
        return type(self)(
            **{
                name: _replaced(part, index, getattr(other, name))
                for name, part in vars(self).items()
            }
        )


def _replaced(old: Any, index: Int, new: Any) -> Any:
    if isinstance(old, BatchRecord):
        return old._replaced(index, new)
    if old.shape[1:] == new.shape[1:]:
        full = old.copy()
    else:
        shape = tuple(map(max, old.shape[1:], new.shape[1:]))
        full, new = enlarged(old, shape, copy=True), enlarged(new, shape)
    full[index] = new
    return full


def enlarged(array: NDArray[Any], shape: tuple[int, ...], copy: bool = False) -> NDArray[Any]:
    """Return an array with zeros added at the ends of all axes but the first.

    Examples
    --------
    >>> enlarged(np.ones((2, 1)), (3,))
    array([[1., 0., 0.],
           [1., 0., 0.]])
    """
    if array.shape[1:] == shape:
        return array.copy() if copy else array
    full = np.zeros((len(array), *shape), dtype=array.dtype)
    full[tuple(map(slice, array.shape))] = array
    return full
