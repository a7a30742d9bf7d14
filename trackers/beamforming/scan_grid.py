"""Grids of scan directions on a line, the circle and the sphere, and peaks of spectra there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sphere import azimuth_elevation, fibonacci_sphere
from arrivals.measurement_models.manifolds.phase import plane_axes
from arrivals.trackers.beamforming.spectrum import find_peaks, parabolic_peak, scan_directions
from arrivals.typing import Float, Int
from arrivals.validation import count

MAX_DIRECTIONS = 100_000
DEFAULT_DIRECTIONS = 361  # of azimuth; every half degree of a line
DEFAULT_STEP = np.deg2rad(2.0)  # on the sphere
MIN_SPHERE_DIRECTIONS = 50
N_NEIGHBOURS = 8
TINY = np.finfo(np.float64).tiny
MIN_RISE = 1e-9  # of the largest power: the ripple of a flat spectrum is rounding
N_STENCILS = 12  # of a search between grid points; one without a higher point halves the step
STENCIL = np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y])  # (8, 2)

Level = Callable[[Float], Float]  # of powers, in which peaks are parabolas


def log_level(power: Float) -> Float:
    """Return the logarithm of powers, in which the peak of a beam is nearly a parabola.

    Examples
    --------
    >>> log_level(np.array([1.0, np.e]))
    array([0., 1.])
    """
    return np.asarray(np.log(np.maximum(power, TINY)))


def inverse_level(power: Float) -> Float:
    """Return -1 / power, in which the peak of a null spectrum is nearly a parabola.

    Examples
    --------
    >>> inverse_level(np.array([1.0, 2.0]))
    array([-1. , -0.5])
    """
    return -1 / power


class ScanGrid(ABC):
    """Directions of a scan, and the search for peaks of a spectrum there.

    Attributes
    ----------
    directions : ndarray, shape (n_unknowns, n_directions)
        Directions, or azimuths and elevations, rad: the arguments of `steering_vector`.
    """

    directions: Float

    @property
    def doa(self) -> Float:
        """Directions, of the sphere the azimuths, rad, (n_directions,)."""
        return np.asarray(self.directions[0])

    @abstractmethod
    def peaks(
        self,
        power: Float,
        level: Level,
        power_at: Callable[[Float], Float],
        n: int,
        joined: bool = False,
    ) -> tuple[Float, Float]:
        """Return the directions of the peaks of a spectrum between grid points, highest first.

        Parameters
        ----------
        power : ndarray, shape (n_directions,)
            Spectrum on the grid.
        level : function
            Level whose peaks are parabolas, of one angle.
        power_at : function
            Spectrum at directions (n_unknowns, n), rad; on the sphere.
        n : int
            Largest number of peaks.
        joined : bool
            True if the ends of a line are one direction.

        Returns
        -------
        directions : ndarray, shape (n_unknowns, n_peaks)
            Directions, rad.
        power : ndarray, shape (n_peaks,)
            Powers: at the nearest grid points, on the sphere at the directions.
        """


@dataclass(frozen=True, eq=False)
class AngleGrid(ScanGrid):
    """Equally spaced directions of a line, or on the circle.

    Parameters
    ----------
    directions : ndarray, shape (1, n_directions)
        Directions, rad.
    circular : bool
        True if the first direction follows the last.

    Examples
    --------
    >>> grid = AngleGrid(np.arange(4.0)[None], circular=False)
    >>> grid.peaks(np.exp([3.0, 4.0, 4.0, 3.0]), log_level, np.zeros_like, 1)[0]
    array([[1.5]])
    """

    directions: Float
    circular: bool

    def peaks(
        self,
        power: Float,
        level: Level,
        power_at: Callable[[Float], Float],
        n: int,
        joined: bool = False,
    ) -> tuple[Float, Float]:
        """Return the vertices of parabolas through the peaks and their neighbours."""
        index = find_peaks(power, circular=self.circular, joined=joined)[:n]
        return parabolic_peak(self.directions[0], level(power), index)[None], power[index]


@dataclass(frozen=True, eq=False)
class SphereGrid(ScanGrid):
    """Evenly spread directions on the sphere, or on the half above a plane.

    A spectrum on the half is even about the plane: neighbours of directions at its edge are mirror
    images of others.

    Parameters
    ----------
    points : ndarray, shape (n_directions, 3)
        Unit vectors.
    normal : ndarray, shape (3,), or None
        Unit vector on the side of the half that is scanned; None for the whole sphere.

    Examples
    --------
    >>> grid = SphereGrid(fibonacci_sphere(2000), None)
    >>> def power_at(directions):
    ...     return np.cos(directions[0] - 0.5) * np.cos(directions[1]) + np.sin(directions[1])
    >>> power = power_at(grid.directions)
    >>> np.rad2deg(grid.peaks(power, log_level, power_at, 1)[0]).round(0).T
    array([[29., 45.]])
    """

    points: Float
    normal: Float | None

    @cached_property
    def directions(self) -> Float:  # type: ignore[override]  # read-only, as the field of others
        """Azimuths and elevations, rad, (2, n_directions)."""
        return np.stack(azimuth_elevation(self.points))

    @cached_property
    def step(self) -> float:
        """Mean distance of neighbours, rad."""
        area = 4 * np.pi if self.normal is None else 2 * np.pi
        return float(np.sqrt(area / len(self.points)))

    @cached_property
    def neighbours(self) -> Int:
        """Indices of the nearest directions, (8, n_directions)."""
        from scipy.spatial import cKDTree

        points, index = self.points, np.arange(len(self.points))
        if self.normal is not None:
            edge = np.flatnonzero(points @ self.normal < 3 * self.step)
            index = np.concatenate([index, edge])
            mirrored = points[edge] - 2 * (points[edge] @ self.normal)[:, None] * self.normal
            points = np.concatenate([points, mirrored])
        nearest = cKDTree(points).query(self.points, N_NEIGHBOURS + 1)[1]
        return np.ascontiguousarray(index[nearest[:, 1:]].T)

    def peaks(
        self,
        power: Float,
        level: Level,
        power_at: Callable[[Float], Float],
        n: int,
        joined: bool = False,
    ) -> tuple[Float, Float]:
        """Return the highest points of finer and finer stencils about the peaks of the grid."""
        index = self.local_maxima(power)[: 2 * n + 4]
        u, value = self.points[index], power[index]
        rows, step = np.arange(len(index)), np.full((len(index), 1, 1), self.step / 2)
        stencils = self._stencils(index)
        for _ in range(N_STENCILS if len(index) else 0):
            candidates = self._on_grid_side(u[:, None] + step * stencils)
            powers = power_at(np.stack(azimuth_elevation(candidates.reshape(-1, 3))))
            powers = powers.reshape(len(index), -1)
            best = powers.argmax(axis=1)
            highest = powers[rows, best]
            rises = highest > value
            u = np.where(rises[:, None], candidates[rows, best], u)
            value = np.where(rises, highest, value)
            step = np.where(rises[:, None, None], step, step / 2)
        order = np.argsort(-value, kind="stable")
        u, value = u[order], value[order]
        # two searches may meet
        is_new = ~np.tril(u @ u.T > np.cos(self.step / 2), -1).any(axis=1)
        return np.stack(azimuth_elevation(u[is_new][:n])), value[is_new][:n]

    def local_maxima(self, power: Float) -> Int:
        """Return the indices of the local maxima among 8 neighbours, highest first.

        Of equal ones the first is taken.
        """
        around = power[self.neighbours]
        index = np.flatnonzero(power >= around.max(axis=0))
        around, value = around[:, index], power[index]
        is_second = ((around == value) & (self.neighbours[:, index] < index)).any(axis=0)
        rises = value > around.min(axis=0) + MIN_RISE * power.max()
        index = index[rises & ~is_second]
        return np.asarray(index[np.argsort(-power[index], kind="stable")])

    def _stencils(self, index: Int) -> Float:
        """Return 8 displacements about each of some directions, (len(index), 8, 3)."""
        azimuth, elevation = self.directions[:, index]
        east = np.stack([-np.sin(azimuth), np.cos(azimuth), 0 * azimuth], axis=-1)
        north = -np.sin(elevation)[:, None] * self.points[index]
        north[:, 2] += 1.0
        north /= np.maximum(np.cos(elevation), TINY)[:, None]
        return STENCIL[:, :1] * east[:, None] + STENCIL[:, 1:] * north[:, None]

    def _on_grid_side(self, v: Float) -> Float:
        """Return vectors (..., 3) of length one, those behind the plane mirrored."""
        v = v / np.sqrt((v * v).sum(axis=-1, keepdims=True))
        if self.normal is not None:
            v -= 2 * np.minimum(v @ self.normal, 0.0)[..., None] * self.normal
        return np.asarray(v)


def number_of_directions(n: int | None) -> int | None:
    """Return a number of scan directions that is given, or None for the default.

    Examples
    --------
    >>> number_of_directions(None), number_of_directions(90)
    (None, 90)
    """
    return None if n is None else count("n_directions", n, 3, MAX_DIRECTIONS)


@lru_cache(maxsize=16)  # models are immutable
def scan_grid(model: ArraySnapshot, n: int | None = None) -> ScanGrid:
    """Return the grid of n scan directions of a model, cached and read-only.

    Parameters
    ----------
    model : ArraySnapshot
        Decides between a line, the circle, the sphere and a half of it.
    n : int, optional
        Number of directions. If None, 361 of one angle; on the sphere 10313, and 5157 on a half of
        it, which is one in 2 by 2 degrees.

    Returns
    -------
    ScanGrid

    Raises
    ------
    ValueError
        If the number is too small or too large.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> scan_grid(ArraySnapshot(SensorArray.uca(5, 0.4), wavelength=1.0), 90).directions.shape
    (1, 90)
    """
    if model.unknowns == "azimuth":
        doa = scan_directions(model.array, n or DEFAULT_DIRECTIONS)
        grid: ScanGrid = AngleGrid(doa[None], model.array.dim > 1)
    else:
        area = 2 * np.pi if model.half_space else 4 * np.pi
        n = round(area / DEFAULT_STEP**2) if n is None else n
        n = count("n_directions", n, MIN_SPHERE_DIRECTIONS, MAX_DIRECTIONS)
        points, normal = fibonacci_sphere(n, upper=model.half_space), None
        if model.half_space:
            frame = plane_axes(model.array.positions - model.waves.centre)
            points, normal = points @ frame, frame[2]
        grid = SphereGrid(points, normal)
    grid.directions.setflags(write=False)
    return grid
