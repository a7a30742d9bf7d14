"""Maximum-likelihood initial directions of autoregressive sources on a grid."""

from __future__ import annotations

from functools import lru_cache
from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.autoregressive.companion_form import companion_layout, solve_lyapunov
from arrivals.motion_models.autoregressive.sources import AutoregressiveSources
from arrivals.trackers.autoregressive.settings import RegressionSettings
from arrivals.trackers.autoregressive.steady_state import StateSpace, fixed_gain, steady_state
from arrivals.trackers.gaussian.linalg import transposed
from arrivals.typing import Float
from arrivals.validation import shaped

GRID = np.deg2rad(np.arange(-70.0, 71.0, 10.0))
MAX_DISTANCE = 1.0  # wavelengths: the response of pairs farther out is too sharp for the grid
MIN_NOISE_RATIO = 0.05  # noise over the power of a source: the accuracy of the grid
MIN_SEPARATION = 1e-6  # rad
UNAMBIGUOUS = 0.5 * (1 + 1e-6)  # wavelengths from the centre: largest phase half a turn
CHUNK = 512  # hypotheses filtered at once


def direction_hypotheses(sources: AutoregressiveSources, grid: Float) -> Float:
    """Return all placements of the sources on a grid, (n, n_sources); equal sources in one order.

    Examples
    --------
    >>> direction_hypotheses(AutoregressiveSources([[0.5], [0.9]]), np.array([0.0, 1.0])).tolist()
    [[0.0, 1.0], [1.0, 0.0]]
    >>> direction_hypotheses(AutoregressiveSources([[0.5], [0.5]]), np.array([0.0, 1.0])).tolist()
    [[0.0, 1.0]]
    """
    index = np.array(list(permutations(range(len(grid)), sources.n_sources)))
    models = list(zip(sources.coefficients, np.array(sources.noise).tolist(), strict=True))
    for k, model in enumerate(models):
        if model in models[:k]:
            twin = max(i for i in range(k) if models[i] == model)
            index = index[index[:, twin] < index[:, k]]
    return np.asarray(grid[index])


def log_likelihood(
    y: Float, doa: Float, sources: AutoregressiveSources, manifold: ArrayManifold, noise: float
) -> Float:
    """Return the Kalman filter's log-likelihood of directions, up to a constant and a factor.

    Parameters
    ----------
    y : ndarray, shape (n_samples * n_parts, n_sensors)
        Transformed snapshots without missing data.
    doa : ndarray, shape (n, n_sources)
        Hypotheses, rad.
    sources : AutoregressiveSources
    manifold : ArrayManifold
    noise : float
        Variance of the noise of one sensor.

    Notes
    -----
    At the steady gain, from a state of zero.
    """
    layout, n_parts = companion_layout(sources.orders, lag_by_lag=True), sources.n_parts
    k = doa.shape[-1]
    F = layout.transition(sources.coefficient_matrix)
    Q = layout.process_noise(np.array(sources.noise, np.float64))
    near = np.r_[manifold.distances <= max(MAX_DISTANCE, manifold.distances[0])]
    rows = manifold.between(near, True, near)
    A: Float = transposed(manifold.real_steering(doa))[..., rows, :]
    y = y[:, rows]
    r = np.full((len(doa), 1, 1), noise * n_parts / 2)
    P = np.broadcast_to(solve_lyapunov(F, Q), (len(doa), *F.shape))
    K, P = steady_state(P, StateSpace(F, Q, A, r))
    # x(j) = (I - K H) F x(j-1) + K y(j)
    x = np.zeros((len(doa), n_parts, len(F)))
    X = fixed_gain(x, F - K @ (A @ F[:k]), y @ transposed(K), n_parts)
    # e = y - H F x(j-1), S = H (F P F' + Q) H' + r I
    before = np.concatenate([x, X[:, :-n_parts]], axis=-2)
    e = y - before @ transposed(A @ F[:k])
    S = A @ (F @ P @ F.T + Q)[..., :k, :k] @ transposed(A) + r * np.eye(A.shape[-2])
    # ln p = -Σ e' S^-1 e - n ln |S|
    white = np.asarray(np.linalg.solve(S, np.swapaxes(e, -1, -2)), dtype=np.float64)
    misfit = (e * transposed(white)).sum(axis=(-2, -1))
    return np.asarray(-misfit - len(y) / n_parts * np.linalg.slogdet(S)[1])


def acquire_directions(y: Float, sources: AutoregressiveSources, manifold: ArrayManifold) -> Float:
    """Return the maximum-likelihood directions of the sources, (n_sources,), rad.

    All placements on a grid of 10 degrees, then on one of 5 degrees around the best (4.7).

    Parameters
    ----------
    y : ndarray, shape (n_samples * n_parts, n_sensors)
        Transformed snapshots without missing data.
    sources : AutoregressiveSources
        Their models assign the labels.
    manifold : ArrayManifold
        Its noise counts as at least a twentieth of the power of the sources.
    """
    noise = max(manifold.noise, MIN_NOISE_RATIO * float(sources.power.mean()))

    def most_likely(doa: Float) -> Float:
        chunks = np.split(doa, range(CHUNK, len(doa), CHUNK))
        values = [log_likelihood(y, chunk, sources, manifold, noise) for chunk in chunks]
        return np.asarray(doa[np.argmax(np.concatenate(values))])

    doa = most_likely(direction_hypotheses(sources, GRID))
    steps = np.deg2rad([-5.0, 0.0, 5.0])
    around = np.stack(np.meshgrid(*[steps] * len(doa), indexing="ij"), axis=-1)
    return most_likely(doa + around.reshape(-1, len(doa)))


@lru_cache(maxsize=64)
def manifold_of(measurement: ArraySnapshot) -> ArrayManifold:
    """Return the real response of a symmetric line; raise a ValueError for any other array."""
    wavelength = measurement.plain_wavelength("ar_kalman_qrd_rls")
    if measurement.array.dim != 1:
        raise ValueError(
            "array must be a line, whose pairs have rows of cosines and sines; got sensors in "
            f"{measurement.array.dim} dimensions: svalse takes any array"
        )
    return ArrayManifold(measurement.array, wavelength, measurement.noise)


def check_form(regression: RegressionSettings, manifold: ArrayManifold) -> None:
    """Raise a ValueError if a literal form of the regression cannot resolve the array's pairs."""
    outer = float(manifold.distances[-1])
    if regression.pairs == "inner" or outer <= UNAMBIGUOUS:
        return
    for name, general in (("angles", "atan2"), ("pairs", "fit")):
        if (value := getattr(regression, name)) != general:
            raise ValueError(
                f"{name}={value!r} requires pairs at most half a wavelength from the centre; got "
                f"{outer:g} wavelengths: {name}={general!r} resolves them"
            )


def check_directions(doa: ArrayLike, n_sources: int) -> None:
    """Raise a ValueError if initial directions are out of range or coincide."""
    values = shaped("doa", doa, n_sources)
    if not (np.abs(values) <= np.pi / 2).all():
        raise ValueError(f"doa must lie within ±π/2 rad; got {values.tolist()}")
    separations = np.diff(np.sort(values))
    if len(separations) and separations.min() < MIN_SEPARATION:
        raise ValueError(
            f"doa must be at least {MIN_SEPARATION:g} rad apart for distinct sources; "
            f"got {values.tolist()}"
        )
