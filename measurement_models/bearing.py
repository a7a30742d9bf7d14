"""Directions in which a position is seen from known places."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.base import MeasurementModel
from arrivals.typing import Float
from arrivals.validation import constant, count, covariance, positive, real


@dataclass(frozen=True, eq=False, init=False)
class Bearing(MeasurementModel):
    """Azimuths at which known places see a position in the plane.

    Parameters
    ----------
    sensor_positions : array_like, shape (n_sensors, 2)
        m.
    noise : float or array_like, shape (n_sensors, n_sensors)
        Variance of each bearing, or their covariance, rad².
    position : tuple of two int
        Entries of the state that are x and y: (0, 2) for `ConstantVelocity` and `CoordinatedTurn`,
        (0, 1) for `RandomWalk`.

    Raises
    ------
    ValueError
        If a shape is wrong, the noise is no covariance or `position` names no two entries.

    Notes
    -----
    Shapes: states (..., n), measurements (..., n_sensors). Units: rad, anticlockwise from the x
    axis, in [-π, π]; residuals are wrapped. At a sensor's own place a bearing has no slope: zero.

    References
    ----------
    Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
    sec. 10.3.4.

    Examples
    --------
    >>> seen = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=0.01, position=(0, 1))
    >>> np.rad2deg(seen.h([10.0, 10.0])).round(6)
    array([45., 90.])
    >>> seen.residual([3.1, 0.0], [-3.1, 0.0]).round(4)
    array([-0.0832,  0.    ])
    """

    sensor_positions: Float
    noise: float | Float
    position: tuple[int, int]
    _R: ClassVar[Float]  # of the object, yet no parameter

    def __init__(
        self,
        sensor_positions: ArrayLike,
        noise: float | ArrayLike,
        position: tuple[int, int] = (0, 2),
    ) -> None:
        places = constant("sensor_positions", sensor_positions)
        if places.shape[1] != 2:
            raise ValueError(f"sensor_positions must have shape (n, 2); got {places.shape}")
        noise = _bearing_noise(noise, len(places))
        entries = tuple(count("position", entry, least=0) for entry in position)
        if len(set(entries)) != 2 or len(entries) != 2:
            raise ValueError(f"position must name two entries of the state; got {position}")
        object.__setattr__(self, "sensor_positions", places)
        object.__setattr__(self, "noise", noise)
        object.__setattr__(self, "position", entries)
        R = noise if isinstance(noise, np.ndarray) else noise * np.eye(len(places))
        object.__setattr__(self, "_R", R)

    @property
    def dim_z(self) -> int:
        """One bearing a sensor."""
        return len(self.sensor_positions)

    @property
    def R(self) -> Float:
        """Covariance of the bearings, rad²."""
        return self._R.copy()

    def h(self, x: ArrayLike) -> Float:
        """Return atan2(y - sy, x - sx) of states: (..., n) -> (..., n_sensors)."""
        east, north = self._from_sensors(self._state(x))
        return np.arctan2(north, east)

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (n_sensors, n): (-Δy, Δx)/r²."""
        x = self._state(x)
        if x.ndim != 1:
            raise ValueError(f"H wants one state, shape (n,); got {x.shape}")
        east, north = self._from_sensors(x)
        square = np.maximum(east * east + north * north, np.finfo(np.float64).tiny)
        H = np.zeros((self.dim_z, x.size))
        H[:, self.position[0]], H[:, self.position[1]] = -north / square, east / square
        return H

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return z - z_pred, the shorter way round."""
        return np.asarray((np.subtract(z, z_pred) + np.pi) % (2 * np.pi) - np.pi)

    def _state(self, x: ArrayLike) -> Float:
        x = real("x", x)
        last = max(self.position)
        if x.ndim == 0 or x.shape[-1] <= last:
            column = x.ndim == 2 and x.shape[1] == 1 and len(x) > last
            got = f"the column {x.shape}: pass x.ravel()" if column else f"{x.shape}"
            raise ValueError(f"states must have shape (..., n), n > {last}; got {got}")
        return x

    def _from_sensors(self, x: Float) -> tuple[Float, Float]:
        i, j = self.position
        places = self.sensor_positions
        return x[..., i, None] - places[:, 0], x[..., j, None] - places[:, 1]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Bearing):
            return NotImplemented
        return self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple[object, ...]:
        noise = np.asarray(self.noise)
        return self.sensor_positions.tobytes(), noise.shape, noise.tobytes(), self.position


def _bearing_noise(noise: ArrayLike, n: int) -> float | Float:
    if np.ndim(noise) == 0:
        return positive("noise", noise)
    return constant("noise", covariance("noise", noise, n))
