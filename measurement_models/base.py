"""What every measurement model promises."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import FrozenModel
from arrivals.typing import Float


class MeasurementModel(FrozenModel, ABC):
    """What a sensor sees of a state: z = h(x) + v, v ~ (0, R).

    A model is frozen. The members below are its Gaussian face, in filterpy's calling convention;
    the bound methods go into filterpy's filters as they are.

    Notes
    -----
    Shapes: states (..., dim_x), measurements (..., dim_z), any leading axes.
    """

    @property
    @abstractmethod
    def dim_z(self) -> int:
        """Number of entries of one measurement."""

    @property
    @abstractmethod
    def R(self) -> Float:
        """Covariance of the measurement noise, (dim_z, dim_z)."""

    @abstractmethod
    def h(self, x: ArrayLike) -> Float:
        """Return the measurements expected of states: (..., dim_x) -> (..., dim_z)."""

    @abstractmethod
    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, dim_x)."""

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return z - z_pred; models whose measurement is an angle wrap it."""
        return np.subtract(z, z_pred, dtype=np.float64)

    def sample(self, x: ArrayLike, rng: np.random.Generator) -> Float:
        """Draw a measurement of each state: (..., dim_x) -> (..., dim_z)."""
        expected = self.h(x)
        noise = rng.multivariate_normal(np.zeros(self.dim_z), self.R, expected.shape[:-1])
        return np.asarray(expected + noise)
