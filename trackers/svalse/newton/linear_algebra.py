"""Inverses of positive definite matrices, and solutions; those of one problem by LAPACK alone."""

from __future__ import annotations

from functools import cache
from math import log
from typing import Any

import numpy as np

from arrivals.typing import Complex, Float

MIN_RELATIVE_CURVATURE = 1e-3  # smaller eigenvalues are clipped to this fraction of the largest


@cache
def lapack() -> Any:
    """Return scipy's interface of LAPACK: imported at the first use."""
    from scipy.linalg import lapack

    return lapack


@cache
def identity(n: int) -> Complex:
    """Return the unit matrix, (n, n), to be read only."""
    return np.eye(n, dtype=np.complex128, order="F")


def inverse_and_log_det(X: Complex) -> tuple[Complex, Float]:
    """Return the inverses of Hermitian matrices (B, F, L, L), and ln |det|, (B, F).

    Examples
    --------
    >>> inverse, log_det = inverse_and_log_det(np.diag([2.0, 4.0 + 0j])[None, None])
    >>> inverse[0, 0].diagonal().real, np.exp(log_det).round(6)
    (array([0.5 , 0.25]), array([[8.]]))
    """
    if X.shape[0] == X.shape[1] == 1:
        # in the order of LAPACK the transpose, whose inverse is that of the inverse
        L, inverse, error = lapack().zposv(X[0, 0].T, identity(X.shape[2]), lower=1)
        if not error:
            log_det = 2 * sum(map(log, L.diagonal().real.tolist()))
            return inverse.T[None, None], np.array([[log_det]])
    return np.asarray(np.linalg.inv(X), dtype=np.complex128), np.linalg.slogdet(X)[1]


def clipped_solution(H: Float, g: Float) -> Float:
    """Return H⁻¹ g, (B, n), with the eigenvalues of H made positive, none far below the largest.

    Examples
    --------
    >>> clipped_solution(np.diag([2.0, -4.0, 0.0])[None], np.ones((1, 3))).round(6)
    array([[  0.5 ,   0.25, 250.  ]])
    """
    if len(H) == 1 and (d := _plain_solution(H[0], g[0])) is not None:
        return d[None]
    eigenvalues, V = np.linalg.eigh(H)
    steep = np.abs(eigenvalues)
    steep = np.maximum(steep, MIN_RELATIVE_CURVATURE * steep.max(axis=1, keepdims=True) + 1e-300)
    d = V @ ((V.swapaxes(1, 2) @ g[:, :, None]) / steep[:, :, None])
    return np.asarray(d[:, :, 0])


def _plain_solution(H: Float, g: Float) -> Float | None:
    """Return H⁻¹ g of one problem; None if an eigenvalue may have to be clipped.

    None has if H minus the share of its trace, which bounds the largest, is positive definite.
    """
    smallest = MIN_RELATIVE_CURVATURE * sum(H.diagonal().tolist()) + 1e-300
    lowered = H.copy()
    lowered.reshape(-1)[:: len(g) + 1] -= smallest
    if not smallest > 0 or lapack().dpotrf(lowered, overwrite_a=1)[1]:
        return None
    solution: Float = lapack().dposv(H, g)[1]
    return solution
