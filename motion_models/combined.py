"""Two states side by side that move each by its own model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.motion_models.base import MotionModel
from arrivals.typing import Float
from arrivals.validation import instance, state


@dataclass(frozen=True)
class CombinedMotion(MotionModel):
    """A state [x₁, x₂] whose parts move independently.

    Parameters
    ----------
    first, second : MotionModel

    Notes
    -----
    Shapes: states (..., first.dim_x + second.dim_x).

    Examples
    --------
    >>> from arrivals.motion_models import DelayWalk, LinearMotion
    >>> CombinedMotion(DelayWalk(q=1.0), LinearMotion([[0.5]], [[2.0]])).F()
    array([[1. , 0. ],
           [0. , 0.5]])
    """

    first: MotionModel
    second: MotionModel

    def __post_init__(self) -> None:
        instance("first", self.first, MotionModel)  # type: ignore[type-abstract]  # any
        instance("second", self.second, MotionModel)  # type: ignore[type-abstract]  # any

    @property
    def dim_x(self) -> int:
        """Entries of both states."""
        return self.first.dim_x + self.second.dim_x

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states after `dt`, without noise."""
        one, other = self._parts(x)
        return np.concatenate([self.first.f(one, dt), self.second.f(other, dt)], axis=-1)

    def F(self, x: ArrayLike | None = None, dt: float = 1.0) -> Float:
        """Return the Jacobian; no state is needed if both parts are linear."""
        one, other = self._parts(np.zeros(self.dim_x) if x is None else x)
        return block_diagonal(self.first.F(one, dt), self.second.F(other, dt))

    def Q(self, dt: float = 1.0) -> Float:
        """Return the covariance of the noise of a step of `dt`."""
        return block_diagonal(self.first.Q(dt), self.second.Q(dt))

    def _parts(self, x: ArrayLike) -> tuple[Float, Float]:
        x, n = state(x, self.dim_x), self.first.dim_x
        return x[..., :n], x[..., n:]


def block_diagonal(A: Float, B: Float) -> Float:
    """Return the matrix with A and B on its diagonal.

    Examples
    --------
    >>> block_diagonal(np.ones((1, 1)), np.full((1, 1), 2.0))
    array([[1., 0.],
           [0., 2.]])
    """
    n = len(A)
    both = np.zeros((n + len(B), n + len(B)))
    both[:n, :n], both[n:, n:] = A, B
    return both
