"""Array responses as Fourier series of an angle."""

from arrivals.measurement_models.manifolds.fourier import FourierManifold, fourier_manifold
from arrivals.measurement_models.manifolds.manifold import Manifold, Reference
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold, grid_line

__all__ = [
    "Manifold",
    "Reference",
    "UniformLineManifold",
    "grid_line",
    "FourierManifold",
    "fourier_manifold",
    "ArrayManifold",
]
