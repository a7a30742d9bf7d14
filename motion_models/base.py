"""What every motion model promises."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import FrozenModel
from arrivals.typing import Float


class MotionModel(FrozenModel, ABC):
    """How a state moves in one step: x' = f(x) + w, w ~ (0, Q).

    A model is frozen. The members below are its Gaussian face, in filterpy's calling convention;
    the bound methods go into filterpy's filters as they are.

    Notes
    -----
    Shapes: states (..., dim_x), any leading axes. Units: the model's own; `dt` in its unit of time.
    """

    @property
    @abstractmethod
    def dim_x(self) -> int:
        """Number of entries of one state."""

    @property
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
        moved = self.f(x, dt)
        return moved + gaussian(self.Q(dt), moved.shape[:-1], rng)


def gaussian(covariance: Float, shape: tuple[int, ...], rng: np.random.Generator) -> Float:
    """Draw zero-mean Gaussian vectors, shape (*shape, n), from a covariance that may be singular.

    Examples
    --------
    >>> gaussian(np.zeros((2, 2)), (3,), np.random.default_rng(0)).shape
    (3, 2)
    """
    variance, axes = np.linalg.eigh(covariance)
    scale = np.sqrt(np.maximum(variance, 0.0))
    return np.asarray((rng.standard_normal((*shape, len(variance))) * scale) @ axes.T)
