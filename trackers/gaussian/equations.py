"""Gaussian beliefs: how they move by a matrix, and what a linear measurement makes of them.

The kernels take arrays with any leading (batch) axes.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from arrivals.typing import Bool, Float

LOG_2PI = math.log(2 * math.pi)
JITTER = 1e-9  # of the mean variance, added to a covariance that has no Cholesky factor

Inverse = Callable[[Float], Any]
Product = Callable[[Float, Float], Float]


class Correction(NamedTuple):
    """A belief after a measurement, and what led there; the names are filterpy's."""

    x: Float
    P: Float
    y: Float
    K: Float
    S: Float
    SI: Float
    log_likelihood: Float
    square: Float  # yᵀ S⁻¹ y
    jittered: int


def apply(A: Float, x: Float) -> Float:
    """Return A x for matrices (..., m, n) and vectors (..., n).

    Examples
    --------
    >>> apply(np.array([[1.0, 1.0]]), np.array([[1.0, 2.0], [3.0, 4.0]]))
    array([[3.],
           [7.]])
    """
    return A.dot(x) if x.ndim == 1 else (A @ x[..., None])[..., 0]


def inner(a: Float, b: Float) -> Float:
    """Return aᵀ b of vectors (..., n)."""
    product: Float = a.dot(b) if a.ndim == 1 else (a[..., None, :] @ b[..., None])[..., 0, 0]
    return product


def multiplication(A: Float) -> Product:
    """Return the product that suits matrices like A: on single ones dot takes a third of matmul."""
    return np.ndarray.dot if A.ndim == 2 else np.matmul


def transposed(A: Float) -> Float:
    """Return Aᵀ of matrices (..., m, n)."""
    return A.T if A.ndim == 2 else A.swapaxes(-1, -2)


def symmetric(A: Float) -> Float:
    """Return (A + Aᵀ)/2."""
    total: Float = A + transposed(A)
    total *= 0.5
    return total


def half_log_det(L: Float) -> float | Float:
    """Return log |L|, half of log |L Lᵀ|, of Cholesky factors (..., n, n).

    Examples
    --------
    >>> half_log_det(np.eye(2)), half_log_det(np.ones((3, 1, 1)))
    (0.0, array([0., 0., 0.]))
    """
    diagonal = L.diagonal(0, -2, -1)
    if diagonal.ndim == 1:
        return sum(map(math.log, diagonal.tolist()))  # of a few numbers, a third of numpy's time
    return np.asarray(np.log(diagonal).sum(axis=-1))


@lru_cache(maxsize=64)
def identity(n: int) -> Float:
    """Return the unit matrix, shared and not to be written to."""
    one = np.eye(n)
    one.setflags(write=False)
    return one


@cache
def lapack() -> Any:
    """Return scipy's LAPACK, on a small matrix several times quicker than numpy's calls of it."""
    from scipy.linalg import lapack  # takes long to import, so not before it is called

    return lapack


def cholesky(A: Float) -> tuple[Float, Float, int]:
    """Return covariances, their lower Cholesky factors, and how many needed jitter.

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
        return _jittered(A) if failed else (A, L, 0)
    try:
        return A, np.asarray(np.linalg.cholesky(A), np.float64), 0
    except np.linalg.LinAlgError:
        return _jittered(A)


def _jittered(A: Float) -> tuple[Float, Float, int]:
    n = A.shape[-1]
    if not np.isfinite(A).all():
        raise ValueError("a covariance of the filter is not finite: x, P, Q or R has grown too far")
    size = np.trace(A, axis1=-2, axis2=-1) / n
    jitter = JITTER * np.where(size > 0, size, 1.0)
    lowest = np.linalg.eigvalsh(A)[..., 0]
    if (lowest < -jitter / 2).any():
        raise ValueError(
            f"a covariance of the filter has the negative eigenvalue {lowest.min():.3g}: "
            "P, Q or R is no covariance"
        )
    weak = lowest < jitter / 2
    A = A + (weak * jitter)[..., None, None] * np.eye(n)
    return A, np.asarray(np.linalg.cholesky(A), np.float64), int(np.sum(weak))


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
        raise np.linalg.LinAlgError("a matrix to invert is singular")
    return np.asarray(solution)


def predict_gaussian(P: Float, F: Float, Q: Float) -> Float:
    """Return F P Fᵀ + Q, the covariance after a step.

    Examples
    --------
    >>> predict_gaussian(np.eye(2), np.array([[1.0, 1.0], [0.0, 1.0]]), np.eye(2))
    array([[3., 1.],
           [1., 2.]])
    """
    dot = multiplication(P)
    return dot(dot(F, P), transposed(F)) + Q


def update_gaussian(
    x: Float,
    P: Float,
    y: Float,
    H: Float,
    R: Float,
    missing: Bool | None = None,
    inv: Inverse = inverse,
) -> Correction:
    """Correct Gaussian beliefs by the residuals of linear measurements, in Joseph's form.

    Parameters
    ----------
    x : ndarray, shape (..., n)
    P : ndarray, shape (..., n, n)
    y : ndarray, shape (..., m)
        Residuals z - z_pred.
    H : ndarray, shape (..., m, n)
    R : ndarray, shape (..., m, m)
    missing : ndarray of bool, shape (..., m), optional
        Entries of z that are left out. There y, K are 0 and S has a row of the unit matrix.
    inv : callable
        Inverts S.

    Returns
    -------
    Correction

    References
    ----------
    Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
    sec. 5.2.3 and (5.2.3-18).

    Examples
    --------
    Two equally good looks at a number, from variance 1 to 1/2:

    >>> one = np.eye(1)
    >>> found = update_gaussian(np.zeros(1), one, np.ones(1), one, one)
    >>> found.x, found.P, float(found.log_likelihood.round(4))
    (array([0.5]), array([[0.5]]), -1.5155)
    """
    dot, n_heard = multiplication(P), y.shape[-1]
    PHT = dot(P, transposed(H))
    S = dot(H, PHT) + R
    if missing is not None:
        y, PHT, S = _without(missing, y, PHT, S)
        n_heard = n_heard - missing.sum(axis=-1)
    S, L, jittered = cholesky(S)
    SI = inv(S)
    K = dot(PHT, SI)
    I_KH = identity(P.shape[-1]) - dot(K, H)
    P = symmetric(dot(dot(I_KH, P), transposed(I_KH)) + dot(dot(K, R), transposed(K)))
    square = inner(y, apply(SI, y))
    log_likelihood = -0.5 * (n_heard * LOG_2PI + square) - half_log_det(L)
    return Correction(x + apply(K, y), P, y, K, S, SI, log_likelihood, square, jittered)


def _without(missing: Bool, y: Float, PHT: Float, S: Float) -> tuple[Float, Float, Float]:
    """Return residual, cross-covariance and S in which missing entries tell nothing."""
    either = missing[..., :, None] | missing[..., None, :]
    return (
        np.where(missing, 0.0, y),
        np.where(missing[..., None, :], 0.0, PHT),
        np.where(either, np.eye(y.shape[-1]), S),
    )


def likelihood(log_likelihood: float) -> float:
    """Return the exponential, at least the smallest positive float and never infinite.

    Examples
    --------
    >>> likelihood(0.0), likelihood(-1e6) > 0
    (1.0, True)
    """
    return max(math.exp(min(log_likelihood, 700.0)), sys.float_info.min)
