"""Records of arrays with one leading axis in common: one row a problem, many solved at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from arrivals.typing import Bool


def some(rows: Bool) -> bool:
    """Tell whether any of some rows, (B,), is on: of few, a list is quicker than an array."""
    return True in rows.tolist()


def every(rows: Bool) -> bool:
    """Tell whether all rows, (B,), are on."""
    return False not in rows.tolist()


@dataclass(eq=False)
class Rows:
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
        parts = vars(self).items()
        return type(self)(
            **{
                name: part.take(rows) if isinstance(part, Rows) else part[rows]
                for name, part in parts
            }
        )

    def put(self, rows: Bool, other: Self) -> Self:
        """Return the record with those rows replaced; what is too short is filled up with 0."""
        if every(rows):
            return other
        return type(self)(
            **{name: _put(part, rows, getattr(other, name)) for name, part in vars(self).items()}
        )


def _put(old: Any, rows: Bool, new: Any) -> Any:
    if isinstance(old, Rows):
        return old.put(rows, new)
    if old.ndim == 1:
        old = old.copy()
        old[rows] = new
        return old
    shape = tuple(np.maximum(old.shape[1:], new.shape[1:]).tolist())
    full = enlarged(old, shape, copy=True)
    full[rows] = enlarged(new, shape)
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
