"""The Kalman filter over a block of samples whose models do not change in it.

The gain does not depend on the data: the Riccati recursion runs to its steady state, then all
samples are filtered at once. All functions have leading batch axes. A measurement sees the first k
entries of a state, y = A x[:k] + e, e ~ (0, r I).
"""

from __future__ import annotations

import numpy as np

from arrivals.typing import Bool, Float

TOLERANCE = 1e-4  # of what the last step changed, where the gain counts as steady
MOST_STEPS, STRIDE = 250, 5


def transposed(A: Float) -> Float:
    """Return Aᵀ of stacked matrices."""
    return np.swapaxes(A, -1, -2)


def corrected(P: Float, A: Float, r: Float) -> tuple[Float, Float]:
    """Return gain and covariance after a measurement.

    Parameters
    ----------
    P : ndarray, shape (..., n, n)
        Predicted covariance.
    A : ndarray, shape (..., m, k)
    r : ndarray, shape (..., 1, 1)

    Notes
    -----
    Aᵀ (A P_ss Aᵀ + r I)⁻¹ = (r I + AᵀA P_ss)⁻¹ Aᵀ: only k x k matrices are factored.
    """
    m, k = A.shape[-2:]
    seen, At = P[..., :k], transposed(A)
    AtA = At @ A
    inner = AtA @ seen[..., :k, :] + r * np.eye(k)
    solved = np.linalg.solve(inner, np.concatenate([At, AtA], axis=-1))
    P = P - seen @ solved[..., m:] @ transposed(seen)
    return seen @ solved[..., :m], (P + transposed(P)) / 2


def steady_state(P: Float, F: Float, Q: Float, A: Float, r: Float) -> tuple[Float, Float]:
    """Return the steady gain K (..., n, m) and covariance P after a measurement (..., n, n).

    Parameters
    ----------
    P : ndarray, shape (..., n, n)
        Where the recursion starts.
    F, Q : ndarray, shape (..., n, n)
    A : ndarray, shape (..., m, k)
    r : ndarray, shape (..., 1, 1)

    Examples
    --------
    >>> one = np.ones((1, 1))
    >>> K, P = steady_state(one, one, one, one, one)
    >>> K.round(4), P.round(4)
    (array([[0.618]]), array([[0.618]]))
    """
    k, Ft = A.shape[-1], transposed(F)
    AtA = transposed(A) @ A
    R = r * np.eye(k)
    done: Bool | None = None
    for _ in range(MOST_STEPS // STRIDE):
        new = P
        for _ in range(STRIDE):
            old, new = new, F @ new @ Ft + Q
            seen = new[..., :k]
            gain = np.linalg.solve(AtA @ seen[..., :k, :] + R, AtA)
            new = new - seen @ gain @ transposed(seen)
        change = np.abs(new - old).max(axis=(-1, -2), keepdims=True)
        steady = np.asarray(change <= TOLERANCE * new.max(axis=(-1, -2), keepdims=True))
        # a batch goes on until its last member is there; the others wait, as if they were alone
        P = new if done is None else np.where(done, P, new)
        done = steady if done is None else done | steady
        if done.all():
            break
    return corrected(F @ P @ Ft + Q, A, r)


def fixed_gain(x: Float, Phi: Float, b: Float, parts: int = 1) -> Float:
    """Return all x_j = Φ x_{j-1} + b_j, by doubling the step: log2 of the samples products.

    Parameters
    ----------
    x : ndarray, shape (..., parts, n)
        x_0; `parts` series that share Φ.
    Phi : ndarray, shape (..., n, n)
    b : ndarray, shape (..., n_samples * parts, n)
        Sample by sample, the parts of one beside each other.

    Examples
    --------
    >>> fixed_gain(np.ones((1, 1)), np.array([[0.5]]), np.zeros((3, 1))).ravel()
    array([0.5  , 0.25 , 0.125])
    """
    Phi = transposed(Phi)
    X = b.copy()
    X[..., :parts, :] += x @ Phi
    step = parts
    while True:
        X[..., step:, :] += X[..., :-step, :] @ Phi
        step *= 2
        if step >= X.shape[-2]:
            return X
        Phi = Phi @ Phi


def steady_filter(
    x: Float, P: Float, y: Float, F: Float, Q: Float, A: Float, r: Float
) -> tuple[Float, Float]:
    """Return the states after each sample, at the steady gain, and their covariance.

    Parameters
    ----------
    x : ndarray, shape (..., parts, n)
    P : ndarray, shape (..., n, n)
        Belief before the samples; of complex states, E|x - mean|².
    y : ndarray, shape (..., n_samples * parts, m)
        Real and imaginary part beside each other.
    F, Q, A, r
        As in `steady_state`.

    Returns
    -------
    X : ndarray, shape (..., n_samples * parts, n)
    P : ndarray, shape (..., n, n)
    """
    K, P = steady_state(P, F, Q, A, r)
    Phi = F - K @ (A @ F[..., : A.shape[-1], :])  # (I - K H) F
    return fixed_gain(x, Phi, y @ transposed(K), x.shape[-2]), P


def exact_filter(
    x: Float, P: Float, y: Float, F: Float, Q: Float, A: Float, r: Float
) -> tuple[Float, Float]:
    """Return the states after each sample and the covariance of each; NaN in y is not used.

    Parameters
    ----------
    As in `steady_filter`.

    Returns
    -------
    X : ndarray, shape (..., n_samples * parts, n)
    P : ndarray, shape (..., n_samples, n, n)
    """
    parts = x.shape[-2]
    X = np.empty((*y.shape[:-1], x.shape[-1]))
    Ps = np.empty((*y.shape[:-2], y.shape[-2] // parts, *P.shape[-2:]))
    for j in range(Ps.shape[-3]):
        here = slice(parts * j, parts * (j + 1))
        heard = np.asarray(np.isfinite(y[..., here, :]).all(axis=-2))
        seen = np.where(heard[..., None], A, 0.0)  # a row of zeros gets no gain
        x = x @ transposed(F)
        K, P = corrected(F @ P @ transposed(F) + Q, seen, r)
        innovation = np.where(heard[..., None, :], y[..., here, :], 0.0)
        innovation = innovation - x[..., : A.shape[-1]] @ transposed(seen)
        x = x + innovation @ transposed(K)
        X[..., here, :], Ps[..., j, :, :] = x, P
    return X, Ps
