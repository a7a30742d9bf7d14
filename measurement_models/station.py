"""Arrays at known places of a map, and the azimuths at which they receive positions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import LARGEST, constant, instance, not_negative, number, real, shaped

SIDES = np.array([1.0, -1.0])  # of a line
MIN_SQUARED_RANGE = 1e-9  # m²; at the station itself the azimuth has no slope
MIN_LAG = 1e-12  # s


class StationEntries(NamedTuple):
    """Entries of a state that a station reads.

    Parameters
    ----------
    position : (int, int)
        Entries that are x and y.
    velocity : (int, int), optional
        Entries that are the velocities along x and y. If None, sources do not move while their
        waves travel.
    errors : int, optional
        First of the three entries that are the station's errors: of its heading, rad, of x and
        of y, m. If None it has none.

    Examples
    --------
    >>> station, entries = Station(None, [0.0, 0.0], heading_std=0.1), StationEntries(errors=4)
    >>> turned = station.azimuth([5.0, 0.0, 5.0, 0.0, np.pi / 4, 0.0, 0.0], entries)
    >>> float(turned.round(6))
    0.0
    """

    position: tuple[int, int] = (0, 2)
    velocity: tuple[int, int] | None = (1, 3)
    errors: int | None = None


IN_PLANE = StationEntries()  # x, vx, y, vy


@dataclass(frozen=True, eq=False, init=False)
class Station(FrozenModel):
    """An array at a place of a map, turned by its heading.

    Parameters
    ----------
    measurement : DirectionMeasurement, optional
        Model of the array's snapshots; None for a station whose bearings are ready-made.
    position : array_like, shape (2,)
        Position on the map, m.
    heading : float
        Azimuth of the array's x axis, of a line that of its sensors, rad, anticlockwise from the
        x axis of the map.
    heading_std, position_std : float
        Standard deviations of unknown constant errors of the heading, rad, and of each coordinate
        of the position, m. A tracker with these entries in its state estimates them.
    wave_speed : float
        Speed of the waves, m/s; what is received left the source r/c before. Infinite by default.
    name : str
        Name in tables and plots.

    Raises
    ------
    TypeError, ValueError
        If a shape is wrong, or a number is out of range.

    Notes
    -----
    Shapes: states (..., n), azimuths (...). Units: m, rad, azimuths anticlockwise from the x axis
    of the map, in [-π, π). Without errors and delay `azimuth` is `Bearing.h` of the position.

    Examples
    --------
    >>> station = Station(None, [100.0, 0.0], heading=np.pi / 2)
    >>> float(np.rad2deg(station.azimuth([100.0, 0.0, 50.0, 0.0])).round(6))
    90.0
    >>> np.rad2deg(station.to_map([0.0, -np.pi / 4])).round(6)
    array([[90.],
           [45.]])
    """

    measurement: DirectionMeasurement | None
    position: Float
    heading: float
    heading_std: float
    position_std: float
    wave_speed: float
    name: str

    def __init__(
        self,
        measurement: DirectionMeasurement | None,
        position: ArrayLike,
        heading: float = 0.0,
        *,
        heading_std: float = 0.0,
        position_std: float = 0.0,
        wave_speed: float = np.inf,
        name: str = "",
    ) -> None:
        if not (measurement is None or isinstance(measurement, DirectionMeasurement)):
            raise TypeError(
                f"measurement must be a DirectionMeasurement or None; got {shown(measurement)}"
            )
        place = shaped("position", position, 2)
        speed = number("wave_speed", wave_speed)
        if not speed > 0:
            raise ValueError(f"wave_speed must be positive; got {wave_speed}")
        own = {
            "measurement": measurement,
            "position": constant("position", place[None] + 0.0)[0],
            "heading": _finite("heading", heading),
            "heading_std": not_negative("heading_std", heading_std),
            "position_std": not_negative("position_std", position_std),
            "wave_speed": speed,
            "name": instance("name", name, str),
        }
        for key, value in own.items():
            object.__setattr__(self, key, value)

    @property
    def has_errors(self) -> bool:
        """True if heading or position has an unknown error."""
        return self.heading_std > 0 or self.position_std > 0

    @property
    def is_line(self) -> bool:
        """True if the sensors are on a line, whose two sides are ambiguous."""
        array = getattr(self.measurement, "array", None)
        return bool(array is not None and array.dim == 1)

    def to_map(self, doa: ArrayLike) -> Float:
        """Return azimuths on the map of directions at the array, (...) -> (..., n_images), rad.

        A line has two images, heading ± (π/2 - doa); other arrays have one, heading + doa.
        """
        doa = real("doa", doa)[..., None]
        if self.is_line:
            return _wrap(self.heading + (np.pi / 2 - doa) * SIDES)
        return _wrap(self.heading + doa)

    def from_map(self, azimuth: ArrayLike) -> Float:
        """Return directions at the array of azimuths on the map, rad: the inverse of `to_map`."""
        relative = _wrap(real("azimuth", azimuth) - self.heading)
        return np.asarray(np.pi / 2 - np.abs(relative)) if self.is_line else relative

    def azimuth(self, x: ArrayLike, entries: StationEntries = IN_PLANE) -> Float:
        """Return the azimuths of states on the map, (..., n) -> (...), rad.

        d = p - v |p - s| / c - s - e_xy,  atan2(d_y, d_x) - e_heading.
        """
        x = real("x", x)
        east, north, _ = self._vector(x, entries)
        azimuth = np.arctan2(north, east)
        if entries.errors is None:
            return np.asarray(azimuth)
        return _wrap(azimuth - x[..., entries.errors])

    def slope(self, x: ArrayLike, entries: StationEntries = IN_PLANE) -> Float:
        """Return the gradients of `azimuth` at states, (..., n) -> (..., n).

        g = (-d_y, d_x)/|d|² of d; q = p - s - e_xy, r = |q|: g - (g·v/c) q/r of x and y, the
        opposite of the errors of x and y, -1 of that of the heading, and -r/c g of the velocity.
        """
        x = real("x", x)
        i, j = entries.position
        q_x, q_y = self._offset(x, entries)
        east, north, lag = self._vector(x, entries)
        square = np.maximum(east * east + north * north, MIN_SQUARED_RANGE)
        along_x, along_y = -north / square, east / square
        slope = np.zeros_like(x)
        if entries.velocity is not None and self.is_late:
            k, m = entries.velocity
            slope[..., k], slope[..., m] = -lag * along_x, -lag * along_y
            radial = along_x * x[..., k] + along_y * x[..., m]
            radial = radial / (self.wave_speed**2 * np.maximum(lag, MIN_LAG))
            along_x, along_y = along_x - radial * q_x, along_y - radial * q_y
        slope[..., i], slope[..., j] = along_x, along_y
        if (e := entries.errors) is not None:
            slope[..., e] = -1.0
            slope[..., e + 1], slope[..., e + 2] = -along_x, -along_y
        return slope

    @property
    def is_late(self) -> bool:
        """True if the waves take time: `wave_speed` is finite."""
        return self.wave_speed < np.inf

    def _offset(self, x: Float, entries: StationEntries) -> tuple[Float, Float]:
        """Return x and y from the station to the source."""
        i, j = entries.position
        east, north = x[..., i] - self.position[0], x[..., j] - self.position[1]
        if (e := entries.errors) is not None:
            east, north = east - x[..., e + 1], north - x[..., e + 2]
        return east, north

    def _vector(self, x: Float, entries: StationEntries) -> tuple[Float, Float, Float | float]:
        """Return x and y from the station to where the waves left the source, and r/c, s."""
        east, north = self._offset(x, entries)
        if not self.is_late or entries.velocity is None:
            return east, north, 0.0
        lag = np.hypot(east, north) / self.wave_speed
        k, m = entries.velocity
        return east - x[..., k] * lag, north - x[..., m] * lag, lag

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Station):
            return NotImplemented
        return self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple[object, ...]:
        params = self.get_params(deep=False).values()
        return tuple(v.tobytes() if isinstance(v, np.ndarray) else v for v in params)


def _wrap(angle: Float) -> Float:
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


def _finite(name: str, value: float) -> float:
    if not abs(value := number(name, value)) < LARGEST:
        raise ValueError(f"{name} must be finite; got {value}")
    return value
