"""Predict, update and smooth Gaussian beliefs of linear models.

All functions take arrays with any leading (batch) axes: means x (..., n), covariances P
(..., n, n). The matrices of a model may have fewer leading axes than the beliefs.

References
----------
Särkkä, *Bayesian Filtering and Smoothing*, 2013, theorems 4.2 and 8.2; Bar-Shalom, Li,
Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001, sec. 5.2.3.
"""

from __future__ import annotations

import math
import sys
from typing import NamedTuple

import numpy as np

from arrivals.trackers.gaussian.gains import kalman_gain, leave_out
from arrivals.trackers.gaussian.linalg import (
    Inverse,
    apply,
    cholesky,
    half_log_det,
    inner,
    inverse,
    multiplication,
    symmetric,
)
from arrivals.typing import Bool, Float

LOG_2PI = math.log(2 * math.pi)


class GaussianUpdate(NamedTuple):
    """A belief after a measurement and the quantities of its update, under filterpy's names."""

    x: Float
    P: Float
    y: Float
    K: Float
    S: Float
    SI: Float
    log_likelihood: Float
    square: Float  # yᵀ S⁻¹ y
    jittered: int


def predict_gaussian(P: Float, F: Float, Q: Float, fading: float = 1.0) -> Float:
    """Return the covariance after a step.

    Parameters
    ----------
    P : ndarray, shape (..., n, n)
    F, Q : ndarray, shape (n, n) or (..., n, n)
    fading : float
        Factor of F P F', above 1 for a fading memory.

    Returns
    -------
    ndarray, shape (..., n, n)

    Examples
    --------
    >>> predict_gaussian(np.eye(2), np.array([[1.0, 1.0], [0.0, 1.0]]), np.eye(2))
    array([[3., 1.],
           [1., 2.]])
    """
    dot = multiplication(P)
    # P = F P F' + Q   (4.20)
    FPF = dot(dot(F, P), F.mT)
    return (FPF if fading == 1 else fading * FPF) + Q


def update_gaussian(
    x: Float,
    P: Float,
    y: Float,
    H: Float,
    R: Float,
    missing: Bool | None = None,
    inv: Inverse = inverse,
) -> GaussianUpdate:
    """Update Gaussian beliefs by the residuals of linear measurements.

    Parameters
    ----------
    x : ndarray, shape (..., n)
    P : ndarray, shape (..., n, n)
    y : ndarray, shape (..., m)
        Residuals z - z_pred.
    H : ndarray, shape (m, n) or (..., m, n)
    R : ndarray, shape (m, m) or (..., m, m)
    missing : ndarray of bool, shape (..., m), optional
        Entries of z that are left out. There y, K are 0 and S has a row of the unit matrix.
    inv : callable
        Inverts S.

    Returns
    -------
    GaussianUpdate

    Examples
    --------
    Two equally accurate measurements of a number, from variance 1 to 1/2:

    >>> one = np.eye(1)
    >>> update = update_gaussian(np.zeros(1), one, np.ones(1), one, one)
    >>> update.x, update.P, float(update.log_likelihood.round(4))
    (array([0.5]), array([[0.5]]), -1.5155)
    """
    # S = H P H' + R,  K = P H' S^-1   (4.21),  P = (I - K H) P (I - K H)' + K R K'
    P, K, S, SI, half_log, n_valid, jittered = kalman_gain(P, H, R, missing, inv)
    if missing is not None:
        y = np.where(missing, 0.0, y)
    # x = x + K y   (4.21)
    x = x + apply(K, y)
    # ln N(y; 0, S)
    square = inner(y, apply(SI, y))
    log_likelihood = -0.5 * (n_valid * LOG_2PI + square) - half_log
    return GaussianUpdate(x, P, y, K, S, SI, log_likelihood, square, jittered)


def log_normal_update(y: Float, S: Float, missing: Bool | None = None) -> tuple[Float, Float, int]:
    """Return ln N(y; 0, S) of the valid entries, their squared distance, and the jitter count.

    Examples
    --------
    >>> float(log_normal_update(np.zeros(1), np.eye(1))[0].round(4))
    -0.9189
    """
    n_valid = y.shape[-1]
    if missing is not None:
        y, S = np.where(missing, 0.0, y), leave_out(missing, S, S)[1]
        n_valid = n_valid - missing.sum(axis=-1)
    S, L, jittered = cholesky(S)
    square = inner(y, np.asarray(np.linalg.solve(S, y[..., None])[..., 0], np.float64))
    return -0.5 * (n_valid * LOG_2PI + square) - half_log_det(L), square, jittered


def update_scalar(x: Float, P: Float, y: Float, h: Float, r: Float) -> tuple[Float, Float]:
    """Update beliefs by independent measurements of the first entry of the state.

    Together they are one scalar measurement, so that nothing is inverted.

    Parameters
    ----------
    x : ndarray, shape (..., n)
    P : ndarray, shape (..., n, n)
    y : ndarray, shape (..., m)
        Residuals h d + v of a deviation d of the first entry.
    h : ndarray, shape (..., m)
        Slopes; 0 (and y = 0) where a measurement is left out.
    r : ndarray, shape (...)
        Variance of each v.

    Returns
    -------
    x, P : ndarray, shapes (..., n), (..., n, n)

    Examples
    --------
    >>> update_scalar(np.zeros(1), np.eye(1), np.array([1.0]), np.array([1.0]), np.array(1.0))
    (array([0.5]), array([[0.5]]))
    """
    # i = Σ h²/r,  g = Σ h y/r
    information, gradient = _total(h * h) / r, _total(h * y) / r
    # K = P₀ / (1 + i P₀₀)
    K = P[..., 0] / (1 + information * P[..., 0, 0])[..., None]
    # x = x + K g
    x = x + K * gradient[..., None]
    # P = P - i K P₀'
    return x, P - (information[..., None] * K)[..., :, None] * P[..., None, 0, :]


def _total(terms: Float) -> Float:
    """Return the sums over the last axis: of one term, in a fifth of the time of `sum`."""
    return np.asarray(terms[..., 0] if terms.shape[-1] == 1 else terms.sum(axis=-1))


def update_leading(P: Float, A: Float, r: Float) -> tuple[Float, Float]:
    """Return gains and covariances after measurements y = A x[:k] + e, e ~ (0, r I).

    Parameters
    ----------
    P : ndarray, shape (..., n, n)
        Predicted covariances.
    A : ndarray, shape (..., m, k)
        Measurement matrices of the first k entries of the state.
    r : ndarray, shape (..., 1, 1)
        Noise variances.

    Returns
    -------
    K : ndarray, shape (..., n, m)
    P : ndarray, shape (..., n, n)

    Examples
    --------
    >>> one = np.ones((1, 1))
    >>> update_leading(one, one, one)
    (array([[0.5]]), array([[0.5]]))
    """
    m, k = A.shape[-2:]
    P_k, AT = P[..., :k], A.mT
    ATA = AT @ A
    # A' (A P_kk A' + r I)^-1 = (r I + A'A P_kk)^-1 A': only k x k matrices are factored
    solved = np.linalg.solve(ATA @ P_k[..., :k, :] + r * np.eye(k), np.concatenate([AT, ATA], -1))
    # K = P_k (r I + A'A P_kk)^-1 A'
    K = P_k @ solved[..., :m]
    # P = P - P_k (r I + A'A P_kk)^-1 A'A P_k'
    return K, symmetric(P - P_k @ solved[..., m:] @ P_k.mT)


def smooth_gaussian(x: Float, P: Float, G: Float, dx: Float, dP: Float) -> tuple[Float, Float]:
    """Update beliefs by revised moments of a correlated quantity.

    The quantity is the state of the next step (Rauch, Tung and Striebel's smoother,
    G = P F' P_pred⁻¹), or a part of the same state that another method has updated
    (G = P_{:,part} P_part⁻¹).

    Parameters
    ----------
    x : ndarray, shape (..., n)
    P : ndarray, shape (..., n, n)
    G : ndarray, shape (..., n, m)
        Regression of the state on the quantity.
    dx : ndarray, shape (..., m)
        Revised mean of the quantity minus the one that belongs to x.
    dP : ndarray, shape (..., m, m)
        Revised covariance minus the one that belongs to P.

    Returns
    -------
    x, P : ndarray, shapes (..., n), (..., n, n)

    Examples
    --------
    >>> G, dx, dP = np.array([[1.0], [0.5]]), np.array([2.0]), -np.eye(1)
    >>> smooth_gaussian(np.zeros(2), np.eye(2), G, dx, dP)[0]
    array([2., 1.])
    """
    # x = x + G (x_next - x_pred)   (8.6)
    x = x + apply(G, dx)
    # P = P + G (P_next - P_pred) G'   (8.6)
    dot = multiplication(P)
    return x, symmetric(P + dot(dot(G, dP), G.mT))


def likelihood(log_likelihood: float) -> float:
    """Return the exponential, at least the smallest positive float and never infinite.

    Examples
    --------
    >>> likelihood(0.0), likelihood(-1e6) > 0
    (1.0, True)
    """
    return max(math.exp(min(log_likelihood, 700.0)), sys.float_info.min)
