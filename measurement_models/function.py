"""A measurement model made of plain functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.differentiation import function, numerical_jacobian, over_leading_axes
from arrivals.entry_names import entry_names
from arrivals.measurement_models.base import MeasurementModel
from arrivals.typing import Float
from arrivals.validation import covariance, items, one_of, real, shaped


@dataclass(frozen=True, eq=False, init=False, repr=False)
class FunctionMeasurement(MeasurementModel):
    """Measurement by a function: z = h(x) + v, v ~ (0, R).

    Parameters
    ----------
    h : callable
        h(x), the measurement (dim_z,) expected of a state (n,); a number where dim_z is 1.
    H : callable, optional
        H(x), the Jacobian of h, (dim_z, n); by central differences if None.
    R : float or array_like, shape (dim_z, dim_z)
        Covariance of the noise; a number is the variance of a measurement of one entry.
    residual : callable, optional
        residual(z, z_pred), the difference of two measurements (..., dim_z), where it is not the
        plain one: angles.
    needs : sequence of str, optional
        Names of the entries that `h` reads. With a motion model that names its entries, h and H
        are called with these entries alone, in this order.
    vectorized : bool
        Whether `h` takes states (..., n). If not, it is called once for every state, which is slow
        in a particle filter.

    Raises
    ------
    TypeError
        If a function is not callable.
    ValueError
        If R is not a covariance.

    Notes
    -----
    Shapes: states (..., n), measurements (..., dim_z). A configuration file holds no functions,
    and pickling needs functions of a module. The steps of the differences are
    ε^(1/3) max(1, abs(xᵢ)), at least 6e-6.

    Examples
    --------
    The range of a position from the origin, whatever else is in the state:

    >>> distance = FunctionMeasurement(lambda x: np.hypot(x[0], x[1]), R=0.04, needs=["x", "y"])
    >>> distance.H([3.0, 4.0]).round(6)
    array([[0.6, 0.8]])
    >>> distance.for_state(["x", "vx", "y", "vy"]).H([3.0, 0.0, 4.0, 0.0]).round(6)
    array([[0.6, 0. , 0.8, 0. ]])
    """

    needs: tuple[str, ...]
    vectorized: bool
    _h: Callable[[Float], Any]
    _H: Callable[[Float], Any] | None
    _R: Float
    _residual: Callable[[Any, Any], Any] | None

    def __init__(
        self,
        h: Callable[[Float], Any],
        H: Callable[[Float], Any] | None = None,
        *,
        R: ArrayLike,
        residual: Callable[[Any, Any], Any] | None = None,
        needs: Sequence[str] = (),
        vectorized: bool = False,
    ) -> None:
        noise, needs = np.array(real("R", R), ndmin=2), items("needs", needs)
        own = {
            "_h": function("h", h),
            "_H": None if H is None else function("H", H),
            "_R": covariance("R", noise, len(noise)),
            "_residual": None if residual is None else function("residual", residual),
            "needs": entry_names("needs", needs, len(needs)),
            "vectorized": one_of("vectorized", vectorized, (False, True)),
        }
        for name, value in own.items():
            object.__setattr__(self, name, value)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the constructor's arguments by name."""
        own = {"h": self._h, "H": self._H, "R": self._R, "residual": self._residual}
        return own | {"needs": self.needs, "vectorized": self.vectorized}

    @property
    def dim_z(self) -> int:
        """Number of rows of R."""
        return len(self._R)

    @property
    def R(self) -> Float:
        """Covariance of the noise, (dim_z, dim_z)."""
        return self._R.copy()

    def h(self, x: ArrayLike) -> Float:
        """Return the measurements expected of states: (..., n) -> (..., dim_z)."""
        x = real("x", x)
        if self.vectorized:
            return shaped("h(x)", self._h(x), *x.shape[:-1], self.dim_z)
        return over_leading_axes("h(x)", self._h, x, self.dim_z)

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, n)."""
        x = real("x", x)
        if x.ndim != 1:
            raise ValueError(f"x must have shape (n,); got {x.shape}")
        if self._H is not None:
            return shaped("H(x)", self._H(x), self.dim_z, len(x))
        return numerical_jacobian(self.h, x, self.residual)

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return the difference of measurements: (..., dim_z) -> (..., dim_z)."""
        if self._residual is None:
            return super().residual(z, z_pred)
        return real("residual(z, z_pred)", self._residual(z, z_pred))
