"""Plane waves of several frequencies on sensors that have responses of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.element_response import ElementResponse
from arrivals.measurement_models.arrays.sensor_array import SensorArray, direction
from arrivals.measurement_models.arrays.sphere import unit_vectors
from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.typing import Complex, Float, Int
from arrivals.validation import SMALLEST, positive, real


@dataclass(frozen=True)
class PlaneWaves(FrozenModel):
    """Response of an array to plane waves.

    Parameters
    ----------
    array : SensorArray
        Positions of the sensors.
    wavelengths : sequence of float
        Of the frequency bins, m.
    response : ElementResponse, optional
        Isotropic elements if None.
    slowness : sequence of float, optional
        Values of an unknown slowness, as factors of the one that the wavelengths stand for.
    elevation : sequence of float, optional
        Values of an unknown elevation, rad; horizontal waves if None.

    Examples
    --------
    >>> waves = PlaneWaves(SensorArray.uca(5, 0.4), (1.0, 1.2))
    >>> waves.steering([0.0, 0.3, 0.6]).shape
    (1, 2, 5, 3)
    """

    array: SensorArray
    wavelengths: Sequence[float]
    response: ElementResponse | None = None
    slowness: Sequence[float] | None = None
    elevation: Sequence[float] | None = None

    def __post_init__(self) -> None:
        for name in ("wavelengths", "slowness", "elevation"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, tuple(getattr(self, name)))
        if self.response is not None:
            _check_response(self.response, self.array, len(self.wavelengths))
        for factor in self.slowness or ():
            positive("slowness", factor)
        if self.elevation is not None:
            if self.slowness is not None:
                raise ValueError("slowness must be None if elevation is set; got both")
            if self.array.dim == 1:
                raise ValueError("elevation must be None for a line: its directions are cones")
            if not all(abs(angle) <= np.pi / 2 for angle in self.elevation):
                raise ValueError(f"elevation must lie within ±π/2; got {self.elevation}")

    @property
    def is_line(self) -> bool:
        """True if directions are counted from broadside: two angles have one response."""
        return self.array.dim == 1

    @property
    def centre(self) -> Float:
        """Centroid of the sensors, m."""
        return np.asarray(self.array.positions.mean(axis=0))

    @cached_property
    def wavenumber(self) -> Float:
        """2π/λ of the bins, rad/m."""
        return 2 * np.pi / np.asarray(self.wavelengths)

    @cached_property
    def _propagation(self) -> Complex:
        """The wavenumbers times j, (n_bins, 1, 1)."""
        return np.asarray(1j * self.wavenumber[:, None, None], np.complex128)

    @property
    def n_nuisance(self) -> int:
        """Number of values of the second parameter, 1 if there is none."""
        return len(self.slowness or self.elevation or (1,))

    def directions(self, angle: ArrayLike) -> Float:
        """Return slowness vectors of angles (n,), as factors: (n_nuisance, n, dim)."""
        angle = np.asarray(angle, dtype=np.float64)
        if self.is_line:
            u = np.sin(angle)[:, None]
        else:
            height = np.zeros(1) if self.elevation is None else np.asarray(self.elevation)
            flat = np.cos(height)[:, None]
            u = np.empty((len(height), len(angle), self.array.dim))
            u[..., 0], u[..., 1] = flat * np.cos(angle), flat * np.sin(angle)
            if self.array.dim > 2:
                u[..., 2] = np.sin(height)[:, None]
        if self.slowness is None:
            return np.asarray(u[None] if self.is_line else u)
        return np.asarray(np.asarray(self.slowness)[:, None, None] * u)

    def steering(self, angle: ArrayLike, origin: Float | None = None) -> Complex:
        """Return responses to angles (n,), phases counted at `origin`: (n_nuisance, F, M, n).

        The angle of a line runs over the circle: beyond endfire come its mirror images.
        """
        positions = self.array.positions if origin is None else self.array.positions - origin
        path = positions @ self.directions(angle).swapaxes(1, 2)
        a = np.exp(self._propagation * path[:, None])
        if self.response is not None:
            a = a * np.swapaxes(self.response(angle), 1, 2)
        return np.asarray(a)

    def without(self, sensors: Sequence[int] | Int) -> PlaneWaves:
        """Return the waves on the array without some sensors."""
        if len(sensors) == 0:
            return self
        response = self.response and self.response.without(sensors)
        return self.replace(array=self.array.without(map(int, sensors)), response=response)

    def only(self, bins: Sequence[int] | Int) -> PlaneWaves:
        """Return the waves of some of the bins."""
        if len(bins) == len(self.wavelengths):
            return self
        response = self.response
        if response is not None and response.n_bins is not None:
            response = ElementResponse(response.gains[np.asarray(bins)])
        return self.replace(wavelengths=[self.wavelengths[f] for f in bins], response=response)


def source_paths(
    array: SensorArray, doa: Float, elevation: Float | None = None, distance: Float | None = None
) -> tuple[Float, Float]:
    """Return how much nearer to a source than the origin sensors are, m, and their gains.

    Parameters
    ----------
    array : SensorArray
        Positions of the sensors.
    doa : ndarray, shape (...)
        Directions, rad.
    elevation : ndarray, shape (...), optional
        Elevations, rad; horizontal waves if None. Not for a line.
    distance : ndarray, shape (...), optional
        Distances R of the sources from the centroid, m; plane waves if None. Path and gain are
        counted from the centroid then, R - r and R/r, and the path from there to the origin is
        that of a plane wave.

    Returns
    -------
    path, gain : ndarray, shape (..., n_sensors)

    Examples
    --------
    >>> path, gain = source_paths(SensorArray([0.0, 2.0]), np.array(np.pi / 2), None, np.array(4.0))
    >>> path.round(6), gain.round(6)
    (array([0., 2.]), array([0.8     , 1.333333]))
    """
    n = direction(doa, array.dim)
    if elevation is not None:
        if array.dim == 1:
            raise ValueError("elevation must be None for a line: its directions are cones")
        n = unit_vectors(doa, elevation)[..., : array.dim]
    if distance is None:
        return n @ array.positions.T, np.ones(1)
    if not (distance > SMALLEST).all():
        raise ValueError(f"distance must be positive; got {shown(distance)}")
    centre = array.positions.mean(axis=0)
    p = array.positions - centre
    along, v = n @ p.T, 1 / distance[..., None]
    square = (p**2).sum(axis=1)
    # t = r/R = √(1 - 2 n·p/R + p²/R²),  R - r = (2 n·p - p²/R) / (1 + t)
    t = np.sqrt(np.maximum(1 - 2 * along * v + square * v * v, 1e-300))
    return (n @ centre)[..., None] + (2 * along - square * v) / (1 + t), 1 / t


def frequency_bins(wavelength: float | Sequence[float]) -> float | tuple[float, ...]:
    """Return the wavelength of one bin, or those of several.

    Examples
    --------
    >>> frequency_bins([2.0]), frequency_bins([2.0, 1.0])
    (2.0, (2.0, 1.0))
    """
    is_list = isinstance(wavelength, Sequence) and not isinstance(wavelength, str)
    if not is_list and not (isinstance(wavelength, np.ndarray) and wavelength.ndim):
        return positive("wavelength", wavelength)
    bins = tuple(positive("wavelength", each) for each in iter(wavelength))  # type: ignore[arg-type]
    if not bins:
        raise ValueError("wavelength must name at least one bin; got none")
    return bins if len(bins) > 1 else bins[0]


def grid_of(name: str, values: Sequence[float] | None) -> tuple[float, ...] | None:
    """Return the grid of an unknown parameter, None where it is known.

    Examples
    --------
    >>> grid_of("slowness", [0.9, 1])
    (0.9, 1.0)
    """
    if values is None:
        return None
    grid = real(name, values)
    if grid.ndim != 1 or len(grid) == 0 or not np.isfinite(grid).all():
        raise ValueError(f"{name} must be a list of finite numbers; got {shown(values)}")
    return tuple(grid.tolist())


def _check_response(response: ElementResponse, array: SensorArray, n_bins: int) -> None:
    if array.dim == 1:
        raise ValueError(
            "positions must be in a plane for responses as functions of the azimuth; got a line"
        )
    shape = f"({array.n_sensors} sensors" + (f", {n_bins} bins)" if n_bins > 1 else ")")
    if response.n_sensors != array.n_sensors or response.n_bins not in (None, n_bins):
        raise ValueError(
            "the element response must have shape (n_angles, n_sensors) or (n_bins, n_angles, "
            f"n_sensors) {shape}; got {response.gains.shape}"
        )
