"""Paths of sources on a square map: at random speeds, or at rest where bearings cross falsely."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.motion_models import ConstantVelocity
from arrivals.typing import Bool, Float

N_CANDIDATES = 64  # paths drawn at once
SHRINKAGE = 0.999  # of the separation with each rejected path
TRIES_AT_FULL_SPEED = 1000  # then speeds shrink, too, so that paths fit
START, INSIDE = (0.15, 0.85), (0.03, 0.97)  # of the size: initial positions, and whole paths
GHOST_INSIDE = (0.05, 0.95)
REST_STD = 0.0002  # of the size, a step, of sources at rest


class SquareMap(NamedTuple):
    """Square from the origin with its sources' motion.

    Parameters
    ----------
    size : float
        Side, m.
    speed : (float, float)
        Smallest and largest initial speed, m/s.
    motion : ConstantVelocity
        Motion of the sources, of steps of 1 s.
    """

    size: float
    speed: tuple[float, float]
    motion: ConstantVelocity


def moving_paths(
    square: SquareMap, n_sources: int, n_steps: int, separation: float, rng: np.random.Generator
) -> Float:
    """Draw paths that stay on the map and apart from each other, (n_steps, n_sources, 2), m.

    Parameters
    ----------
    square : SquareMap
        The map.
    n_sources, n_steps : int
        Numbers of sources and steps.
    separation : float
        Smallest distance of two sources at any time, of the size; it shrinks by 0.1 % with each
        rejected path.
    rng : numpy.random.Generator
        Source of random numbers.

    Examples
    --------
    >>> square = SquareMap(1000.0, (4.0, 12.0), ConstantVelocity(0.05))
    >>> paths = moving_paths(square, 2, 60, 0.12, np.random.default_rng(0))
    >>> paths.shape, bool(np.linalg.norm(paths[:, 0] - paths[:, 1], axis=1).min() > 110)
    ((60, 2, 2), True)
    """
    low, high = np.multiply(INSIDE, square.size)
    found: list[Float] = []
    n_tries = 0
    while len(found) < n_sources:
        tries = n_tries + 1 + np.arange(N_CANDIDATES)
        slower = SHRINKAGE ** np.maximum(tries - TRIES_AT_FULL_SPEED, 0)
        paths = _candidates(square, slower, n_steps, rng)
        fits: Bool = ((paths > low) & (paths < high)).all(axis=(1, 2))
        least = separation * square.size * SHRINKAGE**tries
        for other in found:
            apart = np.linalg.norm(paths - other, axis=-1).min(axis=1)
            fits &= apart > least
        first = int(fits.argmax())
        n_tries += first + 1 if fits[first] else N_CANDIDATES
        if fits[first]:
            found.append(paths[first])
    return np.stack(found, axis=1)


def _candidates(square: SquareMap, factor: Float, n_steps: int, rng: np.random.Generator) -> Float:
    """Draw paths, (n, n_steps, 2), of speeds times a factor (n,)."""
    n = len(factor)
    start = rng.uniform(*START, (n, 1, 2)) * square.size
    speed, phi = rng.uniform(*square.speed, n) * factor, rng.uniform(0, 2 * np.pi, n)
    velocity = (speed[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1))[:, None]
    factors = np.linalg.cholesky(square.motion.Q())
    noise = rng.standard_normal((n, n_steps - 1, 4)) @ factors.T  # of x, vx, y, vy
    v = np.concatenate([velocity, velocity + np.cumsum(noise[..., 1::2], axis=1)], axis=1)
    steps = v[:, :-1] + noise[..., ::2]
    return np.asarray(start + np.cumsum(np.pad(steps, ((0, 0), (1, 0), (0, 0))), axis=1))


def activity(n_sources: int, n_steps: int, rng: np.random.Generator) -> Bool:
    """Draw the steps in which sources are active, (n_steps, n_sources).

    Of 60 steps, the second source ends after 38 to 51, the third begins after 8 to 19, the fourth
    is active from 15 to 44; the others are always. Other numbers of steps are in proportion.

    Examples
    --------
    >>> activity(4, 60, np.random.default_rng(0))[[0, 30, 59]].astype(int)
    array([[1, 1, 0, 0],
           [1, 1, 1, 1],
           [1, 0, 1, 0]])
    """
    t, unit = np.arange(n_steps), n_steps / 60
    end, begin = rng.integers(38, 52), rng.integers(8, 20)
    on = np.ones((n_steps, max(n_sources, 4)), dtype=np.bool_)
    on[:, 1] = t < round(end * unit)
    on[:, 2] = t >= round(begin * unit)
    on[:, 3] = (t >= round(15 * unit)) & (t < round(45 * unit))
    return on[:, :n_sources]


def ghost_paths(
    square: SquareMap, positions: Float, n_steps: int, separation: float, rng: np.random.Generator
) -> Float:
    """Draw sources at rest that have their bearings from one station each through one point.

    There bearings of all those stations cross, as those of a source would.

    Parameters
    ----------
    square : SquareMap
        The map.
    positions : ndarray, shape (n_sources, 2)
        Positions of the stations, one for each source, m.
    n_steps : int
        Number of steps, 0.02 % of the size each.
    separation : float
        Smallest initial distance of two sources, of the size; it shrinks by 0.1 % with each
        rejected draw.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    ndarray, shape (n_steps, n_sources, 2)
        m.
    """
    n, size = len(positions), square.size
    low, high = np.multiply(GHOST_INSIDE, size)
    i, j = np.triu_indices(n, 1)
    least = separation * size
    while True:
        crossing = rng.uniform(0.35, 0.65, 2) * size
        nearer, farther = rng.uniform(0.45, 0.8, n), rng.uniform(1.25, 1.6, n)
        share = np.where(rng.random(n) < 0.5, nearer, farther)
        p = positions + share[:, None] * (crossing - positions)
        inside = (p > low).all() and (p < high).all()
        if inside and (np.linalg.norm(p[i] - p[j], axis=1) > least).all():
            break
        least *= SHRINKAGE
    steps = rng.normal(0.0, REST_STD * size, (n_steps, n, 2))
    return np.asarray(p + np.cumsum(steps, axis=0))
