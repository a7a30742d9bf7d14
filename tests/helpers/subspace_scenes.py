"""Arrays, snapshots and subspaces for the tests of the subspace methods."""

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers.subspace import Subspaces
from arrivals.typing import Complex

NAMES = ("music", "root_music", "esprit", "past")
LINE = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)
GAPS = ArraySnapshot(SensorArray.ula(9, 0.4, missing=[2, 5]), wavelength=1.0, noise=0.01)
CIRCLE = ArraySnapshot(SensorArray.uca(8, radius=0.6), wavelength=1.0, noise=0.01)


def incoherent(
    model: ArraySnapshot, doa: list[float], n: int = 60, seed: int = 0
) -> tuple[Complex, Complex]:
    """Return snapshots of sources with independent random phases, and their amplitudes."""
    rng = np.random.default_rng(seed)
    w = np.exp(2j * np.pi * rng.random((n, len(doa))))
    return model.simulate(np.tile(doa, (n, 1)), w, rng), w


def noiseless(model: ArraySnapshot, doa: list[float], n: int = 40) -> Complex:
    """Return snapshots of Gaussian sources without noise."""
    rng = np.random.default_rng(1)
    w = rng.standard_normal((n, len(doa), 2)) @ np.array([1, 1j])
    return model.wave(np.tile(doa, (n, 1)), w)


def subspaces_of(theta: list[float], grid_index: ArrayLike) -> Subspaces:
    """Return the subspaces of waves with electrical angles θ, without noise."""
    a = np.exp(1j * np.multiply.outer(grid_index, theta))
    Q = np.linalg.qr(a, mode="complete")[0]
    return Subspaces(Q[:, : len(theta)], Q[:, len(theta) :])
