"""Kalman gains and covariances after an update: the part of it that no measured number enters.

References
----------
Särkkä, *Bayesian Filtering and Smoothing*, 2013, theorem 4.2; Bar-Shalom, Li, Kirubarajan,
*Estimation with Applications to Tracking and Navigation*, 2001, sec. 5.2.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.trackers.gaussian.linalg import (
    Inverse,
    identity,
    inverse,
    inverse_and_log_det,
    multiplication,
    symmetric,
)
from arrivals.typing import Bool, Float, Int


class Gain(NamedTuple):
    """The quantities of an update that depend on the covariance alone, under filterpy's names."""

    P: Float  # after the update
    K: Float
    S: Float
    SI: Float
    half_log_det: float | Float  # ½ log |S|
    n_valid: int | Int  # entries of z that are not missing
    jittered: int  # number of S to which jitter was added


def kalman_gain(
    P: Float, H: Float, R: Float, missing: Bool | None = None, inv: Inverse = inverse
) -> Gain:
    """Return the gain of linear measurements, and the covariance after their update.

    Parameters
    ----------
    P : ndarray, shape (..., n, n)
    H : ndarray, shape (m, n) or (..., m, n)
    R : ndarray, shape (m, m) or (..., m, m)
    missing : ndarray of bool, shape (..., m), optional
        Entries of z that are left out. There K is 0 and S has a row of the unit matrix.
    inv : callable
        Inverts S.

    Returns
    -------
    Gain

    Examples
    --------
    >>> one = np.eye(1)
    >>> gain = kalman_gain(one, one, one)
    >>> gain.K, gain.P
    (array([[0.5]]), array([[0.5]]))
    """
    dot, n_valid = multiplication(P), H.shape[-2]
    # S = H P H' + R   (4.21)
    PHT = dot(P, H.mT)
    S = dot(H, PHT) + R
    if missing is not None:
        PHT, S = leave_out(missing, PHT, S)
        n_valid = n_valid - missing.sum(axis=-1)
    S, SI, log_det, jittered = inverse_and_log_det(S, inv)
    # K = P H' S^-1   (4.21)
    K = dot(PHT, SI)
    return Gain(joseph(P, K, H, R), K, S, SI, log_det, n_valid, jittered)


def joseph(P: Float, K: Float, H: Float, R: Float) -> Float:
    """Return covariances after an update by any gain, in Joseph's form.

    Parameters
    ----------
    P : ndarray, shape (..., n, n)
    K : ndarray, shape (..., n, m)
    H : ndarray, shape (m, n) or (..., m, n)
    R : ndarray, shape (m, m) or (..., m, m)

    Returns
    -------
    ndarray, shape (..., n, n)

    Examples
    --------
    >>> joseph(np.eye(1), np.full((1, 1), 0.5), np.eye(1), np.eye(1))
    array([[0.5]])
    """
    dot = multiplication(P)
    # P = (I - K H) P (I - K H)' + K R K'   (Bar-Shalom 5.2.3-18)
    I_KH = identity(P.shape[-1]) - dot(K, H)
    updated = dot(dot(I_KH, P), I_KH.mT)
    updated += dot(dot(K, R), K.mT)
    return symmetric(updated)


def leave_out(missing: Bool, PHT: Float, S: Float) -> tuple[Float, Float]:
    """Return cross-covariance and S without the information of missing entries.

    Examples
    --------
    >>> leave_out(np.array([True]), np.ones((1, 1)), np.full((1, 1), 2.0))
    (array([[0.]]), array([[1.]]))
    """
    either = missing[..., :, None] | missing[..., None, :]
    return (
        np.where(missing[..., None, :], 0.0, PHT),
        np.where(either, np.eye(S.shape[-1]), S),
    )
