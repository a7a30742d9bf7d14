"""Base of responses as functions of points, and what their grids and sines share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.manifold import UNIFORM_STD_OF_LINE, CandidatePoints
from arrivals.typing import Bool, Complex, Float, Int

SPACING_OF_ONE = 0.45  # of candidates, rad rms of the phases over the array
SPACING_OF_TWO = 0.5
SAME_SOURCE = 0.99  # correlation of the responses of two directions that count as one source
WALK_SHARE = 0.1  # of the largest 1/R of spherical waves: its default step
MOST_CANDIDATES = 1 << 16
MIN_COSINE = 0.1  # of the angle between a wave and broadside, where its inverse is taken


@dataclass(frozen=True, eq=False)
class PointResponse(ABC):
    """Base of the responses of one array, of isotropic sensors, to points.

    Parameters
    ----------
    waves : PlaneWaves
        Array and wavelengths.
    unit : tuple of float
        Change of each unknown that turns the phases over the whole array by 1 rad rms.
    centre : tuple of float
        Point from which directions, and distances, are counted: the centroid of the whole array.

    Notes
    -----
    Unit and centre stay as they are in the manifold of fewer sensors or bins: a point means the
    same in all of them.
    """

    waves: PlaneWaves
    unit: tuple[float, ...]
    centre: tuple[float, ...]

    is_linear: ClassVar[bool] = False
    merge_correlation: ClassVar[float | None] = None

    @property
    def spike_precision(self) -> float | None:
        """Prior precision of the second unknown of a plane wave; None without a choice."""
        return None

    @property
    def slab_precision(self) -> float | None:
        """Prior precision of the second unknown of a curved wave; None without a choice."""
        return None

    @property
    def walk_range(self) -> float:
        """Default standard deviation of the step of 1/R per unit of time, 1/m; 0 without."""
        return 0.0

    @property
    def n_unknowns(self) -> int:
        """Number of unknowns of a source."""
        return len(self.unit)

    @property
    def point_size(self) -> int:
        """Numbers of a point: one for each unknown."""
        return self.n_unknowns

    @property
    def n_sensors(self) -> int:
        """Number of sensors."""
        return self.waves.array.n_sensors

    @property
    def n_bins(self) -> int:
        """Number of frequency bins."""
        return len(self.waves.wavelengths)

    @cached_property
    def positions(self) -> Float:
        """Positions of the sensors from the centre, m: (n_sensors, dim)."""
        return self.waves.array.positions - self.centre

    @cached_property
    def scale(self) -> Float:
        """The units as a column, (d, 1)."""
        return np.array(self.unit)[:, None]

    @cached_property
    def wavenumber(self) -> Float:
        """2π/λ of the bins, rad/m: (F, 1, 1)."""
        return self.waves.wavenumber[:, None, None]

    def move(self, x: Float, step: Float) -> Float:
        """Return the points after displacements: their sum."""
        return x + step

    def offset(self, x: Float, mean: Float) -> tuple[Float, Float | None]:
        """Return the differences of points, and None for an identity as their derivative."""
        return x - mean, None

    def without(self, sensors: Sequence[int] | Int) -> Self:
        """Return the manifold of the array without some sensors, cached."""
        return cast(Self, _without(self, tuple(map(int, sensors)))) if len(sensors) else self

    def only(self, bins: Sequence[int] | Int) -> Self:
        """Return the manifold of some of the bins, cached."""
        if len(bins) == self.n_bins:
            return self
        return cast(Self, _only(self, tuple(map(int, bins))))

    @abstractmethod
    def direction(self, x: Float) -> Float:
        """Return unit vectors to points (..., p, L): (..., 3, L), or sin β, (..., 1, L)."""

    def origin_phase(self, x: Float) -> Float:
        """Return the phase that is left out of a response, rad: (L,), at the first bin."""
        centroid = self.waves.centre
        return np.asarray(
            self.waves.wavenumber[0] * (centroid @ self.direction(x)[..., : len(centroid), :])
        )

    def size(self, x: Float) -> Float | float:
        """Return ‖a‖ of unit amplitude at the centre, as a share of √M: (L,) or 1."""
        return 1.0

    def to_amplitude(self, w: ArrayLike, x: Float) -> Complex:
        """Return amplitudes at the centre, phases at the origin; of several bins the size alone."""
        w = np.asarray(w, dtype=np.complex128) / self.size(x)
        if self.n_bins > 1:
            return np.asarray(np.abs(w) + 0j)
        return np.asarray(w * np.exp(-1j * self.origin_phase(x)))

    @cached_property
    def _candidates(self) -> CandidatePoints:
        return self.new_candidates()

    def candidates(self) -> CandidatePoints:
        """Return the points at which sources may appear."""
        return self._candidates

    @abstractmethod
    def new_candidates(self) -> CandidatePoints:
        """Return the points at which sources may appear, made anew."""


@lru_cache(maxsize=256)
def _without(manifold: PointResponse, sensors: tuple[int, ...]) -> PointResponse:
    return replace(manifold, waves=manifold.waves.without(sensors))


@lru_cache(maxsize=256)
def _only(manifold: PointResponse, bins: tuple[int, ...]) -> PointResponse:
    return replace(manifold, waves=manifold.waves.only(bins))


def cell_count(*cells: float) -> list[int]:
    """Return numbers of cells of a grid, one an unknown, rounded up.

    Raises
    ------
    ValueError
        If the grid has too many points.

    Examples
    --------
    >>> cell_count(3.2, 5.0)
    [4, 5]
    """
    n_points = float(np.prod(np.ceil(cells)))
    if not n_points <= MOST_CANDIDATES:
        cure = "leave sensors out, or use longer wavelengths"
        wanted = f"resolve at most {MOST_CANDIDATES} directions or ranges"
        raise ValueError(f"array must {wanted}; got about {n_points:.2g}: {cure}")
    return [int(np.ceil(each)) for each in cells]


def cell_centres(n: int) -> Float:
    """Return the centres of n equal cells from -1 to 1."""
    return -1 + 2 * (np.arange(n) + 0.5) / n


def lattice_images(p: Float, wavelength: float) -> Float:
    """Return changes of (u, v) that leave the response as it is, (2, n): of sensors on a lattice.

    Parameters
    ----------
    p : ndarray, shape (2, n_sensors)
        Coordinates in their plane, m.
    wavelength : float
        Wavelength, m.

    Returns
    -------
    ndarray, shape (2, 8) or (2, 0)
        The eight changes around zero; none where neighbours do not span the whole array.

    Examples
    --------
    >>> lattice_images(np.array([[0.0, 0.5, 0.0, 0.5], [0.0, 0.0, 0.4, 0.4]]), 1.0).max(axis=1)
    array([2. , 2.5])
    """
    apart = (p[:, :, None] - p[:, None]).reshape(2, -1)
    length = np.hypot(*apart)
    order = np.argsort(length, kind="stable")
    apart = apart[:, order[length[order] > 1e-9 * length.max()]]
    one, across = apart[:, 0], apart[0, 0] * apart[1] - apart[1, 0] * apart[0]
    basis = np.stack([one, apart[:, (np.abs(across) > 1e-6 * np.abs(across).max()).argmax()]])
    steps = np.linalg.solve(basis.T, p - p[:, :1])
    if np.abs(steps - np.round(steps)).max() > 1e-6:
        return np.zeros((2, 0))
    i, j = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]).T
    # k b·q = 2π n for both vectors b of the basis
    return np.asarray(wavelength * np.linalg.solve(basis, np.stack([i, j]).astype(np.float64)))


def sine_limits(sine: Float) -> Float:
    """Return sines cut to ±1."""
    return np.minimum(np.maximum(sine, -1.0), 1.0)


def cosine_squared(sine: Float) -> Float:
    """Return 1 - sin² of an angle, at least 0.01."""
    return np.maximum(1 - sine * sine, MIN_COSINE**2)


def line_direction(sine: Float, std: Float) -> tuple[Float, Float]:
    """Return directions from broadside and their deviations, rad, from those of their sines.

    A deviation is half the width of the directions of sin β ± std, at most that of a uniform one.

    Examples
    --------
    >>> doa, std = line_direction(np.array([0.5, 1.2]), np.array([0.01, 0.01]))
    >>> np.rad2deg(doa).round(2), np.rad2deg(std).round(2)
    (array([30., 90.]), array([0.66, 4.05]))
    """
    sine = sine_limits(sine)
    low, high = np.arcsin(sine_limits(sine + np.multiply.outer([-1.0, 1.0], std)))
    return np.arcsin(sine), np.minimum((high - low) / 2, UNIFORM_STD_OF_LINE)


def sine_exists(sine: Float, std: Float) -> Bool:
    """Return which sines are within three standard deviations of a direction.

    Examples
    --------
    >>> sine_exists(np.array([0.5, 1.02, 1.2]), np.array([0.01, 0.01, 0.01]))
    array([ True,  True, False])
    """
    return np.asarray(np.abs(sine) <= 1 + 3 * std + 1e-9)
