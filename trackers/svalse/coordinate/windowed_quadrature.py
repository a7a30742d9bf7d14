"""Quadrature of a sharp density of one angle, in windows about its modes.

ln q(θ, s) = Re Σ c_si exp(jiθ) + ln p(θ, s), where p is much wider than the first term, and s is
the index of a second, discrete unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from arrivals.typing import Bool, Complex, Float, Int

LogPrior = Callable[[Int, Float], Float]  # ln p of indices s and angles θ, which broadcast
MAX_LOG_DROP = 30.0  # nats below the maximum; what lies lower is neglected
MAX_EDGE = -22.0  # nats relative to the maximum, at the edges of a window
MAX_WINDOWS = 24
HALF_WIDTH = 8.1  # of a window, standard deviations of its mode
OFFSETS = 0.45 * np.arange(-18, 19)  # points of a window, standard deviations of its mode


class Modes(NamedTuple):
    """Local maxima of a density, each an array of shape (n_modes,).

    Parameters
    ----------
    nuisance : ndarray of int
        Index of the second unknown.
    theta : ndarray
        Angles, rad, of each index in rising order.
    height : ndarray
        Re Σ c exp(jiθ).
    curvature : ndarray
        Negative second derivative of the height.
    """

    nuisance: Int
    theta: Float
    height: Float
    curvature: Float

    def select(self, keep: Bool) -> Modes:
        """Return the modes of a mask."""
        nuisance, theta, height, curvature = self
        return Modes(nuisance[keep], theta[keep], height[keep], curvature[keep])


class Windows(NamedTuple):
    """Points of a density in windows about its modes.

    Parameters
    ----------
    nuisance : ndarray of int, shape (n_windows,)
        Index of the second unknown.
    powers : ndarray, shape (n_windows, n_points, n)
        exp(jiθ), i = 0, 1, ...
    weight : ndarray, shape (n_windows, n_points)
        Probabilities, their sum 1.
    """

    nuisance: Int
    powers: Complex
    weight: Float


def find_modes(c: Complex, log_q: Float, within: float = MAX_LOG_DROP) -> Modes:
    """Return the maxima at most `within` nats below the top, refined by Newton's method.

    Parameters
    ----------
    c : ndarray, shape (n_nuisance, D + 1)
        Coefficients of the part of ln q that is sharp.
    log_q : ndarray, shape (n_nuisance, n_points)
        ln q at 2π i / n_points.
    within : float
    """
    periodic = np.concatenate([log_q[:, -1:], log_q, log_q[:, :1]], axis=1)
    left, right = periodic[:, :-2], periodic[:, 2:]
    # a peak between grid points may stand above both by an eighth of their neighbours' drop
    headroom = np.maximum(2 * log_q - left - right, 0)
    top = (log_q >= left) & (log_q > right) & (log_q + headroom >= log_q.max() - within)
    nuisance, index = np.nonzero(top)
    step = 2 * np.pi / log_q.shape[1]
    start = theta = np.asarray(index * step, dtype=np.float64)
    c, (i, derivatives) = c[nuisance], orders(c.shape[1])
    for _ in range(5):
        sums = (np.exp(np.multiply.outer(theta, i)) * c) @ derivatives
        height, slope, curvature = sums[:, 0].real, -sums[:, 1].imag, sums[:, 2].real
        newton = slope / np.where(curvature > 0, curvature, np.inf)
        theta = np.minimum(np.maximum(theta + newton, start - step), start + step)
    return Modes(nuisance, theta, height, curvature)


@lru_cache(maxsize=64)
def orders(n: int) -> tuple[Complex, Complex]:
    """Return j i, i = 0..n-1, and the powers i⁰, i¹, i² as columns."""
    i = np.arange(n, dtype=np.complex128)
    return 1j * i, np.stack([np.ones(n), i, i**2], axis=1)


def mode_grid_size(n_coefficients: int) -> int:
    """Return the points of a grid that shows all modes: eight for each harmonic, a power of two."""
    return 1 << (8 * n_coefficients - 1).bit_length()


def integrate_windows(
    c: Complex, log_q: Float, n_moments: int, log_prior: LogPrior | None = None
) -> Windows | None:
    """Integrate about each mode near the top: 37 points at 0.45 standard deviations.

    Returns None where windows overlap, or q has not died away at their edges.

    Parameters
    ----------
    c : ndarray, shape (n_nuisance, D + 1)
    log_q : ndarray, shape (n_nuisance, n_points)
        ln q on a grid of `mode_grid_size` points.
    n_moments : int
    log_prior : callable, optional
        ln p(s, θ), whose curvature is neglected; uniform if None.
    """
    modes = find_modes(c, log_q)
    height = modes.height
    if log_prior is not None:
        height = height + log_prior(modes.nuisance, modes.theta)
    modes = modes.select(height > height.max() - MAX_LOG_DROP)
    if len(modes.theta) > MAX_WINDOWS or not (modes.curvature > 0).all() or overlap(modes):
        return None
    std = 1 / np.sqrt(modes.curvature)
    theta = modes.theta[:, None] + std[:, None] * OFFSETS
    n = c.shape[1]
    powers = np.empty((*theta.shape, max(n_moments, n)), dtype=np.complex128)
    powers[..., 0], powers[..., 1:] = 1, np.exp(1j * theta)[..., None]
    np.cumprod(powers, axis=-1, out=powers)
    log_w = (powers[..., :n] @ c[modes.nuisance][..., None])[..., 0].real
    if log_prior is not None:
        log_w += log_prior(modes.nuisance[:, None], theta)
    log_w -= log_w.max()
    if log_w[:, [0, -1]].max() > MAX_EDGE:
        return None
    weight = std[:, None] * np.exp(log_w)
    return Windows(modes.nuisance, powers[..., :n_moments], weight / weight.sum())


def overlap(modes: Modes) -> bool:
    """Return True if windows of one value of the second unknown overlap."""
    if len(modes.theta) == 1:
        return False
    reach = HALF_WIDTH / np.sqrt(modes.curvature)
    gap = np.abs((modes.theta[:, None] - modes.theta + np.pi) % (2 * np.pi) - np.pi)
    near = gap < reach[:, None] + reach
    near &= modes.nuisance[:, None] == modes.nuisance
    return bool(np.count_nonzero(near) > len(modes.theta))
