"""Standard deviations of directions that are peaks on a grid."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.marginal_variances import marginal_variances, student_factor
from arrivals.typing import Complex, Float


def grid_deviations(
    A: Complex, D: Complex, Y: Complex, W: Complex, step: float, largest: float
) -> Float:
    """Return standard deviations of directions on a grid, rad, (n_sources,).

    The variance that the snapshots leave to a direction off the grid, all directions, amplitudes
    and the noise unknown, plus that of a uniform error of rounding to the grid.

    Parameters
    ----------
    A, D : ndarray, shape ([n_bins,] n_sensors, n_sources)
        Plane waves a(β) and their slopes da/dβ.
    Y : ndarray, shape ([n_bins,] n_sensors, n_snapshots)
        Snapshots.
    W : ndarray, shape ([n_bins,] n_sources, n_snapshots)
        Least-squares amplitudes of the waves.
    step : float
        Step of the grid, rad.
    largest : float
        Upper bound, the deviation of a uniform direction, rad.

    References
    ----------
    Stoica and Nehorai, "MUSIC, maximum likelihood, and Cramer-Rao bound", IEEE Trans. Acoust.,
    Speech, Signal Process. 37(5), 1989, (4.6), for J with known noise.

    Examples
    --------
    A wave without noise is known up to the rounding:

    >>> m = np.arange(4)[:, None]
    >>> one, slope = np.ones((4, 1), complex), 1j * np.pi * m
    >>> std = grid_deviations(one, slope, 2 * one, 2 * one[:1], step=0.01, largest=1.0)
    >>> (std / 0.01).round(3)
    array([0.289])
    """
    (M, N), K = Y.shape[-2:], W.shape[-2]
    n_bins = Y.size // (M * N)
    # σ² = 2 |Y - A W|² / d of d = 2 N (M - K) - K real degrees of freedom, K shared by the bins
    freedom = 2.0 * N * (M - K) - K / n_bins
    if freedom <= 0:
        return np.full(K, largest)
    Q = np.linalg.qr(A)[0]
    R = Y - A @ W
    noise = 2 * (R.real**2 + R.imag**2).sum(axis=(-2, -1)) / freedom
    power = (Y.real**2 + Y.imag**2).mean(axis=(-2, -1))
    noise = np.maximum(noise, np.finfo(float).eps * power)[..., None, None]
    QH, DH = (np.swapaxes(X.conj(), -1, -2) for X in (Q, D))
    # J_jk = 2/σ² Re[d_j' (I - Q Q') d_k Σ w_j* w_k], the sum over the bins
    J = 2 / noise * ((DH @ (D - Q @ (QH @ D))) * (W.conj() @ np.swapaxes(W, -1, -2))).real
    J = J if J.ndim == 2 else J.sum(axis=0)
    # v = c(d) (J⁻¹)_jj + Δ²/12
    factor = student_factor(np.array([n_bins * freedom]))
    variance = factor * marginal_variances(J, largest**2) + step**2 / 12
    return np.asarray(np.minimum(np.sqrt(variance), largest))
