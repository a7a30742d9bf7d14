"""Linear measurements."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.typing import Float
from arrivals.validation import constant, covariance, state


@dataclass(frozen=True, eq=False, init=False)
class LinearMeasurement(MeasurementModel):
    """Measurement by a matrix of the state: z = H x + v, v ~ (0, R).

    Parameters
    ----------
    matrix : array_like, shape (dim_z, dim_x)
        H.
    noise : array_like, shape (dim_z, dim_z)
        R, symmetric and without negative eigenvalues.

    Raises
    ------
    ValueError
        If a matrix has the wrong shape or is not finite, or `noise` is not a covariance.
    TypeError
        If a matrix holds complex numbers; `composite` makes two real ones of each.

    Notes
    -----
    Shapes: states (..., dim_x), measurements (..., dim_z). The model keeps copies of its matrices,
    which cannot be written to.

    References
    ----------
    Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
    (5.2.1-4).

    Examples
    --------
    >>> position = LinearMeasurement([[1.0, 0.0]], [[0.25]])
    >>> position.h([[3.0, 1.0], [4.0, 1.0]])
    array([[3.],
           [4.]])
    """

    matrix: Float
    noise: Float

    def __init__(self, matrix: ArrayLike, noise: ArrayLike) -> None:
        matrix = constant("matrix", matrix)
        noise = constant("noise", covariance("noise", noise, len(matrix)))
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "noise", noise)

    @property
    def dim_z(self) -> int:
        """Number of rows of `matrix`."""
        return len(self.matrix)

    @property
    def is_linear(self) -> bool:
        """True."""
        return True

    @property
    def R(self) -> Float:
        """A copy of `noise`."""
        return self.noise.copy()

    def h(self, x: ArrayLike) -> Float:
        """Return H x of states: (..., dim_x) -> (..., dim_z)."""
        return np.asarray(state(x, self.matrix.shape[1]) @ self.matrix.T)

    def H(self, x: ArrayLike | None = None) -> Float:
        """Return a copy of `matrix`, whatever the state."""
        return self.matrix.copy()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LinearMeasurement):
            return NotImplemented
        return np.array_equal(self.matrix, other.matrix) and np.array_equal(self.noise, other.noise)

    def __hash__(self) -> int:
        return hash((self.matrix.tobytes(), self.noise.tobytes()))
