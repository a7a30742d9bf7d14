"""Amplitudes of plane waves from given directions, by least squares."""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.trackers.beamforming.block_scan import root_mean_amplitudes
from arrivals.typing import Complex, Float


def least_squares_amplitudes(A: Complex, z: Complex) -> Complex:
    """Return the least-squares amplitudes of plane waves in a snapshot.

    Sensors that are NaN are left out; equal steering vectors have equal amplitudes.

    Parameters
    ----------
    A : ndarray, shape (n_sources, n_sensors)
        Steering vectors.
    z : ndarray, shape (n_sensors,)
        Snapshot.

    Returns
    -------
    ndarray, shape (n_sources,)
        Complex amplitudes.

    Examples
    --------
    >>> A, z = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]]), np.array([5.0, 1.0, np.nan])
    >>> least_squares_amplitudes(A, z).real
    array([3., 2.])
    """
    valid = ~np.isnan(z)
    A, y = (A, z) if valid.all() else (A[:, valid], z[valid])
    G = A.conj() @ A.T
    G.flat[:: len(A) + 1] += 1e-12 * len(y)
    return np.linalg.solve(G, A.conj() @ y).astype(np.complex128)


def wave_amplitudes(model: ArraySnapshot, directions: Float, z: Complex) -> Complex:
    """Return amplitudes, or the root of the mean power over several bins and snapshots.

    Parameters
    ----------
    model : ArraySnapshot
        Model of the snapshots.
    directions : ndarray, shape (n_unknowns, n_sources)
        Directions, rad.
    z : ndarray, of the model's shape
        Snapshots of a step.

    Returns
    -------
    ndarray, shape (n_sources,)
        Least-squares amplitudes.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> model = ArraySnapshot(SensorArray.ula(5, 0.5), 1.0)
    >>> wave_amplitudes(model, np.array([[0.3]]), 2j * model.steering_vector(0.3)).round(6)
    array([0.+2.j])
    """
    if model.is_single:
        return least_squares_amplitudes(model.steering_vector(*directions), z)
    return root_mean_amplitudes(model, directions, model.with_all_axes(z))
