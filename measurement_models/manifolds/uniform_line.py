"""Response of a line of sensors on a uniform grid, as a function of the electrical angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.sensor_array import SensorArray
from arrivals.measurement_models.manifolds.manifold import UNIFORM_STD_OF_LINE, Reference
from arrivals.typing import Complex, Float, Int
from arrivals.validation import one_of


@dataclass(frozen=True, eq=False)
class UniformLineManifold:
    """A line of sensors on a uniform grid, with or without gaps, at one wavelength.

    The angle is the electrical one, θ = 2π d/λ sin β for a grid of spacing d: the phase step
    between neighbouring grid points. The harmonics are the occupied grid points, and G = I.

    Parameters
    ----------
    grid_index : ndarray of int, shape (n_sensors,)
        Grid points of the sensors, in their order.
    step : float
        Largest electrical angle of a plane wave, 2π d/λ, rad.
    origin : float
        Where the origin of coordinates lies, in grid points.
    reference : {"middle", "first"}
        The sensor whose phase is that of the amplitude. In the middle, the amplitude's phase and
        the angle are uncorrelated a posteriori; the papers take the first sensor.

    Examples
    --------
    >>> line = UniformLineManifold(np.arange(5), step=np.pi, origin=2.0)
    >>> line.harmonics
    array([-2, -1,  0,  1,  2])
    >>> np.rad2deg(line.to_doa([np.pi / 2])).round(6)
    array([30.])
    """

    grid_index: Int
    step: float
    origin: float
    reference: Reference = "middle"

    def __post_init__(self) -> None:
        one_of("reference", self.reference, ("middle", "first"))

    @property
    def n_sensors(self) -> int:
        """Number of sensors."""
        return len(self.grid_index)

    @property
    def n_unknowns(self) -> int:
        """One: the electrical angle."""
        return 1

    @property
    def n_bins(self) -> int:
        """One frequency."""
        return 1

    @cached_property
    def reference_index(self) -> int:
        """Grid point at which the phase is counted."""
        if self.reference == "first":
            return int(self.grid_index[0])
        off = np.abs(self.grid_index - (self.grid_index.mean() + 1e-9))
        return int(self.grid_index[np.argmin(off)])

    @property
    def harmonics(self) -> Int:
        """Grid points of the sensors, counted from the reference."""
        return self.grid_index - self.reference_index

    @property
    def coefficients(self) -> None:
        """Return None: the sensors are the harmonics."""
        return

    @property
    def front_back_ambiguous(self) -> bool:
        """Return False: each electrical angle has one direction."""
        return False

    @property
    def nuisance_weights(self) -> Float:
        """No second parameter."""
        return np.ones(1)

    def steering(self, theta: ArrayLike) -> Complex:
        """Return the responses to angles (n,): (1, 1, n_sensors, n)."""
        phase = np.multiply.outer(self.harmonics, np.asarray(theta, dtype=np.float64))
        return np.asarray(np.exp(1j * phase))[None, None]

    def norm_squared(self) -> float:
        """Return ‖a(θ)‖² = M."""
        return float(self.n_sensors)

    def to_doa(self, theta: ArrayLike, slack: ArrayLike = 0.0) -> Float:
        """Return directions from broadside, rad, NaN outside the physical range.

        Angles beyond endfire by no more than `slack`, and rounding, are taken to be at endfire.
        """
        sine = np.asarray(theta, dtype=np.float64) / self.step
        beyond = np.abs(sine) > 1 + np.asarray(slack) / self.step + 1e-9
        return np.where(beyond, np.nan, np.arcsin(np.minimum(np.maximum(sine, -1), 1)))

    def doa_std(self, theta: ArrayLike, std: ArrayLike) -> Float:
        """Return half the width of the directions of θ ± std, at most that of a uniform one."""
        theta, std = np.asarray(theta, dtype=np.float64), np.asarray(std)
        inside = np.minimum(np.maximum(theta, -self.step), self.step)
        low = np.arcsin(np.maximum((inside - std) / self.step, -1))
        high = np.arcsin(np.minimum((inside + std) / self.step, 1))
        return np.asarray(np.minimum((high - low) / 2, UNIFORM_STD_OF_LINE))

    def slope(self, theta: ArrayLike) -> Float:
        """Return dθ/dβ = 2π d/λ cos β, with a cosine of at least 0.1."""
        sine = np.asarray(theta, dtype=np.float64) / self.step
        return np.asarray(self.step * np.sqrt(np.maximum(1 - sine * sine, 0.01)))

    def from_doa(self, doa: ArrayLike) -> Float:
        """Return electrical angles, rad."""
        return np.asarray(self.step * np.sin(doa))

    def to_amplitude(self, w: ArrayLike, theta: ArrayLike) -> Complex:
        """Return amplitudes at the origin of the array's coordinates."""
        shift = self.origin - self.reference_index
        return np.asarray(np.asarray(w) * np.exp(1j * shift * np.asarray(theta)))

    def without(self, sensors: Sequence[int] | Int) -> UniformLineManifold:
        """Return the manifold of the line without some sensors."""
        if len(sensors) == 0:
            return self
        return _line_without(self, tuple(map(int, sensors)))

    def only(self, bins: Sequence[int] | Int) -> UniformLineManifold:
        """Return the same: there is one bin."""
        return self


@lru_cache(maxsize=256)
def _line_without(line: UniformLineManifold, sensors: tuple[int, ...]) -> UniformLineManifold:
    """Return a line without some sensors; cached, as are the results derived from it."""
    grid_index = np.delete(line.grid_index, sensors)
    return UniformLineManifold(grid_index, line.step, line.origin, line.reference)


@lru_cache(maxsize=256)
def grid_line(
    array: SensorArray, wavelength: float, reference: Reference
) -> UniformLineManifold | None:
    """Return the manifold of a line on a uniform grid within half a wavelength; else None."""
    spacing = array.spacing
    if spacing is None or wavelength < 2 * spacing * (1 - 1e-6):
        return None
    coordinates = array.positions[:, 0]
    grid_index = np.rint((coordinates - coordinates.min()) / spacing).astype(np.int64)
    step = min(2 * np.pi * spacing / wavelength, np.pi)
    return UniformLineManifold(grid_index, step, -float(coordinates.min()) / spacing, reference)
