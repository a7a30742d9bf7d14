"""Records of arrays with a common leading axis, one row a problem; components as one of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from arrivals.typing import Bool, Float, Int


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

    def changed(self, **parts: Any) -> Self:
        """Return the record with other parts: `dataclasses.replace`, without its checks."""
        new = object.__new__(type(self))
        new.__dict__ = {**self.__dict__, **parts}
        return new

    def select(self, rows: Bool) -> Self:
        """Return the rows that are set."""
        if all_set(rows):
            return self
        return self.take(np.flatnonzero(rows))

    def take(self, index: Int) -> Self:
        """Return rows by their indices, which may repeat."""
        return type(self)(
            **{
                name: part.take(index) if isinstance(part, BatchRecord) else part.take(index, 0)
                for name, part in vars(self).items()
            }
        )

    def replace_rows(self, rows: Bool, other: Self) -> Self:
        """Return the record with the set rows replaced; shorter arrays are filled up with 0."""
        return other if all_set(rows) else self._replaced(np.flatnonzero(rows), other)

    def _replaced(self, index: Int, other: Self) -> Self:
        return type(self)(
            **{
                name: replaced(part, index, getattr(other, name))
                for name, part in vars(self).items()
            }
        )


def replaced(old: Any, index: Int, new: Any) -> Any:
    """Return an array or record with some rows replaced, those of shorter arrays filled with 0."""
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


@dataclass(frozen=True)
class Layout:
    """Rows of the quantities of components in one array.

    Parameters
    ----------
    n_unknowns : int
        Unknowns d of a component.
    point_size : int
        Numbers p of a point.
    has_waves : bool
        True if components are plane or curved waves.
    """

    n_unknowns: int = 1
    point_size: int = 1
    has_waves: bool = False

    @cached_property
    def rows(self) -> tuple[slice, slice, slice, slice]:
        """Rows of point, covariance, prior mean and prior precision; single numbers follow."""
        p, q = self.point_size, self.n_unknowns * (self.n_unknowns + 1) // 2
        return slice(p), slice(p, p + q), slice(p + q, 2 * p + q), slice(2 * p + q, 2 * (p + q))

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        pairs = self.n_unknowns * (self.n_unknowns + 1)
        return 2 * self.point_size + pairs + 3 + self.has_waves


ONE_ANGLE = Layout()


@dataclass(eq=False)
class Components(BatchRecord):
    """Components of each problem in one array; its properties are views.

    Attributes
    ----------
    packed : ndarray, shape (B, n_rows, L)
        The quantities in the order of the layout.
    layout : Layout
        Rows of the quantities.
    """

    packed: Float
    layout: Layout = ONE_ANGLE

    @classmethod
    def zeros(cls, n_problems: int, n_components: int, layout: Layout = ONE_ANGLE) -> Components:
        """Return components of which all is zero.

        Examples
        --------
        >>> components = Components.zeros(1, 2)
        >>> components.mu[0, 1] = 0.5
        >>> components.mu
        array([[0. , 0.5]])
        """
        return cls(np.zeros((n_problems, layout.n_rows, n_components)), layout)

    def take(self, index: Int) -> Components:
        """Return rows by their indices, which may repeat."""
        return self.like(self.packed.take(index, axis=0))

    def _replaced(self, index: Int, other: Self) -> Components:
        return self.like(replaced(self.packed, index, other.packed))

    def like(self, packed: Float) -> Components:
        """Return other components of the same layout."""
        return Components(packed, self.layout)

    @property
    def point(self) -> Float:
        """Mean point, (B, p, L)."""
        return self.packed[:, self.layout.rows[0]]

    @property
    def covariance(self) -> Float:
        """Covariance in the chart, (B, d(d+1)/2, L)."""
        return self.packed[:, self.layout.rows[1]]

    @property
    def prior_mean(self) -> Float:
        """Mean of the predicted density, (B, p, L)."""
        return self.packed[:, self.layout.rows[2]]

    @property
    def prior_precision(self) -> Float:
        """Precision, or concentration, of the predicted density, (B, d(d+1)/2, L)."""
        return self.packed[:, self.layout.rows[3]]

    @property
    def mu(self) -> Float:
        """Mean of one unknown, (B, L); of an angle in rad."""
        return self.point[:, 0]

    @property
    def variance(self) -> Float:
        """Variance of one unknown, (B, L)."""
        return self.covariance[:, 0]

    @property
    def prior_mu(self) -> Float:
        """Mean of the predicted density of one unknown, (B, L)."""
        return self.prior_mean[:, 0]

    @property
    def prior_kappa(self) -> Float:
        """Concentration of the predicted density of one unknown, (B, L)."""
        return self.prior_precision[:, 0]

    @property
    def curved(self) -> Float:
        """1 of a curved wave, else 0, (B, L); of a layout that has both."""
        return self.packed[:, -4]

    @property
    def log_odds(self) -> Float:
        """Prior log odds of being active, (B, L)."""
        return self.packed[:, -3]

    @property
    def kl_constant(self) -> Float:
        """Constant of the KL divergence from the predicted density, (B, L)."""
        return self.packed[:, -2]

    @property
    def slot(self) -> Int:
        """Index in the memory of the step; -1 while on trial. A copy: see `with_slots`."""
        return self.packed[:, -1].astype(np.int64)

    def copy(self) -> Components:
        """Return a copy that may be written into."""
        return self.like(self.packed.copy())

    def with_slots(self, slot: Int) -> Components:
        """Return the components with other indices in the memory, (B, L)."""
        changed = self.copy()
        changed.packed[:, -1] = slot
        return changed

    def first(self, n: int) -> Components:
        """Return the first n components of each problem."""
        return self.like(self.packed[:, :, :n])

    def without(self, k: Int) -> Components:
        """Return the components without the k-th of each problem, the last slot unused."""
        L = self.packed.shape[2]
        order = np.arange(L) + (np.arange(L) >= k[:, None])
        rows = np.arange(len(k))[:, None]
        kept = self.packed[rows, :, np.minimum(order, L - 1)]
        return self.like(np.asarray(kept.swapaxes(1, 2)))
