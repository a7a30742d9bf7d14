"""Linearized models, and the prediction and update of Gaussian beliefs by them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.gaussian.arguments import covariance_matrix, finite_matrix
from arrivals.trackers.gaussian.equations import GaussianUpdate, predict_gaussian, update_gaussian
from arrivals.trackers.gaussian.linalg import apply
from arrivals.typing import Bool, Float

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter


class Linearization(NamedTuple):
    """A function near a belief: f(x + d) ≈ mean + jacobian d + e, with e ~ (0, extra_noise)."""

    mean: Float
    jacobian: Float
    extra_noise: Float | None = None
    jittered: int = 0  # number of covariances to which jitter was added

    def total_noise(self, noise: Float) -> Float:
        """Return the covariance of a model's noise plus e."""
        return noise if self.extra_noise is None else noise + self.extra_noise


def at_each(jacobian: Callable[..., Float], x: Float, *args: float) -> Float:
    """Return the Jacobians (..., m, n) at states (..., n).

    Examples
    --------
    >>> at_each(np.diag, np.ones((3, 2))).shape
    (3, 2, 2)
    """
    if x.ndim == 1:
        return jacobian(x, *args)
    return np.stack([at_each(jacobian, state, *args) for state in x])


def linear_step(
    tracker: GaussianFilter,
    x: Float,
    P: Float,
    dt: float,
    F: ArrayLike | None = None,
    Q: ArrayLike | None = None,
) -> tuple[Linearization, Float]:
    """Return the linearized motion and its noise, or F and Q where they are not None."""
    n = tracker.dim_x
    if F is None:
        motion = tracker.linearize_motion(x, P, dt)
    else:
        F = finite_matrix("F", F, n, n)
        motion = Linearization(apply(F, x), F)
    Q = tracker.state_motion.Q(dt) if Q is None else covariance_matrix("Q", Q, n)
    return motion, motion.total_noise(Q)


def predict_belief(
    tracker: GaussianFilter,
    x: Float,
    P: Float,
    dt: float,
    F: ArrayLike | None = None,
    Q: ArrayLike | None = None,
) -> tuple[Float, Float]:
    """Return the predictions of beliefs.

    Parameters
    ----------
    tracker : GaussianFilter
    x : ndarray, shape (..., n)
    P : ndarray, shape (..., n, n)
    dt : float
        Length of the step.
    F, Q : array_like, shape (n, n), optional
        Replace the motion model's function and noise.

    Returns
    -------
    x, P : ndarray, shapes (..., n), (..., n, n)
    """
    # f(x + d) = f + F d + e,  e ~ (0, Q)
    motion, Q = linear_step(tracker, x, P, dt, F, Q)
    # x = f,  P = F P F' + Q
    return motion.mean, predict_gaussian(P, motion.jacobian, Q, tracker.fading)


def update_belief(
    tracker: GaussianFilter,
    x: Float,
    P: Float,
    z: Float,
    missing: Bool | None,
    R: Float,
    H: Float | None = None,
) -> GaussianUpdate:
    """Return the updates of beliefs; angles of the means are not wrapped.

    Parameters
    ----------
    tracker : GaussianFilter
    x : ndarray, shape (..., n)
    P : ndarray, shape (..., n, n)
    z : ndarray, shape (..., m)
        Measurements.
    missing : ndarray of bool, shape (..., m), or None
        Where they are missing.
    R : ndarray, shape (m, m)
        Noise of the measurements.
    H : ndarray, shape (m, n), optional
        Replaces the measurement model: z = H x + v.

    Returns
    -------
    GaussianUpdate
    """
    # h(x + d) = h + H d + e
    near = tracker.linearize_measurement(x, P) if H is None else Linearization(apply(H, x), H)
    # y = z - h
    y = tracker.innovation(z, near.mean, missing, plain=H is not None)
    # S = H P H' + R,  K = P H' S^-1,  x = x + K y,  P = (I - K H) P (I - K H)' + K R K'
    R = near.total_noise(R)
    update = update_gaussian(x, P, y, near.jacobian, R, missing, tracker.inv)
    return update._replace(jittered=update.jittered + near.jittered) if near.jittered else update
