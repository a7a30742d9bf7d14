"""Autoregressive sources side by side: where their lags stand in one state, and its matrices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from arrivals.typing import Bool, Float, Int


@dataclass(frozen=True, eq=False)
class CompanionLayout:
    """Places in a state in which source k has p_k + 1 lags, the current sample first.

    Attributes
    ----------
    orders : tuple of int
        p_k; P below is the largest.
    first : ndarray of int, shape (n_sources,)
        Places of the current samples.
    lags : ndarray of int, shape (n_sources, P + 1)
        Places of all lags; the source's last one stands in for those that it does not have.
    used : ndarray of bool, shape (n_sources, P)
        Which coefficients a source has.
    columns : ndarray of int, shape (n_sources, P + 1)
        `lags` with the current sample last: what a regression predicts from what.
    shift : ndarray, shape (dim, dim)
        What moves every lag on by one.
    order, back : ndarray of int, shape (dim,)
        Number, source by source, of the lag at each place; and the place of each number.
    """

    orders: tuple[int, ...]
    first: Int
    lags: Int
    used: Bool
    columns: Int
    shift: Float
    order: Int
    back: Int

    @property
    def dim(self) -> int:
        """Entries of the state."""
        return len(self.shift)

    def transition(self, coefficients: Float) -> Float:
        """Return F of coefficients a (..., n_sources, P): block companion, (..., dim, dim)."""
        F = np.zeros((*coefficients.shape[:-2], self.dim, self.dim))
        F += self.shift
        source, lag = np.nonzero(self.used)
        F[..., self.first[source], self.lags[source, lag]] = coefficients[..., source, lag]
        return F

    def drive(self, noise: Float) -> Float:
        """Return Q of driving variances q (..., n_sources): q_k at the current samples."""
        Q = np.zeros((*noise.shape[:-1], self.dim, self.dim))
        Q[..., self.first, self.first] = noise
        return Q


@lru_cache(maxsize=256)
def blocks(orders: tuple[int, ...], lag_by_lag: bool = False) -> CompanionLayout:
    """Return the places for sources of the given orders, counted source by source or lag by lag.

    Examples
    --------
    >>> blocks((1, 2)).lags
    array([[0, 1, 1],
           [2, 3, 4]])
    >>> blocks((1, 2)).transition(np.array([[0.5, 0.0], [0.9, -0.2]]))
    array([[ 0.5,  0. ,  0. ,  0. ,  0. ],
           [ 1. ,  0. ,  0. ,  0. ,  0. ],
           [ 0. ,  0. ,  0.9, -0.2,  0. ],
           [ 0. ,  0. ,  1. ,  0. ,  0. ],
           [ 0. ,  0. ,  0. ,  1. ,  0. ]])
    """
    p = np.array(orders)[:, None]
    source, lag = np.nonzero(np.arange(p.max() + 1) <= p)  # of the entries source by source
    by_lag = np.lexsort((source, lag))
    order = by_lag if lag_by_lag else np.arange(len(source))
    places = np.full((len(orders), int(p.max()) + 1), -1)
    places[source[order], lag[order]] = np.arange(len(source))
    lags = np.take_along_axis(places, np.minimum(np.arange(p.max() + 1), p), axis=1)
    used = places[:, 1:] >= 0
    shift = np.zeros((len(source), len(source)))
    shift[places[:, 1:][used], places[:, :-1][used]] = 1.0
    columns = np.roll(lags, -1, axis=1)
    back = np.argsort(order)
    for array in (lags, used, columns, shift, order, back):
        array.setflags(write=False)
    return CompanionLayout(orders, lags[:, 0], lags, used, columns, shift, order, back)


def radius(coefficients: Float) -> Float:
    """Return the largest modulus of the poles of AR models with coefficients (..., p).

    Examples
    --------
    >>> radius(np.array([[0.5, 0.0], [0.0, -0.81]])).round(6)
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
    shrink = np.minimum(limit / np.maximum(radius(coefficients), limit), 1.0)
    return np.asarray(coefficients * shrink[..., None] ** np.arange(1, coefficients.shape[-1] + 1))


def stationary(F: Float, Q: Float) -> Float:
    """Return P = F P Fᵀ + Q of a stable F, by doubling: half of the sum at once.

    Examples
    --------
    >>> stationary(np.array([[0.5]]), np.array([[0.75]]))
    array([[1.]])
    """
    P, power = Q, F
    for _ in range(64):
        more = power @ P @ np.swapaxes(power, -1, -2)
        P, power = P + more, power @ power
        if np.abs(more).max() <= 1e-16 * np.abs(P).max():
            break
    return P
