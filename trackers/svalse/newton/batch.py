"""Records of arrays with one leading axis in common: one row a problem, many solved at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from arrivals.typing import Bool, Int


def some(rows: Bool) -> bool:
    """Tell whether any of some rows, (B,), is on: of few, a list is quicker than an array.

    Examples
    --------
    >>> some(np.array([False, True])), every(np.array([False, True]))
    (True, False)
    """
    return True in rows.tolist()


def every(rows: Bool) -> bool:
    """Tell whether all rows, (B,), are on."""
    return False not in rows.tolist()


@dataclass(eq=False)
class BatchRecord:
    """A record whose fields are arrays, or such records, with the same leading axis.

    Asked for all of its rows a record gives itself, not a copy, so that one problem alone costs
    nothing: take rows, change them, put them back.
    """

    def __len__(self) -> int:
        return len(next(iter(vars(self).values())))

    def take(self, rows: Bool) -> Self:
        """Return some of the rows."""
        if every(rows):
            return self
        return self._taken(np.flatnonzero(rows))

    def _taken(self, of: Int) -> Self:
        return type(self)(
            **{
                name: part._taken(of) if isinstance(part, BatchRecord) else part.take(of, axis=0)
                for name, part in vars(self).items()
            }
        )

    def put(self, rows: Bool, other: Self) -> Self:
        """Return the record with those rows replaced; what is too short is filled up with 0."""
        return other if every(rows) else self._with(np.flatnonzero(rows), other)

    def _with(self, of: Int, other: Self) -> Self:
        return type(self)(
            **{name: _put(part, of, getattr(other, name)) for name, part in vars(self).items()}
        )


def _put(old: Any, of: Int, new: Any) -> Any:
    if isinstance(old, BatchRecord):
        return old._with(of, new)
    if old.shape[1:] == new.shape[1:]:
        full = old.copy()
    else:
        shape = tuple(map(max, old.shape[1:], new.shape[1:]))
        full, new = enlarged(old, shape, copy=True), enlarged(new, shape)
    full[of] = new
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
