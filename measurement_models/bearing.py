"""Bearings of a position from known stations: azimuths, in space with elevations."""

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

TINY = np.finfo(np.float64).tiny
MIN_FLAT_SHARE = 1e-18  # of ρ² in r²: nearer to the pole, the slope of the azimuth falls to zero


@dataclass(frozen=True, eq=False, init=False)
class Bearing(MeasurementModel):
    """Azimuths of a position in the plane from known sensors; in space, elevations too.

    Parameters
    ----------
    sensor_positions : array_like, shape (n_sensors, 2) or (n_sensors, 3)
        Positions of the sensors, m. With three coordinates each sensor measures azimuth and
        elevation, in this order.
    noise : float or array_like, shape (dim_z, dim_z)
        Variance of each angle, or their covariance, rad².
    position : tuple of two or three int, optional
        Entries of the state that are x, y and z. If None, those that the motion model calls so; in
        states without names the first ones of fewer than two entries a coordinate, else every
        second one.

    Raises
    ------
    ValueError
        If a shape is wrong, the noise is not a covariance or `position` does not name as many
        entries as the sensors have coordinates.

    Notes
    -----
    Shapes: states (..., n), measurements (..., n_sensors), in space (..., 2 n_sensors). Units: rad,
    azimuths anticlockwise from the x axis, in [-π, π], elevations from the plane of x and y;
    residuals are wrapped. At a sensor's own position the slopes are zero, and that of the azimuth
    is so straight above and below it, and limited nearby.

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
    >>> sounder = Bearing([[0.0, 0.0, 0.0]], noise=0.01)
    >>> np.rad2deg(sounder.h([3.0, 3.0, -18**0.5])).round(6)
    array([ 45., -45.])
    """

    sensor_positions: Float
    noise: float | Float
    position: tuple[int, ...] | None
    _R: ClassVar[Float]  # of the object, yet no parameter

    def __init__(
        self,
        sensor_positions: ArrayLike,
        noise: float | ArrayLike,
        position: tuple[int, ...] | None = None,
    ) -> None:
        positions = constant("sensor_positions", sensor_positions)
        n, n_dims = positions.shape
        if n_dims not in (2, 3):
            raise ValueError(
                f"sensor_positions must have shape (n, 2) or (n, 3); got {positions.shape}"
            )
        dim_z = n * (n_dims - 1)
        noise = _bearing_noise(noise, dim_z)
        object.__setattr__(self, "sensor_positions", positions)
        object.__setattr__(self, "noise", noise)
        object.__setattr__(self, "position", _entries(position, n_dims))
        R = noise if isinstance(noise, np.ndarray) else noise * np.eye(dim_z)
        object.__setattr__(self, "_R", R)

    @property
    def n_dims(self) -> int:
        """Number of coordinates: 2, azimuths; 3, azimuths and elevations."""
        return int(self.sensor_positions.shape[1])

    @property
    def dim_z(self) -> int:
        """One angle a sensor, two in space."""
        return len(self._R)

    @property
    def needs(self) -> tuple[str, ...]:
        """The names x and y, in space z, unless `position` is set."""
        return ("x", "y", "z")[: self.n_dims] if self.position is None else ()

    def for_state(self, names: Sequence[str]) -> Bearing:
        """Return this model with `position` where the names have x, y and z.

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
            If the state lacks a coordinate.
        """
        names = checked_names(names)
        if not names or self.position is not None:
            return self
        return self.replace(position=locate(self, names))

    @property
    def R(self) -> Float:
        """Covariance of the bearings, rad²."""
        return self._R.copy()

    def h(self, x: ArrayLike) -> Float:
        """Return the angles of states, (..., n) -> (..., dim_z): atan2(Δy, Δx), atan2(Δz, ρ)."""
        return self._angles(self._from_sensors(*self._state(x)))

    def _angles(self, delta: Float) -> Float:
        """Return the angles of vectors from the sensors, (..., n_sensors, n_dims)."""
        azimuth = np.arctan2(delta[..., 1], delta[..., 0])
        if delta.shape[-1] == 2:
            return azimuth
        elevation = np.arctan2(delta[..., 2], np.hypot(delta[..., 0], delta[..., 1]))
        return np.stack([azimuth, elevation], axis=-1).reshape(*azimuth.shape[:-1], self.dim_z)

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (dim_z, n).

        Azimuth: (-Δy, Δx)/ρ²; elevation: (-Δx Δz/ρ, -Δy Δz/ρ, ρ)/r².
        """
        x, position = self._state(x)
        if x.ndim != 1:
            raise ValueError(f"x must have shape (n,); got {x.shape}")
        return self._slopes(self._from_sensors(x, position), x.size, position)

    def h_and_H(self, x: ArrayLike) -> tuple[Float, Float]:
        """Return `h` and `H` of one state."""
        if type(self) is not Bearing:
            return super().h_and_H(x)  # a subclass may replace one of them
        x, position = self._state(x)
        if x.ndim != 1:
            return super().h_and_H(x)
        delta = x.take(position) - self.sensor_positions  # a third of the time of an index
        return self._angles(delta), self._slopes(delta, x.size, position)

    def _slopes(self, delta: Float, n: int, position: tuple[int, ...]) -> Float:
        """Return the Jacobian for vectors from the sensors, (n_sensors, n_dims)."""
        east, north = delta[:, 0], delta[:, 1]
        square = np.maximum(east * east + north * north, TINY)
        slope = np.zeros((len(delta), self.n_dims - 1, n))
        if self.n_dims == 3:
            up, flat = delta[:, 2], np.hypot(east, north)
            range_squared = np.maximum(square + up * up, TINY)
            square = np.maximum(square, MIN_FLAT_SHARE * range_squared)
            slope[:, 1, position[0]] = -east / np.sqrt(square) * up / range_squared
            slope[:, 1, position[1]] = -north / np.sqrt(square) * up / range_squared
            slope[:, 1, position[2]] = flat / range_squared
        slope[:, 0, position[0]], slope[:, 0, position[1]] = -north / square, east / square
        return slope.reshape(self.dim_z, n)

    def residual(self, z: ArrayLike, z_pred: ArrayLike) -> Float:
        """Return z - z_pred, wrapped into [-π, π)."""
        z, z_pred = paired(z, z_pred)
        return np.asarray((z - z_pred + np.pi) % (2 * np.pi) - np.pi)

    def _state(self, x: ArrayLike) -> tuple[Float, tuple[int, ...]]:
        """Return states (..., n), and the entries that are coordinates."""
        x = real("x", x)
        size = x.shape[-1] if x.ndim else 0
        position = self.position or _default_entries(size, self.n_dims)
        last = max(position)
        if x.ndim == 0 or size <= last:
            column = x.ndim == 2 and x.shape[1] == 1 and len(x) > last
            got = f"the column {x.shape}: pass x.ravel()" if column else f"{x.shape}"
            raise ValueError(f"states must have shape (..., n), n > {last}; got {got}")
        return x, position

    def _from_sensors(self, x: Float, position: tuple[int, ...]) -> Float:
        """Return the vectors from the sensors, (..., n_sensors, n_dims)."""
        return np.asarray(x[..., None, position] - self.sensor_positions)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Bearing):
            return NotImplemented
        return self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple[object, ...]:
        noise, places = np.asarray(self.noise), self.sensor_positions
        return places.shape, places.tobytes(), noise.shape, noise.tobytes(), self.position


def _default_entries(n: int, n_dims: int) -> tuple[int, ...]:
    if n_dims == 2:
        return default_position(n)
    return (0, 1, 2) if n < 6 else (0, 2, 4)


def _entries(position: tuple[int, ...] | None, n_dims: int) -> tuple[int, ...] | None:
    if position is None:
        return None
    entries = tuple(count("position", entry, minimum=0) for entry in items("position", position))
    if not len(set(entries)) == len(entries) == n_dims:
        number = "two" if n_dims == 2 else "three"
        raise ValueError(f"position must name {number} entries of the state; got {shown(position)}")
    return entries


def _bearing_noise(noise: ArrayLike, n: int) -> float | Float:
    if real("noise", noise).ndim == 0:
        return positive("noise", noise)
    return constant("noise", covariance("noise", noise, n))
