"""Linear algebra of small dense matrices, with any leading (batch) axes.

Single matrices take paths that cost a fraction of numpy's general ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Float

HALF = np.array(0.5)  # a product with it costs less than one with a float
MIN_RELATIVE_PIVOT = 1e-4  # of the variance: below, factors are LAPACK's, with jitter
JITTER = 1e-9  # of the mean variance, added to a covariance that has no Cholesky factor

Inverse = Callable[[Float], Any]
Product = Callable[[Float, Float], Float]


def apply(A: Float, x: Float) -> Float:
    """Return A x for matrices (..., m, n) and vectors (..., n).

    Examples
    --------
    >>> apply(np.array([[1.0, 1.0]]), np.array([[1.0, 2.0], [3.0, 4.0]]))
    array([[3.],
           [7.]])
    """
    if x.ndim == 1:
        product: Float = A.dot(x)
        return product
    return np.asarray(x @ A.T if A.ndim == 2 else (A @ x[..., None])[..., 0])


def inner(a: Float, b: Float) -> Float:
    """Return aᵀ b of vectors (..., n)."""
    product: Float = a.dot(b) if a.ndim == 1 else (a[..., None, :] @ b[..., None])[..., 0, 0]
    return product


def multiplication(A: Float) -> Product:
    """Return the product for matrices (..., m, n) like A: dot takes a third of matmul's time."""
    return np.ndarray.dot if A.ndim == 2 else np.matmul


def transposed(A: Float) -> Float:
    """Return Aᵀ of matrices (..., m, n)."""
    return A.mT


def symmetric(A: Float) -> Float:
    """Return (A + Aᵀ)/2 of matrices (..., n, n)."""
    total: Float = A + A.mT
    total *= HALF
    return total


@lru_cache(maxsize=64)
def identity(n: int) -> Float:
    """Return the unit matrix (n, n): shared and read-only."""
    matrix = np.eye(n)
    matrix.setflags(write=False)
    return matrix


@cache
def lapack() -> Any:
    """Return scipy's LAPACK module: several times faster than numpy on a small matrix."""
    from scipy.linalg import lapack  # slow to import, so deferred to the first call

    return lapack


def cholesky(A: Float) -> tuple[Float, Float, int]:
    """Return covariances (..., n, n), their lower Cholesky factors, and how many needed jitter.

    Raises
    ------
    ValueError
        If a matrix is not finite or has an eigenvalue below minus the jitter.

    Examples
    --------
    >>> S, L, jittered = cholesky(np.ones((2, 2)))
    >>> jittered, np.allclose(L @ L.T, 1.0)
    (1, True)
    """
    if A.ndim == 2:
        L, failed = lapack().dpotrf(A, lower=True)
        return _add_jitter(A) if failed else (A, L, 0)
    try:
        return A, np.asarray(np.linalg.cholesky(A), np.float64), 0
    except np.linalg.LinAlgError:
        return _add_jitter(A)


def _add_jitter(A: Float) -> tuple[Float, Float, int]:
    n = A.shape[-1]
    if not np.isfinite(A).all():
        raise ValueError("covariance of the filter must be finite: x, P, Q or R has grown too far")
    size = np.trace(A, axis1=-2, axis2=-1) / n
    jitter = JITTER * np.where(size > 0, size, 1.0)
    lowest = np.linalg.eigvalsh(A)[..., 0]
    if (lowest < -jitter / 2).any():
        raise ValueError(
            "covariance of the filter must be positive semidefinite; got the eigenvalue "
            f"{lowest.min():.3g}: check P, Q and R"
        )
    weak = lowest < jitter / 2
    A = A + (weak * jitter)[..., None, None] * np.eye(n)
    return A, np.asarray(np.linalg.cholesky(A), np.float64), int(np.sum(weak))


def half_log_det(L: Float) -> float | Float:
    """Return log |L|, half of log |L Lᵀ|, of Cholesky factors (..., n, n).

    Examples
    --------
    >>> half_log_det(np.eye(2)), half_log_det(np.ones((3, 1, 1)))
    (0.0, array([0., 0., 0.]))
    """
    if L.ndim == 2:  # a third of numpy's time for a few numbers
        return sum(map(math.log, L.diagonal().tolist()))
    return np.asarray(np.log(L.diagonal(0, -2, -1)).sum(axis=-1))


def inverse(A: Float) -> Float:
    """Return A⁻¹ of matrices (..., n, n): the numbers of `numpy.linalg.inv`.

    Examples
    --------
    >>> inverse(np.array([[2.0, 0.0], [0.0, 4.0]]))
    array([[0.5 , 0.  ],
           [0.  , 0.25]])
    """
    if A.ndim > 2:
        return np.asarray(np.linalg.inv(A), np.float64)
    _, _, solution, failed = lapack().dgesv(A, identity(len(A)))
    if failed:
        raise ValueError("matrix to invert must not be singular: P, H or R has grown too far")
    return np.asarray(solution)


def inverse_and_log_det(
    S: Float, inv: Inverse = inverse
) -> tuple[Float, Float, float | Float, int]:
    """Return covariances (..., n, n), their inverses, ½ log |S|, and how many needed jitter.

    Raises
    ------
    ValueError
        As `cholesky` does.

    Examples
    --------
    >>> inverse_and_log_det(np.diag([2.0, 0.5]))[1:]
    (array([[ 0.5, -0. ],
           [-0. ,  2. ]]), 0.0, 0)
    """
    if S.shape == (2, 2) and inv is inverse:  # a third of the time, in plain numbers
        (a, _), (b, c) = S.tolist()
        # S = [1 0; f 1] diag(a, d) [1 f; 0 1],  f = b/a
        f = b / a if a > 0 else math.nan
        d = c - f * b
        if d > MIN_RELATIVE_PIVOT * c:
            cross = -f / d
            SI = np.array([[1 / a - f * cross, cross], [cross, 1 / d]])
            return S, SI, 0.5 * (math.log(a) + math.log(d)), 0
    S, L, jittered = cholesky(S)
    return S, inv(S), half_log_det(L), jittered


def inverse_2x2(A: Float) -> Float:
    """Return A⁻¹ of symmetric matrices (..., 2, 2), in closed form.

    Examples
    --------
    >>> inverse_2x2(np.array([[2.0, 1.0], [1.0, 1.0]]))
    array([[ 1., -1.],
           [-1.,  2.]])
    """
    a, b, c = A[..., 0, 0], A[..., 0, 1], A[..., 1, 1]
    return symmetric_2x2(c, -b, a) / (a * c - b * b)[..., None, None]


def symmetric_2x2(a: Float, b: Float, c: Float) -> Float:
    """Return matrices [[a, b], [b, c]], shape (..., 2, 2), of entries (...)."""
    A = np.empty((*np.shape(a), 2, 2))
    A[..., 0, 0], A[..., 0, 1], A[..., 1, 0], A[..., 1, 1] = a, b, b, c
    return A


def append_rows(factor: Float, *rows: Float) -> Float:
    """Return the triangular factor of a factor with more rows, (..., n, n).

    Examples
    --------
    >>> np.abs(append_rows(np.zeros((1, 1)), np.array([[3.0], [4.0]]))).round(12)
    array([[5.]])
    """
    stack = np.concatenate([factor, *rows], axis=-2)
    return np.asarray(np.linalg.qr(stack, mode="r"))


def solve_factor(factor: Float, n_coef: int) -> Float:
    """Return W = R⁻¹U of a triangular factor [R | U]: (..., n_coef, n_rhs)."""
    R, U = factor[..., :n_coef, :n_coef], factor[..., :n_coef, n_coef:]
    return np.asarray(np.linalg.solve(R, U))


def ridge_rows(weight: ArrayLike, target: Float) -> Float:
    """Return the rows √weight [I | target], (..., n_coef, n_coef + n_rhs).

    Parameters
    ----------
    weight : array_like, shape (..., n_coef)
        One number for each coefficient.
    target : ndarray, shape (..., n_coef, n_rhs)
        Solution without data.
    """
    n = target.shape[-2]
    root = np.sqrt(np.asarray(weight, dtype=np.float64))[..., None]
    rows = np.empty((*target.shape[:-1], n + target.shape[-1]))
    rows[..., :n], rows[..., n:] = root * np.eye(n), root * target
    return rows
