"""Kalman filter over a block of samples with constant models.

The gain does not depend on the data: the Riccati recursion runs to its steady state, then all
samples are filtered at once. All functions have leading batch axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.trackers.gaussian.equations import predict_gaussian, update_leading
from arrivals.trackers.gaussian.linalg import transposed
from arrivals.typing import Bool, Float

STEADY_TOLERANCE = 1e-4  # relative change of P per step below which the gain counts as steady
MAX_STEPS, STRIDE = 250, 5  # steps of the Riccati recursion, and steps between two checks


class StateSpace(NamedTuple):
    """Linear model x' = F x + v, y = A x[:k] + e, with v ~ (0, Q) and e ~ (0, r I).

    Shapes: F, Q (..., n, n), A (..., m, k), r (..., 1, 1).
    """

    F: Float
    Q: Float
    A: Float
    r: Float


def steady_state(P: Float, model: StateSpace) -> tuple[Float, Float]:
    """Return the steady gain K (..., n, m) and covariance P after a measurement (..., n, n).

    Parameters
    ----------
    P : ndarray, shape (..., n, n)
        Start of the recursion.
    model : StateSpace

    Examples
    --------
    >>> one = np.ones((1, 1))
    >>> K, P = steady_state(one, StateSpace(one, one, one, one))
    >>> K.round(4), P.round(4)
    (array([[0.618]]), array([[0.618]]))
    """
    F, Q, A, r = model
    k = A.shape[-1]
    AtA = transposed(A) @ A
    R = r * np.eye(k)
    finished: Bool | None = None
    for _ in range(MAX_STEPS // STRIDE):
        new = P
        for _ in range(STRIDE):
            old, new = new, predict_gaussian(new, F, Q)
            P_s = new[..., :k]
            gain = np.linalg.solve(AtA @ P_s[..., :k, :] + R, AtA)
            new = new - P_s @ gain @ transposed(P_s)
        change = np.abs(new - old).max(axis=(-1, -2), keepdims=True)
        steady = np.asarray(change <= STEADY_TOLERANCE * new.max(axis=(-1, -2), keepdims=True))
        # finished members of a batch wait for the others, with the numbers of a single run
        P = new if finished is None else np.where(finished, P, new)
        finished = steady if finished is None else finished | steady
        if finished.all():
            break
    return update_leading(predict_gaussian(P, F, Q), A, r)


def fixed_gain(x: Float, Phi: Float, b: Float, n_parts: int = 1) -> Float:
    """Return all x_j = Φ x_{j-1} + b_j by doubling: log2(n_samples) matrix products.

    Parameters
    ----------
    x : ndarray, shape (..., n_parts, n)
        x_0; `n_parts` series share Φ.
    Phi : ndarray, shape (..., n, n)
    b : ndarray, shape (..., n_samples * n_parts, n)
        Sample by sample, the parts of one sample next to each other.

    Examples
    --------
    >>> fixed_gain(np.ones((1, 1)), np.array([[0.5]]), np.zeros((3, 1))).ravel()
    array([0.5  , 0.25 , 0.125])
    """
    Phi = transposed(Phi)
    X = b.copy()
    X[..., :n_parts, :] += x @ Phi
    step = n_parts
    while True:
        X[..., step:, :] += X[..., :-step, :] @ Phi
        step *= 2
        if step >= X.shape[-2]:
            return X
        Phi = Phi @ Phi


def steady_filter(x: Float, P: Float, y: Float, model: StateSpace) -> tuple[Float, Float]:
    """Return the states after each sample, at the steady gain, and their covariance.

    Parameters
    ----------
    x : ndarray, shape (..., n_parts, n)
    P : ndarray, shape (..., n, n)
        Belief before the samples; of complex states, E|x - mean|².
    y : ndarray, shape (..., n_samples * n_parts, m)
        Real and imaginary part next to each other.
    model : StateSpace

    Returns
    -------
    X : ndarray, shape (..., n_samples * n_parts, n)
    P : ndarray, shape (..., n, n)
    """
    F, _, A, _ = model
    K, P = steady_state(P, model)
    # x(j) = (I - K H) F x(j-1) + K y(j)
    Phi = F - K @ (A @ F[..., : A.shape[-1], :])
    return fixed_gain(x, Phi, y @ transposed(K), x.shape[-2]), P


def exact_filter(x: Float, P: Float, y: Float, model: StateSpace) -> tuple[Float, Float]:
    """Return the states after each sample and the covariance of each; NaN in y is not used.

    Parameters
    ----------
    x, P, y, model
        As in `steady_filter`.

    Returns
    -------
    X : ndarray, shape (..., n_samples * n_parts, n)
    P : ndarray, shape (..., n_samples, n, n)
    """
    F, Q, A, r = model
    n_parts, k = x.shape[-2], A.shape[-1]
    X = np.empty((*y.shape[:-1], x.shape[-1]))
    Ps = np.empty((*y.shape[:-2], y.shape[-2] // n_parts, *P.shape[-2:]))
    for j in range(Ps.shape[-3]):
        rows = slice(n_parts * j, n_parts * (j + 1))
        valid = np.asarray(np.isfinite(y[..., rows, :]).all(axis=-2))
        H = np.where(valid[..., None], A, 0.0)  # a row of zeros has no gain
        # x = F x, P = F P F' + Q
        x = x @ transposed(F)
        K, P = update_leading(predict_gaussian(P, F, Q), H, r)
        # x = x + K (y - H x)
        innovation = np.where(valid[..., None, :], y[..., rows, :], 0.0)
        innovation = innovation - x[..., :k] @ transposed(H)
        x = x + innovation @ transposed(K)
        X[..., rows, :], Ps[..., j, :, :] = x, P
    return X, Ps
