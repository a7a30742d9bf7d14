"""Independent states side by side, each with its own motion."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.entry_names import entry_names
from arrivals.motion_models.base import MotionModel
from arrivals.typing import Float
from arrivals.validation import instance, state


@dataclass(frozen=True, init=False)
class CombinedMotion(MotionModel):
    """A state [x₁, x₂, ...] whose parts move independently.

    Parameters
    ----------
    first : MotionModel
        Motion of the first part.
    second : MotionModel
        Motion of the second part. More parts may follow: `second` is then a `CombinedMotion` of
        all but the first.
    names : sequence of str, optional
        Names of all entries; those of the parts if None, () for none.

    Raises
    ------
    TypeError
        If a part is not a motion model.
    ValueError
        If two entries have one name, or `names` has the wrong number of entries.

    Notes
    -----
    Shapes: states (..., first.dim_x + second.dim_x). Entries have names if all parts name theirs.

    Examples
    --------
    >>> from arrivals.motion_models import ConstantVelocity, DelayWalk, LinearMotion, RandomWalk
    >>> CombinedMotion(DelayWalk(q=1.0), LinearMotion([[0.5]], [[2.0]])).F()
    array([[1. , 0. ],
           [0. , 0.5]])
    >>> loudness = LinearMotion([[1.0]], [[1e-4]], names=["log_amplitude"])
    >>> CombinedMotion(ConstantVelocity(q=0.1), loudness).state_names
    ('x', 'vx', 'y', 'vy', 'log_amplitude')
    """

    former_names = ("Stacked",)

    first: MotionModel
    second: MotionModel
    names: tuple[str, ...] | None

    def __init__(
        self,
        first: MotionModel,
        second: MotionModel,
        *more: MotionModel,
        names: Sequence[str] | None = None,
    ) -> None:
        if more:
            second = CombinedMotion(second, *more, names=None if names is None else ())
        instance("first", first, MotionModel)  # type: ignore[type-abstract]  # any
        instance("second", second, MotionModel)  # type: ignore[type-abstract]  # any
        object.__setattr__(self, "first", first)
        object.__setattr__(self, "second", second)
        if names is not None:
            names = entry_names("names", names, self.dim_x)
        object.__setattr__(self, "names", names)
        repeated = set(first.state_names) & set(second.state_names)
        if names is None and repeated:
            raise ValueError(
                f"parts must have different names of entries; got {min(repeated)!r} in both: "
                "pass names for all entries, or names=() for none"
            )

    # `more` is not a parameter of its own: what it holds is in `second`.
    __signature__ = inspect.signature(__init__).replace(
        parameters=[
            parameter.replace(kind=inspect.Parameter.POSITIONAL_OR_KEYWORD)
            for name, parameter in inspect.signature(__init__).parameters.items()
            if name not in ("self", "more")
        ]
    )

    @property
    def dim_x(self) -> int:
        """Entries of all parts."""
        return self.first.dim_x + self.second.dim_x

    @property
    def state_names(self) -> tuple[str, ...]:
        """`names`, or the names of the first part, then those of the second."""
        if self.names is not None:
            return self.names
        one, other = self.first.state_names, self.second.state_names
        return (*one, *other) if one and other else ()

    @property
    def angles(self) -> tuple[int, ...]:
        """Entries of all parts that are angles."""
        n = self.first.dim_x
        return (*self.first.angles, *(n + entry for entry in self.second.angles))

    @property
    def is_linear(self) -> bool:
        """True if all parts are linear."""
        return self.first.is_linear and self.second.is_linear

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states after `dt`, without noise: (..., dim_x) -> (..., dim_x)."""
        one, other = self._parts(x)
        return np.concatenate([self.first.f(one, dt), self.second.f(other, dt)], axis=-1)

    def F(self, x: ArrayLike | None = None, dt: float = 1.0) -> Float:
        """Return the Jacobian; the state may be left out if all parts are linear."""
        one, other = self._parts(np.zeros(self.dim_x) if x is None else x)
        return block_diagonal(self.first.F(one, dt), self.second.F(other, dt))

    def Q(self, dt: float = 1.0) -> Float:
        """Return the covariance of the noise of a step of `dt`, (dim_x, dim_x)."""
        return block_diagonal(self.first.Q(dt), self.second.Q(dt))

    def sample(self, x: ArrayLike, rng: np.random.Generator, dt: float = 1.0) -> Float:
        """Draw states after `dt`, each part by its own `sample`."""
        one, other = self._parts(x)
        self.Q(dt)  # refuses a step before anything is drawn
        parts = [self.first.sample(one, rng, dt), self.second.sample(other, rng, dt)]
        return np.concatenate(parts, axis=-1)

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
