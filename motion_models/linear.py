"""Linear motions."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.entry_names import entry_names
from arrivals.motion_models.base import LinearMotionModel, coordinates
from arrivals.typing import Float
from arrivals.validation import (
    constant,
    count,
    covariance,
    not_negative,
    shaped,
    time_step,
)

MOST_DIMS = 1000  # of a matrix that is no error


@dataclass(frozen=True)
class RandomWalk(LinearMotionModel):
    """A position that drifts by white noise.

    Parameters
    ----------
    q : float
        Variance gained by each coordinate per unit of time.
    n_dims : int
        Number of coordinates.

    Raises
    ------
    ValueError
        If `q` is negative or not finite, or `n_dims` below 1.

    Notes
    -----
    Shapes: states (..., n_dims). Units: those of the state; `q` in their square per unit of time.

    Examples
    --------
    >>> RandomWalk(q=0.5).Q(dt=4.0)
    array([[2., 0.],
           [0., 2.]])
    """

    q: float
    n_dims: int = 2

    def __post_init__(self) -> None:
        not_negative("q", self.q)
        count("n_dims", self.n_dims, maximum=MOST_DIMS)

    @property
    def dim_x(self) -> int:
        """One entry per coordinate."""
        return self.n_dims

    @property
    def state_names(self) -> tuple[str, ...]:
        """x, y, z, or x1, x2, ... of more than three coordinates."""
        return coordinates(self.n_dims)

    def F(self, x: ArrayLike | None = None, dt: float = 1.0) -> Float:
        """Return the identity, (dim_x, dim_x)."""
        time_step(dt)
        return np.eye(self.n_dims)

    def Q(self, dt: float = 1.0) -> Float:
        """Return q dt on the diagonal."""
        return self.q * time_step(dt) * np.eye(self.n_dims)


@dataclass(frozen=True)
class ConstantVelocity(LinearMotionModel):
    """A position whose velocity is disturbed by white noise in the acceleration.

    Parameters
    ----------
    q : float
        Spectral density of the acceleration.
    n_dims : int
        Number of coordinates.

    Raises
    ------
    ValueError
        If `q` is negative or not finite, or `n_dims` below 1.

    Notes
    -----
    Shapes: states (..., 2 n_dims), in filterpy's order [x, vx, y, vy, ...]. Units: with lengths in
    m and time in s, `q` is in m²/s³.

    References
    ----------
    Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
    sec. 6.2.2.

    Examples
    --------
    >>> ConstantVelocity(q=6.0).f([30.0, 1.0, 40.0, 0.5], dt=2.0)
    array([32. ,  1. , 41. ,  0.5])
    >>> ConstantVelocity(q=6.0, n_dims=1).Q()
    array([[2., 3.],
           [3., 6.]])
    """

    q: float
    n_dims: int = 2

    def __post_init__(self) -> None:
        not_negative("q", self.q)
        count("n_dims", self.n_dims, maximum=MOST_DIMS)

    @property
    def dim_x(self) -> int:
        """Position and velocity per coordinate."""
        return 2 * self.n_dims

    @property
    def state_names(self) -> tuple[str, ...]:
        """x, vx, y, vy, ..."""
        return tuple(name for x in coordinates(self.n_dims) for name in (x, f"v{x}"))

    def F(self, x: ArrayLike | None = None, dt: float = 1.0) -> Float:
        """Return the transition matrix: each position gains its velocity times `dt`."""
        return _drift(self.n_dims, time_step(dt)).copy()

    def Q(self, dt: float = 1.0) -> Float:
        """Return the covariance of white acceleration over `dt`."""
        return _white_acceleration(self.q, self.n_dims, time_step(dt)).copy()


@dataclass(frozen=True, eq=False, init=False)
class LinearMotion(LinearMotionModel):
    """Motion by given matrices: x' = F x + B u + w, w ~ (0, Q).

    Parameters
    ----------
    transition : array_like, shape (dim_x, dim_x)
        F, for a step of one unit of time.
    noise : array_like, shape (dim_x, dim_x)
        Q, symmetric and without negative eigenvalues.
    control : array_like, shape (dim_x, dim_u), optional
        B, for trackers with a control input.
    names : sequence of str, optional
        Names of the entries of a state; a measurement model then reads them by name.

    Raises
    ------
    ValueError
        If a matrix has the wrong shape, is not finite, or `noise` is not a covariance; later, if a
        step has any other length than 1.

    Notes
    -----
    Shapes: states (..., dim_x). The model keeps copies of its matrices, which cannot be written to.

    Examples
    --------
    >>> fading = LinearMotion(transition=[[0.5]], noise=[[0.75]])
    >>> fading.f([[8.0], [4.0]])
    array([[4.],
           [2.]])
    """

    transition: Float
    noise: Float
    control: Float | None
    names: tuple[str, ...]

    def __init__(
        self,
        transition: ArrayLike,
        noise: ArrayLike,
        control: ArrayLike | None = None,
        names: Sequence[str] = (),
    ) -> None:
        transition = constant("transition", transition)
        n = len(transition)
        shaped("transition", transition, n, n)
        noise = constant("noise", covariance("noise", noise, n))
        if control is not None:
            control = constant("control", control)
            shaped("control", control, n, control.shape[1])
        object.__setattr__(self, "transition", transition)
        object.__setattr__(self, "noise", noise)
        object.__setattr__(self, "control", control)
        object.__setattr__(self, "names", entry_names("names", names, n))

    @property
    def dim_x(self) -> int:
        """Number of rows of `transition`."""
        return len(self.transition)

    @property
    def state_names(self) -> tuple[str, ...]:
        """`names`."""
        return self.names

    def F(self, x: ArrayLike | None = None, dt: float = 1.0) -> Float:
        """Return a copy of `transition`."""
        _one_step(dt)
        return self.transition.copy()

    def Q(self, dt: float = 1.0) -> Float:
        """Return a copy of `noise`."""
        _one_step(dt)
        return self.noise.copy()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LinearMotion):
            return NotImplemented
        return self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple[object, ...]:
        matrices = (self.transition, self.noise, self.control)
        content = (None if A is None else (A.shape, tuple(A.ravel().tolist())) for A in matrices)
        return (*content, self.names)


@lru_cache(maxsize=64)  # read at every step of a filter, for the same dt
def _drift(n: int, dt: float) -> Float:
    return _on_diagonal([[1.0, dt], [0.0, 1.0]], n)


@lru_cache(maxsize=64)
def _white_acceleration(q: float, n: int, dt: float) -> Float:
    return q * _on_diagonal([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], n)


def _on_diagonal(block: ArrayLike, n: int) -> Float:
    """Return a matrix with `block` n times on its diagonal; np.kron is several times slower."""
    block = np.asarray(block, dtype=np.float64)
    blocks = np.zeros((n, len(block), n, len(block)))
    each = np.arange(n)
    blocks[each, :, each, :] = block
    return blocks.reshape(n * len(block), n * len(block))


def _one_step(dt: float) -> None:
    if time_step(dt) != 1:
        raise ValueError(f"dt must be 1 for the matrices of LinearMotion; got {dt}")
