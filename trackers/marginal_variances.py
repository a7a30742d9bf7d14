"""Marginal variances and covariances, and the factor for unknown noise."""

from __future__ import annotations

from functools import cache

import numpy as np

from arrivals.symmetric import limited
from arrivals.typing import Float

MIN_EIGENVALUE = 1e-3  # of the matrix scaled to a unit diagonal
MIN_FREEDOM = 2.0  # degrees of freedom of a t distribution below which the table ends
NORMAL_QUANTILES = (0.99445788, 1.95996398)  # at 84 and 97.5 %


def marginal_variances(N: Float, largest: float) -> Float:
    """Return the diagonal of N⁻¹, at most `largest`.

    Eigenvalues below `MIN_EIGENVALUE`, after scaling to a unit diagonal, are clipped: the scales
    of strong and weak sources differ by orders.

    Parameters
    ----------
    N : ndarray, shape (..., n, n)
        Information matrices, symmetric.
    largest : float
        Variance of an unknown that nothing is known of.

    Returns
    -------
    ndarray, shape (..., n)

    Examples
    --------
    >>> marginal_variances(np.array([[2.0, 1.0], [1.0, 2.0]]), largest=10.0).round(6)
    array([0.666667, 0.666667])
    """
    # R = N / (d d'),  d_l = √max(N_ll, 1/largest)
    d = np.sqrt(np.maximum(np.diagonal(N, axis1=-2, axis2=-1), 1 / largest))
    eigenvalues, V = np.linalg.eigh(N / (d[..., :, None] * d[..., None, :]))
    # v_l = Σ V_li² / λ_i / d_l²
    variance = (V**2 / np.maximum(eigenvalues, MIN_EIGENVALUE)[..., None, :]).sum(axis=-1) / d**2
    return np.asarray(np.minimum(variance, largest))


def marginal_covariances(N: Float, n_unknowns: int, largest: float) -> Float:
    """Return the blocks of N⁻¹ of each source, their eigenvalues at most `largest`.

    Parameters
    ----------
    N : ndarray, shape (..., d L, d L)
        Information matrices, symmetric; all first unknowns, then all second ones.
    n_unknowns : int
        Unknowns d of a source, 1 or 2.
    largest : float
        As in `marginal_variances`.

    Returns
    -------
    ndarray, shape (..., d(d+1)/2, L)
        Upper triangles.

    Examples
    --------
    >>> N = np.array([[2.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 2.0, 0.0],
    ...               [0.0, 0.0, 0.0, 1.0]])
    >>> marginal_covariances(N, 2, largest=10.0).round(4) + 0
    array([[ 0.6667,  1.    ],
           [-0.3333,  0.    ],
           [ 0.6667,  1.    ]])
    """
    if n_unknowns == 1:
        return marginal_variances(N, largest)[..., None, :]
    # R = N / (d d'),  d_l = √max(N_ll, 1/largest)
    d = np.sqrt(np.maximum(np.diagonal(N, axis1=-2, axis2=-1), 1 / largest))
    eigenvalues, V = np.linalg.eigh(N / (d[..., :, None] * d[..., None, :]))
    weight = 1 / np.maximum(eigenvalues, MIN_EIGENVALUE)[..., None, :]
    first, second = np.split(V / d[..., None], 2, axis=-2)
    pairs = ((first, first), (first, second), (second, second))
    # (N⁻¹)_kl = Σ V_ki V_li / λ_i / (d_k d_l)
    blocks = np.stack([(one * other * weight).sum(axis=-1) for one, other in pairs], axis=-2)
    return limited(blocks, largest)


def student_factor(freedom: Float) -> Float:
    """Return c(d), the variance of a normal density that covers as a t of d degrees does.

    The geometric mean of the squared ratios of the quantiles at 68 and 95 % coverage.

    Examples
    --------
    >>> student_factor(np.array([4.0, 8.0, 24.0])).round(3)
    array([1.616, 1.254, 1.075])
    """
    inverse, factor = student_table()
    return np.interp(1 / np.maximum(freedom, MIN_FREEDOM), inverse, factor)


@cache
def student_table() -> tuple[Float, Float]:
    """Return 1/d and c(d) of `student_factor` at 256 points."""
    from scipy.special import stdtrit

    inverse = np.linspace(0.0, 1 / MIN_FREEDOM, 256)
    d = 1 / np.maximum(inverse, 1e-12)
    ratios = [stdtrit(d, p) / z for p, z in zip((0.84, 0.975), NORMAL_QUANTILES, strict=True)]
    return inverse, np.asarray(ratios[0] * ratios[1])
