"""Scan grid of a measurement model."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
from arrivals.trackers.beamforming.scan_grid import AngleGrid, ScanGrid
from arrivals.trackers.beamforming.spectrum import scan_directions
from arrivals.trackers.beamforming.sphere_grid import SphereGrid, half_space_normal
from arrivals.validation import count

MAX_DIRECTIONS = 100_000
DEFAULT_DIRECTIONS = 361  # of one angle; every half degree of a line
DEFAULT_STEP = np.deg2rad(2.0)  # on the sphere
MIN_SPHERE_DIRECTIONS = 50


def number_of_directions(n: int | None) -> int | None:
    """Return a number of scan directions that is given, or None for the default.

    Examples
    --------
    >>> number_of_directions(None), number_of_directions(90)
    (None, 90)
    """
    return None if n is None else count("n_directions", n, 3, MAX_DIRECTIONS)


def n_sphere_directions(step: float, half: bool) -> int:
    """Return how many directions cover the sphere, or a half, at a mean distance, rad.

    Examples
    --------
    >>> n_sphere_directions(np.deg2rad(2.0), half=True)
    5157
    """
    return round((2 if half else 4) * np.pi / step**2)


@lru_cache(maxsize=8)
def sphere_grid(n: int, normal: tuple[float, ...] | None) -> SphereGrid:
    """Return n even directions on the sphere, or on the half above a plane, cached.

    Examples
    --------
    >>> sphere_grid(100, (0.0, 1.0, 0.0)).points.min(axis=0).round(1) + 0
    array([-1.,  0., -1.])
    """
    if normal is None:
        return SphereGrid(fibonacci_sphere(n), None)
    up = np.array(normal)
    first = np.eye(3)[int(np.abs(up).argmin())]
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    frame = np.stack([first, np.cross(up, first), up])
    return SphereGrid(fibonacci_sphere(n, upper=True) @ frame, up)


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
        normal = half_space_normal(model)
        if n is None:
            n = n_sphere_directions(DEFAULT_STEP, normal is not None)
        n = count("n_directions", n, MIN_SPHERE_DIRECTIONS, MAX_DIRECTIONS)
        grid = sphere_grid(n, None if normal is None else tuple(normal.tolist()))
    grid.directions.setflags(write=False)
    return grid
