"""Array responses: Fourier series of an angle, and functions of points of two unknowns."""

from arrivals.measurement_models.manifolds.fourier import FourierManifold, fourier_manifold
from arrivals.measurement_models.manifolds.manifold import (
    AngleManifold,
    CandidatePoints,
    Manifold,
    PointManifold,
    Reference,
)
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold, grid_line

__all__ = [
    "Manifold",
    "AngleManifold",
    "PointManifold",
    "CandidatePoints",
    "Reference",
    "UniformLineManifold",
    "grid_line",
    "FourierManifold",
    "fourier_manifold",
    "ArrayManifold",
]
