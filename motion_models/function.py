"""A motion model made of plain functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.differentiation import function, numerical_jacobian, over_leading_axes
from arrivals.entry_names import entry_names
from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.von_mises import wrap
from arrivals.typing import Float
from arrivals.validation import (
    count,
    covariance,
    items,
    one_of,
    real,
    shaped,
    state,
    time_step,
)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class FunctionMotion(MotionModel):
    """Motion by a function: x' = f(x, dt) + w, w ~ (0, Q).

    Parameters
    ----------
    f : callable
        f(x, dt), the state (n,) after `dt`.
    F : callable, optional
        F(x, dt), the Jacobian of f, (n, n); by central differences if None.
    Q : array_like, shape (n, n), or callable
        Covariance of the noise of a step of one unit of time, or Q(dt) for steps of any length.
    names : sequence of str, optional
        Names of the entries of a state.
    angles : sequence of int, optional
        Entries that are angles, rad.
    vectorized : bool
        Whether `f` takes states (..., n). If not, it is called once for every state, which is slow
        in a particle filter.

    Raises
    ------
    TypeError
        If `f` or `F` is not callable.
    ValueError
        If Q is not a covariance, or names or angles do not fit its size; later, if a matrix Q
        meets a step of any other length than 1.

    Notes
    -----
    Shapes: states (..., n). A configuration file holds no functions, and pickling needs functions
    of a module. The steps of the differences are ε^(1/3) max(1, abs(xᵢ)), at least 6e-6.

    Examples
    --------
    A pendulum:

    >>> def swing(x, dt):
    ...     return [x[0] + dt * x[1], x[1] - dt * np.sin(x[0])]
    >>> pendulum = FunctionMotion(swing, Q=1e-4 * np.eye(2), names=["angle", "rate"], angles=[0])
    >>> pendulum.F([0.0, 1.0]).round(6)
    array([[ 1.,  1.],
           [-1.,  1.]])
    """

    dim_x: int
    names: tuple[str, ...]
    angles: tuple[int, ...]
    vectorized: bool
    _f: Callable[[Float, float], Any]
    _F: Callable[[Float, float], Any] | None
    _Q: Any

    def __init__(
        self,
        f: Callable[[Float, float], Any],
        F: Callable[[Float, float], Any] | None = None,
        *,
        Q: ArrayLike | Callable[[float], Any],
        names: Sequence[str] = (),
        angles: Sequence[int] = (),
        vectorized: bool = False,
    ) -> None:
        one_step = np.array(real("Q", Q(1.0) if callable(Q) else Q), ndmin=2)
        n = len(covariance("Q", one_step, len(one_step)))
        entries = tuple(count("angles", entry, minimum=0) for entry in items("angles", angles))
        if any(entry >= n for entry in entries):
            raise ValueError(f"angles must be entries below {n}; got {entries}")
        own = {
            "_f": function("f", f),
            "_F": None if F is None else function("F", F),
            "_Q": Q if callable(Q) else one_step,
            "dim_x": n,
            "names": entry_names("names", names, n),
            "angles": entries,
            "vectorized": one_of("vectorized", vectorized, (False, True)),
        }
        for name, value in own.items():
            object.__setattr__(self, name, value)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the constructor's arguments by name."""
        own = {"f": self._f, "F": self._F, "Q": self._Q}
        return own | {name: getattr(self, name) for name in ("names", "angles", "vectorized")}

    @property
    def state_names(self) -> tuple[str, ...]:
        """`names`."""
        return self.names

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states after `dt`, without noise: (..., n) -> (..., n)."""
        x, dt = state(x, self.dim_x), time_step(dt)
        if self.vectorized:
            return shaped("f(x, dt)", self._f(x, dt), *x.shape)
        return over_leading_axes("f(x, dt)", lambda each: self._f(each, dt), x, self.dim_x)

    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the Jacobian of `f` at one state, (n, n)."""
        x, dt = shaped("x", x, self.dim_x), time_step(dt)
        if self._F is not None:
            return shaped("F(x, dt)", self._F(x, dt), self.dim_x, self.dim_x)
        return numerical_jacobian(lambda states: self.f(states, dt), x, self._difference)

    def Q(self, dt: float = 1.0) -> Float:
        """Return the covariance of the noise of a step of `dt`, (n, n)."""
        dt = time_step(dt)
        if callable(self._Q):
            return shaped("Q(dt)", self._Q(dt), self.dim_x, self.dim_x)
        if dt != 1:
            raise ValueError(f"dt must be 1 for a matrix Q; got {dt}: pass a function Q(dt)")
        return np.array(self._Q)

    def _difference(self, x1: Float, x2: Float) -> Float:
        difference, entries = x1 - x2, list(self.angles)
        difference[..., entries] = wrap(difference[..., entries])
        return difference
