"""Bearings of a position from known stations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.entry_names import checked_names
from arrivals.measurement_models.base import (
    MeasurementModel,
    default_position,
    locate,
    paired,
)
from arrivals.messages import shown
from arrivals.typing import Float
from arrivals.validation import constant, count, covariance, items, positive, real


@dataclass(frozen=True, eq=False, init=False)
class Bearing(MeasurementModel):
    """Azimuths of a position in the plane from known sensors.

    Parameters
    ----------
    sensor_positions : array_like, shape (n_sensors, 2)
        Positions of the sensors, m.
    noise : float or array_like, shape (n_sensors, n_sensors)
        Variance of each bearing, or their covariance, rad².
    position : tuple of two int, optional
        Entries of the state that are x and y. If None, those that the motion model calls so; in
        states without names (0, 1) of 2 or 3 entries, (0, 2) of more.

    Raises
    ------
    ValueError
        If a shape is wrong, the noise is not a covariance or `position` does not name two entries.

    Notes
    -----
    Shapes: states (..., n), measurements (..., n_sensors). Units: rad, anticlockwise from the x
    axis, in [-π, π]; residuals are wrapped. At a sensor's own position
    the slope is zero.

    References
    ----------
    Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
    sec. 10.3.4.

    Examples
    --------
    >>> bearings = Bearing([[0.0, 0.0], [10.0, 0.0]], noise=0.01, position=(0, 1))
    >>> np.rad2deg(bearings.h([10.0, 10.0])).round(6)
    array([45., 90.])
    >>> bearings.residual([3.1, 0.0], [-3.1, 0.0]).round(4)
    array([-0.0832,  0.    ])
    """

    sensor_positions: Float
    noise: float | Float
    position: tuple[int, int] | None
    _R: ClassVar[Float]  # of the object, yet no parameter

    def __init__(
        self,
        sensor_positions: ArrayLike,
        noise: float | ArrayLike,
        position: tuple[int, int] | None = None,
    ) -> None:
        positions = constant("sensor_positions", sensor_positions)
        if positions.shape[1] != 2:
            raise ValueError(f"sensor_positions must have shape (n, 2); got {positions.shape}")
        noise = _bearing_noise(noise, len(positions))
        object.__setattr__(self, "sensor_positions", positions)
        object.__setattr__(self, "noise", noise)
        object.__setattr__(self, "position", _two_entries(position))
        R = noise if isinstance(noise, np.ndarray) else noise * np.eye(len(positions))
        object.__setattr__(self, "_R", R)

    @property
    def dim_z(self) -> int:
        """One bearing a sensor."""
        return len(self.sensor_positions)

    @property
    def needs(self) -> tuple[str, ...]:
        """The names x and y, unless `position` is set."""
        return ("x", "y") if self.position is None else ()

    def for_state(self, names: Sequence[str]) -> Bearing:
        """Return this model with `position` where the names have x and y.

        Parameters
        ----------
        names : sequence of str
            `state_names` of a motion model.

        Returns
        -------
        Bearing

        Raises
        ------
        TypeError
            If the state has no x or no y.
        """
        names = checked_names(names)
        if not names or self.position is not None:
            return self
        x, y = locate(self, names)
        return self.replace(position=(x, y))

    @property
    def R(self) -> Float:
        """Covariance of the bearings, rad²."""
        return self._R.copy()

    def h(self, x: ArrayLike) -> Float:
        """Return atan2(y - sy, x - sx) of states: (..., n) -> (..., n_sensors)."""
        east, north = self._from_sensors(*self._state(x))
        return np.arctan2(north, east)

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (n_sensors, n): (-Δy, Δx)/r²."""
        x, (i, j) = self._state(x)
        if x.ndim != 1:
            raise ValueError(f"x must have shape (n,); got {x.shape}")
        east, north = self._from_sensors(x, (i, j))
        square = np.maximum(east * east + north * north, np.finfo(np.float64).tiny)
        H = np.zeros((self.dim_z, x.size))
        H[:, i], H[:, j] = -north / square, east / square
        return H

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return z - z_pred, wrapped into [-π, π)."""
        z, z_pred = paired(z, z_pred)
        return np.asarray((z - z_pred + np.pi) % (2 * np.pi) - np.pi)

    def _state(self, x: ArrayLike) -> tuple[Float, tuple[int, int]]:
        """Return states (..., n), and the entries that are x and y."""
        x = real("x", x)
        i, j = self.position or default_position(x.shape[-1] if x.ndim else 0)
        last = max(i, j)
        if x.ndim == 0 or x.shape[-1] <= last:
            column = x.ndim == 2 and x.shape[1] == 1 and len(x) > last
            got = f"the column {x.shape}: pass x.ravel()" if column else f"{x.shape}"
            raise ValueError(f"states must have shape (..., n), n > {last}; got {got}")
        return x, (i, j)

    def _from_sensors(self, x: Float, position: tuple[int, int]) -> tuple[Float, Float]:
        i, j = position
        positions = self.sensor_positions
        return x[..., i, None] - positions[:, 0], x[..., j, None] - positions[:, 1]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Bearing):
            return NotImplemented
        return self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple[object, ...]:
        noise = np.asarray(self.noise)
        return self.sensor_positions.tobytes(), noise.shape, noise.tobytes(), self.position


def _two_entries(position: tuple[int, int] | None) -> tuple[int, int] | None:
    if position is None:
        return None
    entries = tuple(count("position", entry, minimum=0) for entry in items("position", position))
    if len(set(entries)) != 2 or len(entries) != 2:
        raise ValueError(f"position must name two entries of the state; got {shown(position)}")
    return entries[0], entries[1]


def _bearing_noise(noise: ArrayLike, n: int) -> float | Float:
    if real("noise", noise).ndim == 0:
        return positive("noise", noise)
    return constant("noise", covariance("noise", noise, n))
