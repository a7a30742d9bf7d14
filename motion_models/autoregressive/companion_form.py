"""State layout and block companion matrices of several autoregressive sources."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from arrivals.typing import Bool, Float, Int


@dataclass(frozen=True, eq=False)
class CompanionLayout:
    """Indices of the lags in a state in which source k has p_k + 1 lags, the newest first.

    Attributes
    ----------
    orders : tuple of int
        p_k; P below is the largest.
    first : ndarray of int, shape (n_sources,)
        Indices of the current samples.
    lags : ndarray of int, shape (n_sources, P + 1)
        Indices of all lags; the last lag of a source is repeated in place of missing ones.
    used : ndarray of bool, shape (n_sources, P)
        Which coefficients a source has.
    regression_columns : ndarray of int, shape (n_sources, P + 1)
        `lags` with the current sample last: the regressors, then the target, of an AR regression.
    shift : ndarray, shape (dim, dim)
        Matrix that moves every lag on by one.
    permutation, inverse_permutation : ndarray of int, shape (dim,)
        Source-by-source index of each entry of the state, and the index of each such entry.
    """

    orders: tuple[int, ...]
    first: Int
    lags: Int
    used: Bool
    regression_columns: Int
    shift: Float
    permutation: Int
    inverse_permutation: Int

    @property
    def dim(self) -> int:
        """Number of entries of the state."""
        return len(self.shift)

    def transition(self, coefficients: Float) -> Float:
        """Return the block companion matrix F, (..., dim, dim), of a (..., n_sources, P)."""
        F = np.zeros((*coefficients.shape[:-2], self.dim, self.dim))
        F += self.shift
        source, lag = np.nonzero(self.used)
        F[..., self.first[source], self.lags[source, lag]] = coefficients[..., source, lag]
        return F

    def process_noise(self, variance: Float) -> Float:
        """Return Q of innovation variances q (..., n_sources): q_k at the current samples."""
        Q = np.zeros((*variance.shape[:-1], self.dim, self.dim))
        Q[..., self.first, self.first] = variance
        return Q


@lru_cache(maxsize=256)
def companion_layout(orders: tuple[int, ...], lag_by_lag: bool = False) -> CompanionLayout:
    """Return the layout of sources of the given orders, source by source or lag by lag.

    Examples
    --------
    >>> companion_layout((1, 2)).lags
    array([[0, 1, 1],
           [2, 3, 4]])
    >>> companion_layout((1, 2)).transition(np.array([[0.5, 0.0], [0.9, -0.2]]))
    array([[ 0.5,  0. ,  0. ,  0. ,  0. ],
           [ 1. ,  0. ,  0. ,  0. ,  0. ],
           [ 0. ,  0. ,  0.9, -0.2,  0. ],
           [ 0. ,  0. ,  1. ,  0. ,  0. ],
           [ 0. ,  0. ,  0. ,  1. ,  0. ]])
    """
    p = np.array(orders)[:, None]
    source, lag = np.nonzero(np.arange(p.max() + 1) <= p)  # of each entry, source by source
    by_lag = np.lexsort((source, lag))
    permutation = by_lag if lag_by_lag else np.arange(len(source))
    index = np.full((len(orders), int(p.max()) + 1), -1)
    index[source[permutation], lag[permutation]] = np.arange(len(source))
    lags = np.take_along_axis(index, np.minimum(np.arange(p.max() + 1), p), axis=1)
    used = index[:, 1:] >= 0
    shift = np.zeros((len(source), len(source)))
    shift[index[:, 1:][used], index[:, :-1][used]] = 1.0
    regression_columns = np.roll(lags, -1, axis=1)
    inverse_permutation = np.argsort(permutation)
    for array in (lags, used, regression_columns, shift, permutation, inverse_permutation):
        array.setflags(write=False)
    return CompanionLayout(
        orders, lags[:, 0], lags, used, regression_columns, shift, permutation, inverse_permutation
    )


def pole_radius(coefficients: Float) -> Float:
    """Return the largest modulus of the poles of AR models with coefficients (..., p).

    Examples
    --------
    >>> pole_radius(np.array([[0.5, 0.0], [0.0, -0.81]])).round(6)
    array([0.5, 0.9])
    """
    p = coefficients.shape[-1]
    companion = np.zeros((*coefficients.shape[:-1], p, p))
    companion += np.eye(p, k=-1)
    companion[..., 0, :] = coefficients
    return np.asarray(np.abs(np.linalg.eigvals(companion)).max(axis=-1))


def stabilised(coefficients: Float, limit: float = 0.995) -> Float:
    """Pull the poles of AR models (..., p) inside a radius: a_i <- a_i (limit / ρ)^i.

    Examples
    --------
    >>> stabilised(np.array([[2.0], [0.3]]))
    array([[0.995],
           [0.3  ]])
    """
    lags = np.arange(1, coefficients.shape[-1] + 1)
    if _all_inside(coefficients / limit**lags):
        return coefficients  # the usual case, without eigenvalues
    shrink = np.minimum(limit / np.maximum(pole_radius(coefficients), limit), 1.0)
    return np.asarray(coefficients * shrink[..., None] ** lags)


def _all_inside(a: Float) -> bool:
    """Return True if all poles lie within the unit circle: all reflection coefficients do."""
    while a.shape[-1]:
        last = a[..., -1:]
        if not (np.abs(last) < 1).all():
            return False
        # a_i <- (a_i + a_p a_(p-i)) / (1 - a_p²)
        a = (a[..., :-1] + last * a[..., -2::-1]) / (1 - last * last)
    return True


def solve_lyapunov(F: Float, Q: Float) -> Float:
    """Return P = F P Fᵀ + Q of a stable F, by doubling: half of the sum at once.

    Examples
    --------
    >>> solve_lyapunov(np.array([[0.5]]), np.array([[0.75]]))
    array([[1.]])
    """
    P, power = Q, F
    for _ in range(64):
        more = power @ P @ np.swapaxes(power, -1, -2)
        P, power = P + more, power @ power
        if np.abs(more).max() <= 1e-16 * np.abs(P).max():
            break
    return P
