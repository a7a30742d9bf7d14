"""Manifolds of points on arrays of all kinds, with points and covariances for them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.manifolds.line_phase import fresnel_line, sine_line
from arrivals.measurement_models.manifolds.phase import direction_cosines
from arrivals.measurement_models.manifolds.spherical_line import spherical_line
from arrivals.measurement_models.manifolds.tangent_plane import tangent_planes
from arrivals.typing import Float

GRID = np.stack(np.meshgrid(*2 * [np.arange(4) * 0.5 - 0.75], indexing="ij"), -1).reshape(-1, 2)
SQUARE = SensorArray(GRID + np.array([3.0, -1.0]))
RANDOM = np.random.default_rng(1).normal(size=(6, 3)) * 0.4
TILTED = SensorArray(RANDOM[:, :2] @ np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]]) + 1.0)
SPACE = SensorArray(RANDOM + np.array([0.0, 2.0, 0.0]))
LINE = SensorArray(np.array([0.0, 0.4, 1.1, 2.0, 2.3, 3.1]) + 5.0)
WAVES = (1.0, 1.25)
MANIFOLDS: dict[str, Any] = {
    "sine": sine_line(PlaneWaves(LINE, WAVES)),
    "square": direction_cosines(PlaneWaves(SQUARE, (1.0,))),
    "tilted": direction_cosines(PlaneWaves(TILTED, WAVES)),
    "fresnel": fresnel_line(PlaneWaves(LINE, WAVES), 0.05),
    "spherical": spherical_line(PlaneWaves(LINE, WAVES), 0.3),
    "sphere": tangent_planes(PlaneWaves(SPACE, WAVES)),
}
every_manifold = pytest.mark.parametrize("m", MANIFOLDS.values(), ids=MANIFOLDS.keys())


def has_elevation(m: Any) -> bool:
    """Return True for directions on the sphere."""
    return bool(m.n_unknowns == 2 and m.direction(m.candidates().points).shape[0] == 3)


def second_unknown(m: Any, n: int = 4) -> Float:
    """Return elevations, rad, or distances, m, of `points`."""
    return np.linspace(0.3, 1.2, n) if has_elevation(m) else np.linspace(4.0, 20.0, n)


def points(m: Any, n: int = 4) -> Float:
    """Return n points from -1.1 to 1.0 rad, on the side of the normal of a tilted plane."""
    second = () if m.n_unknowns == 1 else (second_unknown(m, n),)
    return np.asarray(m.from_doa(azimuths(m, n), *second))


def azimuths(m: Any, n: int = 4) -> Float:
    """Return the directions of `points`, rad."""
    doa = np.linspace(-1.1, 1.0, n)
    return doa / 2 + 2.5 if m is MANIFOLDS["tilted"] else doa


def covariances(m: Any, n: int = 4) -> Float:
    """Return covariances of points as upper triangles."""
    if m.n_unknowns == 1:
        return np.array([[0.02, 0.03, 0.01, 0.025]])[:, :n]
    return np.tile([[0.02, 0.03], [0.006, -0.004], [0.03, 0.01]], (1, 2))[:, :n]


def steps(m: Any, i: int, size: float, n: int = 4) -> Float:
    """Return displacements of n points in the unknown i."""
    step = np.zeros((m.n_unknowns, n))
    step[i] = size
    return step
