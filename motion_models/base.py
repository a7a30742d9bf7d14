"""Base classes of motion models."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from arrivals.abstract_fields import property_or_field
from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import instance, state


class MotionModel(FrozenModel, ABC):
    """Motion of a state in one step: x' = f(x) + w, w ~ (0, Q).

    A model is frozen. The members below are its Gaussian interface, in filterpy's calling
    convention; the bound methods go into filterpy's filters as they are.

    Notes
    -----
    Shapes: states (..., dim_x), any leading axes. Units: the model's own; `dt` in its unit of time.
    `dim_x`, `state_names` and `angles` may be properties, class attributes or dataclass fields.

    Examples
    --------
    A position that keeps still:

    >>> class Rest(MotionModel):
    ...     dim_x, state_names = 2, ("x", "y")
    ...     def f(self, x, dt=1.0):
    ...         return np.asarray(x)
    ...     def F(self, x, dt=1.0):
    ...         return np.eye(2)
    ...     def Q(self, dt=1.0):
    ...         return np.zeros((2, 2))
    >>> Rest().sample([1.0, 2.0], np.random.default_rng(0))
    array([1., 2.])
    """

    @property_or_field
    @abstractmethod
    def dim_x(self) -> int:
        """Number of entries of one state."""

    @property_or_field
    def state_names(self) -> tuple[str, ...]:
        """Names of the entries of a state, such as ("x", "vx", "y", "vy"); () if they have none."""
        return ()

    @property_or_field
    def is_linear(self) -> bool:
        """True if f(x) = F x, with the same F at every state."""
        return False

    @property_or_field
    def angles(self) -> tuple[int, ...]:
        """Entries of a state that are angles in rad; trackers take differences on the circle."""
        return ()

    @abstractmethod
    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states after `dt`, without noise: (..., dim_x) -> (..., dim_x)."""

    @abstractmethod
    def F(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the Jacobian of `f` at one state, (dim_x, dim_x)."""

    @abstractmethod
    def Q(self, dt: float = 1.0) -> Float:
        """Return the covariance of the noise of a step of `dt`, (dim_x, dim_x)."""

    def sample(self, x: ArrayLike, rng: np.random.Generator, dt: float = 1.0) -> Float:
        """Draw states after `dt`, each with its own noise: (..., dim_x) -> (..., dim_x)."""
        mean = self.f(x, dt)
        return mean + gaussian(self.Q(dt), mean.shape[:-1], rng)


class LinearMotionModel(MotionModel):
    """Motion by a matrix, the same at every state: x' = F x + w, w ~ (0, Q).

    Examples
    --------
    >>> class Fading(LinearMotionModel):
    ...     dim_x = 1
    ...     def F(self, x=None, dt=1.0):
    ...         return np.array([[0.5**dt]])
    ...     def Q(self, dt=1.0):
    ...         return np.zeros((1, 1))
    >>> Fading().f([8.0]), Fading().is_linear
    (array([4.]), True)
    """

    @property
    def is_linear(self) -> bool:
        """True."""
        return True

    @abstractmethod
    def F(self, x: ArrayLike | None = None, dt: float = 1.0) -> Float:
        """Return the transition matrix, (dim_x, dim_x); the state is not used."""

    def f(self, x: ArrayLike, dt: float = 1.0) -> Float:
        """Return the states after `dt`, without noise: F x, (..., dim_x) -> (..., dim_x)."""
        return np.asarray(state(x, self.dim_x) @ self.F(x, dt).T)


def coordinates(n: int) -> tuple[str, ...]:
    """Return the names of n Cartesian coordinates.

    Examples
    --------
    >>> coordinates(2), coordinates(4)
    (('x', 'y'), ('x1', 'x2', 'x3', 'x4'))
    """
    return ("x", "y", "z")[:n] if n <= 3 else tuple(f"x{i}" for i in range(1, n + 1))


def gaussian(covariance: Float, shape: tuple[int, ...], rng: np.random.Generator) -> Float:
    """Draw zero-mean Gaussian vectors, shape (*shape, n), from a covariance that may be singular.

    Examples
    --------
    >>> gaussian(np.zeros((2, 2)), (3,), np.random.default_rng(0)).shape
    (3, 2)
    """
    instance("rng", rng, np.random.Generator)
    variance, axes = np.linalg.eigh(covariance)
    scale = np.sqrt(np.maximum(variance, 0.0))
    return np.asarray((rng.standard_normal((*shape, len(variance))) * scale) @ axes.T)
