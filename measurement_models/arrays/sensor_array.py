"""Positions of sensors and their response to plane waves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.positions import check_distinct
from arrivals.measurement_models.arrays.uniform_grid import grid_spacing
from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.typing import Complex, Float, Int
from arrivals.validation import LARGEST, count, items, positive, real


def direction(doa: ArrayLike, dim: int) -> Float:
    """Return the unit vectors, (..., dim), that point from the array to where the waves come from.

    On a line `doa` is counted from broadside, positive towards growing coordinates. In a plane it
    is the azimuth, anticlockwise from the x axis; in space, the azimuth of a horizontal wave.

    Examples
    --------
    >>> direction(np.pi / 6, 1).round(3), direction(np.pi / 2, 2).round(3)
    (array([0.5]), array([0., 1.]))
    """
    doa = real("doa", doa)
    if dim == 1:
        return np.asarray(np.sin(doa)[..., None])
    level = [np.zeros_like(doa)] * (dim - 2)
    return np.stack([np.cos(doa), np.sin(doa), *level], axis=-1)


def steering_vector(positions: ArrayLike, doa: ArrayLike, wavelength: ArrayLike) -> Complex:
    """Return the response of sensors at `positions` to plane waves of unit amplitude.

    This is the one place where the sign is fixed: a sensor nearer to the source receives the wave
    earlier, and for signals that turn as exp(+jωt), as the spectra of numpy and scipy do, its
    phase is ahead: a = exp(+j 2π/λ p·u), u pointing to the source. Papers that write
    exp(-j m d 2π/λ sin β) count their sensors, or their angles, the other way round.

    Parameters
    ----------
    positions : array_like, shape (n_sensors, dim)
        Metres.
    doa : array_like, shape (...)
        Directions of arrival, rad.
    wavelength : array_like, shape broadcasting with `doa`
        Metres.

    Returns
    -------
    ndarray, shape (..., n_sensors)

    Examples
    --------
    >>> steering_vector([[0.0], [0.25]], np.pi / 2, wavelength=1.0).round(6)
    array([1.+0.j, 0.+1.j])
    """
    positions, wavelength = real("positions", positions), real("wavelength", wavelength)
    if not (wavelength > 0).all():
        raise ValueError(f"wavelength must be positive; got {shown(wavelength)}")
    path = direction(doa, positions.shape[1]) @ positions.T
    try:
        waves = path / wavelength[..., None]
    except ValueError:
        shapes = f"{path.shape[:-1]} and {wavelength.shape}"
        raise ValueError(f"doa and wavelength must have shapes that fit; got {shapes}") from None
    return np.asarray(np.exp(2j * np.pi * waves))


@dataclass(frozen=True, eq=False)
class SensorArray(FrozenModel):
    """Sensors at known positions.

    Parameters
    ----------
    positions : array_like, shape (n_sensors, dim) or (n_sensors,)
        Metres; dim is 1 for a line, 2 for a plane, 3 in space.
    speed : float, optional
        Speed of the waves, m/s; needed to convert a frequency into a wavelength.
    channels : sequence of int, optional
        The recording's channel of each sensor, counted from 0; in order of the sensors if None.
    n_channels : int, optional
        Channels of a recording of the whole array; if None, any that has the channels named.

    Raises
    ------
    ValueError
        If two sensors share a position, or a number is not finite.

    Examples
    --------
    >>> array = SensorArray.ula(4, spacing=0.5)
    >>> array.positions.ravel()
    array([-0.75, -0.25,  0.25,  0.75])
    >>> array.steering_vector(np.pi / 2, wavelength=2.0).round(3)[:2]
    array([-0.707-0.707j,  0.707-0.707j])
    >>> array.without([1]).channels
    (0, 2, 3)
    """

    positions: Float
    speed: float | None = None
    channels: Sequence[int] | Int | None = None
    n_channels: int | None = None

    def __post_init__(self) -> None:
        positions = real("positions", self.positions)
        positions = positions[:, None] if positions.ndim == 1 else positions
        positions = positions + 0.0  # a copy, without the sign of -0.0, which would change the hash
        if positions.ndim != 2 or not 1 <= positions.shape[1] <= 3 or len(positions) == 0:
            raise ValueError(
                "positions must have shape (n_sensors, dim), dim 1, 2 or 3; "
                f"got {np.shape(self.positions)}"
            )
        if not (np.abs(positions) < LARGEST).all():
            bad = int(np.argmin(np.isfinite(positions).all(axis=1)))
            raise ValueError(f"positions must be finite; sensor {bad} is at {positions[bad]}")
        check_distinct(positions)
        positions.setflags(write=False)
        object.__setattr__(self, "positions", positions)
        if self.speed is not None:
            object.__setattr__(self, "speed", positive("speed", self.speed))
        if self.channels is not None:
            given = items("channels", self.channels)
            channels = tuple(count("channels", channel, minimum=0) for channel in given)
            if len(channels) != len(positions):
                raise ValueError(
                    f"channels must name one channel for each of the {len(positions)} sensors; "
                    f"got {len(channels)}"
                )
            if len(set(channels)) != len(channels):
                raise ValueError(f"channels must differ from each other; got {channels}")
            object.__setattr__(self, "channels", channels)
        if self.n_channels is not None:
            last = max(self.channels or range(len(positions)))
            count("n_channels", self.n_channels, minimum=last + 1)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SensorArray):
            return NotImplemented
        return (
            np.array_equal(self.positions, other.positions)
            and self.speed == other.speed
            and self.channels == other.channels
            and self.n_channels == other.n_channels
        )

    def __hash__(self) -> int:
        return hash((self.positions.tobytes(), self.speed, self.channels))

    @property
    def n_sensors(self) -> int:
        """Number of sensors."""
        return len(self.positions)

    @property
    def dim(self) -> int:
        """1 for a line, 2 for a plane, 3 in space."""
        return int(self.positions.shape[1])

    @property
    def spacing(self) -> float | None:
        """Spacing, m, of the uniform grid that a line's sensors lie on, or None."""
        return grid_spacing(self.positions[:, 0]) if self.dim == 1 else None

    @property
    def alias_limit(self) -> float | None:
        """Shortest wavelength, m, whose directions are unambiguous: two grid spacings of a line."""
        spacing = self.spacing
        return None if spacing is None else 2 * spacing

    @classmethod
    def ula(
        cls,
        n_sensors: int,
        spacing: float,
        *,
        missing: Iterable[int] = (),
        speed: float | None = None,
    ) -> SensorArray:
        """Make a uniform line about the origin; `missing` names sensors, from 0, to leave out."""
        places = (
            np.arange(count("n_sensors", n_sensors, 1, 100_000), dtype=np.float64)
            - (n_sensors - 1) / 2
        )
        return cls(places * positive("spacing", spacing), speed).without(missing)

    @classmethod
    def uca(
        cls,
        n_sensors: int,
        radius: float,
        *,
        missing: Iterable[int] = (),
        speed: float | None = None,
    ) -> SensorArray:
        """Make a uniform circle about the origin, the first sensor on the x axis, anticlockwise."""
        angle = 2 * np.pi * np.arange(count("n_sensors", n_sensors, 2, 100_000)) / n_sensors
        return cls(positive("radius", radius) * direction(angle, 2), speed).without(missing)

    @classmethod
    def symmetric(
        cls,
        distances: ArrayLike,
        *,
        missing: Iterable[int] = (),
        speed: float | None = None,
    ) -> SensorArray:
        """Make a line with a sensor in the centre and one at each distance, m, on either side."""
        d = np.sort(np.atleast_1d(real("distances", distances)))
        if d.ndim != 1 or len(d) == 0 or not (d > 0).all():
            raise ValueError(
                f"distances must be a list of positive numbers; got {shown(distances)}"
            )
        return cls(np.concatenate([-d[::-1], [0.0], d]), speed).without(missing)

    if TYPE_CHECKING:  # functions of `arrays.files`, which the package `arrays` attaches

        @staticmethod
        def from_csv(path: str | Path, *, speed: float | None = None) -> SensorArray:
            """Read positions, one sensor a row, columns x, y, z in metres."""

        @staticmethod
        def from_file(source: str | PathLike[str]) -> SensorArray:
            """Read an array file (TOML, JSON, CSV), or the preset of a name."""

        @staticmethod
        def from_toml(path: str | PathLike[str]) -> SensorArray:
            """Read an array file; see `arrays.description` for its keys."""

    def without(self, sensors: Iterable[int]) -> SensorArray:
        """Return the array without some sensors, named by index; the others keep their channels."""
        gone = sorted({count("sensor", sensor, minimum=0) for sensor in items("sensors", sensors)})
        if not gone:
            return self
        if gone[-1] >= self.n_sensors:
            raise ValueError(f"sensor {gone[-1]} is not there: the array has {self.n_sensors}")
        if len(gone) == self.n_sensors:
            raise ValueError("sensors must leave at least one sensor")
        kept = np.setdiff1d(np.arange(self.n_sensors), gone)
        if self.channels is None:
            return SensorArray(self.positions[kept], self.speed, kept, self.n_sensors)
        channels = np.array(self.channels)[kept]
        return SensorArray(self.positions[kept], self.speed, channels, self.n_channels)

    def steering_vector(self, doa: ArrayLike, wavelength: ArrayLike) -> Complex:
        """Return the response to plane waves from `doa` (...), rad: shape (..., n_sensors)."""
        return steering_vector(self.positions, doa, wavelength)

    def wavelength(self, frequency: float) -> float:
        """Return the wavelength, m, at a frequency, Hz, from the array's wave speed."""
        if self.speed is None:
            raise ValueError("the array has no wave speed: give speed, m/s")
        return self.speed / positive("frequency", frequency)

    def select(self, samples: ArrayLike) -> Any:
        """Return the sensors' channels of a recording, (..., n_channels) -> (..., n_sensors).

        A recording with one channel for each sensor is taken as it is where the channels named
        do not fit: missing elements were not recorded then.

        Raises
        ------
        ValueError
            If the recording has too few channels, or too many.

        Examples
        --------
        >>> SensorArray.ula(3, 0.5, missing=[1]).select([[10, 11, 12]])
        array([[10, 12]])
        """
        samples = np.asarray(samples)
        n_channels = samples.shape[-1] if samples.ndim else 0
        channels = range(self.n_sensors) if self.channels is None else self.channels
        wanted = self.n_sensors if self.channels is None else self.n_channels
        if n_channels == wanted or (wanted is None and n_channels > max(channels)):
            return samples[..., list(channels)]
        if n_channels == self.n_sensors:
            return samples
        other = f"at least {max(channels) + 1}" if wanted is None else str(wanted)
        others = "" if wanted == self.n_sensors else f" or {other}"
        cure = "channels = [...], the channel of each element"
        if n_channels < self.n_sensors:
            cure = "missing = [...], the elements without a channel"
        raise ValueError(
            f"the recording must have {self.n_sensors}{others} channels; got {n_channels}: "
            f"add {cure}, to the array file"
        )
