"""Where autoregressive sources are at the start: the likeliest places on a grid."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.autoregressive import AutoregressiveSources
from arrivals.motion_models.companion_form import blocks, stationary
from arrivals.trackers.autoregressive.steady_state import fixed_gain, steady_state, transposed
from arrivals.typing import Float

GRID = np.deg2rad(np.arange(-70.0, 71.0, 10.0))
WIDEST = 1.0  # wavelengths: what lies farther out is too sharp for the grid
LEAST_NOISE = 0.05  # of a source's power: the grid is no better than that
CHUNK = 512


def placings(sources: AutoregressiveSources, grid: Float) -> Float:
    """Return all placings of the sources on a grid, (n, n_sources); equal sources in one order.

    Examples
    --------
    >>> placings(AutoregressiveSources([[0.5], [0.9]]), np.array([0.0, 1.0])).tolist()
    [[0.0, 1.0], [1.0, 0.0]]
    >>> placings(AutoregressiveSources([[0.5], [0.5]]), np.array([0.0, 1.0])).tolist()
    [[0.0, 1.0]]
    """
    found = np.array(list(permutations(range(len(grid)), sources.n_sources)))
    models = list(zip(sources.coefficients, np.array(sources.noise).tolist(), strict=True))
    for k, model in enumerate(models):
        if model in models[:k]:
            twin = max(i for i in range(k) if models[i] == model)
            found = found[found[:, twin] < found[:, k]]
    return np.asarray(grid[found])


def log_likelihood(
    y: Float, doa: Float, sources: AutoregressiveSources, manifold: ArrayManifold, noise: float
) -> Float:
    """Return the Kalman filter's log-likelihood of placings, up to a constant and a factor.

    Parameters
    ----------
    y : ndarray, shape (n_samples * parts, n_sensors)
        Transformed snapshots, without gaps.
    doa : ndarray, shape (n, n_sources)
        rad.
    sources : AutoregressiveSources
    manifold : ArrayManifold
    noise : float
        Variance of the noise of one sensor.

    Notes
    -----
    At the steady gain, from a state of zero.
    """
    places, parts, k = blocks(sources.orders, lag_by_lag=True), sources.n_parts, doa.shape[-1]
    F, Q = places.transition(sources.padded), places.drive(np.array(sources.noise, np.float64))
    near = np.r_[manifold.distances <= max(WIDEST, manifold.distances[0])]
    rows = np.r_[near, True, near]
    A: Float = transposed(manifold.real_steering(doa))[..., rows, :]
    y = y[:, rows]
    r = np.full((len(doa), 1, 1), noise * parts / 2)
    P = np.broadcast_to(stationary(F, Q), (len(doa), *F.shape))
    K, P = steady_state(P, F, Q, A, r)
    Phi = F - K @ (A @ F[:k])
    x = np.zeros((len(doa), parts, len(F)))
    X = fixed_gain(x, Phi, y @ transposed(K), parts)
    before = np.concatenate([x, X[:, :-parts]], axis=-2)
    e = y - before @ transposed(A @ F[:k])
    S = A @ (F @ P @ F.T + Q)[..., :k, :k] @ transposed(A) + r * np.eye(A.shape[-2])
    white = np.asarray(np.linalg.solve(S, np.swapaxes(e, -1, -2)), dtype=np.float64)
    misfit = (e * transposed(white)).sum(axis=(-2, -1))
    return np.asarray(-misfit - len(y) / parts * np.linalg.slogdet(S)[1])


def acquired(y: Float, sources: AutoregressiveSources, manifold: ArrayManifold) -> Float:
    """Return the likeliest directions of the sources, (n_sources,), rad.

    All placings on a grid of 10 degrees, then on one of 5 about the best.

    Parameters
    ----------
    y : ndarray, shape (n_samples * parts, n_sensors)
        Transformed snapshots, without gaps.
    sources : AutoregressiveSources
        What tells them apart: labels follow their models.
    manifold : ArrayManifold
        Its noise counts as a twentieth of the sources' power at least.
    """
    noise = max(manifold.noise, LEAST_NOISE * float(sources.power.mean()))

    def best(doa: Float) -> Float:
        chunks = np.split(doa, range(CHUNK, len(doa), CHUNK))
        found = [log_likelihood(y, chunk, sources, manifold, noise) for chunk in chunks]
        return np.asarray(doa[np.argmax(np.concatenate(found))])

    doa = best(placings(sources, GRID))
    steps = np.deg2rad([-5.0, 0.0, 5.0])
    around = np.stack(np.meshgrid(*[steps] * len(doa), indexing="ij"), axis=-1)
    return best(doa + around.reshape(-1, len(doa)))
