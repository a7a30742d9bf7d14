"""Directions on the sphere as unit vectors: conversion, distance, and an even grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float
from arrivals.validation import count

GOLDEN_TURN = np.pi * (1 + np.sqrt(5))  # rad, between neighbours of the grid


def unit_vectors(azimuth: ArrayLike, elevation: ArrayLike) -> Float:
    """Return unit vectors that point to azimuths and elevations, rad: (...) -> (..., 3).

    Parameters
    ----------
    azimuth : array_like, shape (...)
        Anticlockwise from the x axis, rad.
    elevation : array_like, shape (...)
        From the plane of x and y, rad.

    Returns
    -------
    ndarray, shape (..., 3)

    Examples
    --------
    >>> unit_vectors(np.pi / 2, [0.0, np.pi / 6]).round(3)
    array([[0.   , 1.   , 0.   ],
           [0.   , 0.866, 0.5  ]])
    """
    azimuth, elevation = np.broadcast_arrays(
        np.asarray(azimuth, dtype=np.float64), np.asarray(elevation, dtype=np.float64)
    )
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)


def azimuth_elevation(u: ArrayLike) -> tuple[Float, Float]:
    """Return azimuths in [-π, π) and elevations in [-π/2, π/2], rad, of vectors of any length.

    Parameters
    ----------
    u : array_like, shape (..., 3)
        Vectors. The azimuth of the poles is 0.

    Returns
    -------
    azimuth, elevation : ndarray, shape (...)

    Examples
    --------
    >>> azimuth, elevation = azimuth_elevation([0.0, 2.0, 2.0])
    >>> np.rad2deg([azimuth, elevation]).round(3)
    array([90., 45.])
    """
    x, y, z = np.moveaxis(np.asarray(u, dtype=np.float64), -1, 0)
    azimuth = np.arctan2(y, x)
    return np.where(azimuth == np.pi, -np.pi, azimuth), np.asarray(np.arctan2(z, np.hypot(x, y)))


def great_circle(u: ArrayLike, v: ArrayLike) -> Float:
    """Return the angle between vectors, rad, exact to rounding at any distance.

    Parameters
    ----------
    u, v : array_like, shape (..., 3)
        Vectors, of any length.

    Returns
    -------
    ndarray, shape (...)

    Examples
    --------
    >>> np.rad2deg(great_circle([1.0, 0.0, 0.0], [0.0, 0.0, 3.0])).round(3)
    np.float64(90.0)
    """
    u, v = np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64)
    across = np.linalg.norm(np.cross(u, v), axis=-1)  # arccos loses half of the digits near 0 and π
    return np.asarray(np.arctan2(across, np.sum(u * v, axis=-1)))


def fibonacci_sphere(n: int, upper: bool = False) -> Float:
    """Return points that cover the sphere evenly, along a spiral from the pole.

    Parameters
    ----------
    n : int
        Number of points.
    upper : bool
        True for the half of positive elevations alone.

    Returns
    -------
    ndarray, shape (n, 3)
        Unit vectors, the highest first. Neighbours are about √(4π/n) rad apart; √(2π/n) on a half.

    References
    ----------
    Swinbank and Purser, "Fibonacci grids: a novel approach to global modelling", Q. J. R.
    Meteorol. Soc. 132, 2006.

    Examples
    --------
    >>> fibonacci_sphere(100).mean(axis=0).round(2) + 0
    array([0., 0., 0.])
    >>> bool((fibonacci_sphere(100, upper=True)[:, 2] > 0).all())
    True
    """
    i = np.arange(count("n", n)) + 0.5
    z = 1 - (1 if upper else 2) * i / n
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(GOLDEN_TURN * i), flat * np.sin(GOLDEN_TURN * i), z], axis=-1)
