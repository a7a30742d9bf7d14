"""Symmetric matrices of one or two rows as their upper triangles, (..., d(d+1)/2, L)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from arrivals.typing import Float, Int

PLACES = {1: np.array([[0]]), 2: np.array([[0, 1], [1, 2]])}  # of the entries ij, by d
MIN_INDEPENDENCE = 1e-14  # one minus the square of a correlation
PAIRS = {1: ((0, 0),), 2: ((0, 0), (0, 1), (1, 1))}  # row and column of each entry, by d
IDENTITIES = {1: np.ones((1, 1)), 2: np.array([[1.0], [0.0], [1.0]])}
SIZES = {1: 1, 3: 2}  # rows of a matrix, by the length of its triangle


def places(d: int) -> Int:
    """Return where the entries ij of a matrix are in its triangle, (d, d)."""
    return PLACES[d]


def stacked(*rows: Float) -> Float:
    """Return arrays (..., L) of one shape as the rows of one: `np.stack`, three times as fast.

    Examples
    --------
    >>> stacked(np.zeros(3), np.ones(3))
    array([[0., 0., 0.],
           [1., 1., 1.]])
    """
    whole = np.empty((*rows[0].shape[:-1], len(rows), rows[0].shape[-1]))
    for i, row in enumerate(rows):
        whole[..., i, :] = row
    return whole


def identity(d: int) -> Float:
    """Return the triangle of the unit matrix, (d(d+1)/2, 1).

    Examples
    --------
    >>> identity(2).ravel()
    array([1., 0., 1.])
    """
    return IDENTITIES[d]


def full(C: Float) -> Float:
    """Return the matrices (..., d, d, L) of triangles."""
    return np.asarray(C[..., places(SIZES[C.shape[-2]]), :])


def triangle(C: Float) -> Float:
    """Return the triangles of matrices (..., d, d, L)."""
    return stacked(*(C[..., i, j, :] for i, j in PAIRS[C.shape[-2]]))


def log_det(C: Float) -> Float:
    """Return ln det, (..., L).

    Examples
    --------
    >>> np.exp(log_det(np.array([[2.0], [1.0], [3.0]]))).round(6)
    array([5.])
    """
    return np.asarray(np.log(C[..., 0, :] if C.shape[-2] == 1 else determinant(C)))


def determinant(C: Float) -> Float:
    """Return the determinants of positive definite matrices of two rows, (..., L).

    The square of a correlation counts as at most 1 - 1e-14: beyond it rounding decides.
    """
    product = C[..., 0, :] * C[..., 2, :]
    return np.maximum(product - C[..., 1, :] ** 2, MIN_INDEPENDENCE * product)


def inverse(C: Float) -> Float:
    """Return the inverses.

    Examples
    --------
    >>> inverse(np.array([[2.0], [1.0], [3.0]])).ravel()
    array([ 0.6, -0.2,  0.4])
    """
    if C.shape[-2] == 1:
        return np.asarray(1 / C)
    return np.asarray(
        stacked(C[..., 2, :], -C[..., 1, :], C[..., 0, :]) / determinant(C)[..., None, :]
    )


def trace_of_product(C: Float, S: Float) -> Float:
    """Return tr C S, (..., L)."""
    if C.shape[-2] == 1:
        return np.asarray((C * S)[..., 0, :])
    return np.asarray(
        C[..., 0, :] * S[..., 0, :] + C[..., 2, :] * S[..., 2, :]
        + 2 * C[..., 1, :] * S[..., 1, :]
    )  # fmt: skip


def times(C: Float, v: Float) -> Float:
    """Return the products C v with vectors (..., d, L)."""
    if C.shape[-2] == 1:
        return np.asarray(C * v)
    first = C[..., 0, :] * v[..., 0, :] + C[..., 1, :] * v[..., 1, :]
    second = C[..., 1, :] * v[..., 0, :] + C[..., 2, :] * v[..., 1, :]
    return stacked(first, second)


def dot(u: Float, v: Float) -> Float:
    """Return the products u·v of vectors (..., d, L): additions are faster than a sum.

    Examples
    --------
    >>> dot(np.array([[2.0], [3.0]]), np.array([[4.0], [1.0]]))
    array([11.])
    """
    if u.shape[-2] == 1:
        return np.asarray((u * v)[..., 0, :])
    return np.asarray(u[..., 0, :] * v[..., 0, :] + u[..., 1, :] * v[..., 1, :])


def congruent(J: Float, C: Float) -> Float:
    """Return Jᵀ C J of matrices J (..., d, d, L).

    Examples
    --------
    >>> turn = np.array([[0.0, -1.0], [1.0, 0.0]])[:, :, None]
    >>> congruent(turn, np.array([[2.0], [1.0], [3.0]])).ravel()
    array([ 3., -1.,  2.])
    """
    if C.shape[-2] == 1:
        return np.asarray(J[..., 0, :] ** 2 * C)
    return triangle(np.einsum("...kil,...kml,...mjl->...ijl", J, full(C), J))


def clamped_inverse(C: Float, smallest: float) -> Float:
    """Return the inverses with the eigenvalues of C raised to `smallest`.

    Examples
    --------
    >>> clamped_inverse(np.array([[2.0], [0.0], [0.1]]), 1.0).ravel() + 0
    array([0.5, 0. , 1. ])
    """
    if C.shape[-2] == 1:
        return np.asarray(1 / np.maximum(C, smallest))
    return _of_eigenvalues(C, lambda each: 1 / np.maximum(each, smallest))


def clamped(C: Float, smallest: float) -> Float:
    """Return the matrices with their eigenvalues raised to `smallest`."""
    if C.shape[-2] == 1:
        return np.maximum(C, smallest)
    return _of_eigenvalues(C, lambda each: np.maximum(each, smallest))


def limited(C: Float, largest: float) -> Float:
    """Return the matrices with their eigenvalues lowered to `largest`."""
    if C.shape[-2] == 1:
        return np.minimum(C, largest)
    return _of_eigenvalues(C, lambda each: np.minimum(each, largest))


def _of_eigenvalues(C: Float, function: Callable[[Float], Float]) -> Float:
    """Return matrices of two rows with a function of their eigenvalues, in closed form."""
    middle = (C[..., 0, :] + C[..., 2, :]) / 2
    half, off = (C[..., 0, :] - C[..., 2, :]) / 2, C[..., 1, :]
    radius = np.hypot(half, off)
    high, low = function(middle + radius), function(middle - radius)
    mean, slope = (high + low) / 2, (high - low) / 2 / np.where(radius > 0, radius, 1.0)
    return stacked(mean + slope * half, slope * off, mean - slope * half)


def between(old: Float, new: Float, share: float) -> Float:
    """Return matrices on the way from old to new ones: of one row by its logarithm."""
    if share == 1:
        return new
    if old.shape[-2] == 1:
        return np.asarray(old * (new / np.where(old > 0, old, new)) ** share)
    return np.asarray((1 - share) * old + share * new)
