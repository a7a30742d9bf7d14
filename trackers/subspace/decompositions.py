"""Eigenvalues and least squares: of one matrix by LAPACK itself, of several by numpy."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.gaussian.linalg import lapack
from arrivals.typing import Complex, Float

MIN_RELATIVE_RANK = 1e-10  # of the diagonal of a triangular factor: below, by singular values


def largest_eigenvectors(R: Complex, n: int | None = None) -> tuple[Float, Complex]:
    """Return eigenvalues of covariances (..., m, m), falling, and eigenvectors.

    Parameters
    ----------
    R : ndarray, shape (..., m, m)
        Covariances.
    n : int, optional
        Number of the largest that are sufficient; all if None.

    Returns
    -------
    values : ndarray, shape (..., n) or (..., m)
        Eigenvalues.
    vectors : ndarray, shape (..., m, n) or (..., m, m)
        Eigenvectors.

    Examples
    --------
    >>> values, vectors = largest_eigenvectors(np.diag([1.0, 3.0, 2.0]), 1)
    >>> values, np.abs(vectors).ravel()
    (array([3.]), array([0., 1., 0.]))
    """
    failed = True
    if R.ndim == 2 and n is not None:  # half of the time of all
        size = len(R)
        values, vectors, *_, failed = lapack().zheevr(R, range="I", il=size - n + 1, iu=size)
        values, vectors = values[:n], vectors[:, :n]
    elif R.ndim == 2:
        values, vectors, failed = lapack().zheevd(R, lower=1)
    if failed:
        values, vectors = np.linalg.eigh(R)
    return values[..., ::-1], vectors[..., ::-1]


def eigenvalues(A: Complex) -> Complex:
    """Return the eigenvalues of matrices (..., n, n).

    Examples
    --------
    >>> np.sort(eigenvalues(np.array([[0.0, 4.0], [1.0, 0.0]]))).real
    array([-2.,  2.])
    """
    if A.ndim == 2:
        values, *_, failed = lapack().zgeev(A, compute_vl=0, compute_vr=0)
        if not failed:
            return np.asarray(values)
    return np.asarray(np.linalg.eigvals(A))


def least_squares(A: Complex, B: Complex) -> Complex:
    """Return A⁺B of matrices A (..., m, n) with m >= n.

    Examples
    --------
    >>> least_squares(np.array([[1.0], [1.0]]), np.array([[1.0], [3.0]])).real
    array([[2.]])
    """
    if A.ndim == 2:
        factor, solution, failed = lapack().zgels(A, B)
        diagonal = np.abs(factor.diagonal())
        if not failed and diagonal.min() > MIN_RELATIVE_RANK * diagonal.max():
            return np.asarray(solution[: A.shape[1]])
    return np.asarray(np.linalg.pinv(A) @ B)
