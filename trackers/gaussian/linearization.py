"""Linearized models, and the prediction and update of Gaussian beliefs by them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.trackers.gaussian.arguments import covariance_matrix, finite_matrix
from arrivals.trackers.gaussian.circular import Angles, add, difference
from arrivals.trackers.gaussian.equations import GaussianUpdate, predict_gaussian, update_gaussian
from arrivals.trackers.gaussian.linalg import apply, cholesky
from arrivals.typing import Bool, Float

if TYPE_CHECKING:
    from arrivals.trackers.gaussian.base import GaussianFilter

MAX_HALVINGS = 12  # of a step
TOLERATED_RISE = 0.1  # of the cost: the means of regressions are not its minimum
SETTLED = 1e-3  # standard deviations: the search ends
NEAR = 1e-4  # of a covariance: sigma points in the search
VAGUE = 1e4  # variance of a predicted measurement over that of its noise
MISFIT = 30  # standard deviations of the noise


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


def first(x: Float) -> Float:
    """Return one state of a batch, for matrices that are the same at all of them.

    Examples
    --------
    >>> first(np.array([[1.0, 2.0], [3.0, 4.0]]))
    array([1., 2.])
    """
    return x if x.ndim == 1 else first(x[0])


def linear_step(
    tracker: GaussianFilter,
    x: Float,
    P: Float,
    dt: float,
    F: ArrayLike | None = None,
    Q: ArrayLike | None = None,
) -> tuple[Linearization, Float]:
    """Return the linearized motion and its noise, or F and Q where they are not None."""
    n = x.shape[-1]
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
    if H is None and tracker.iterations > 1:
        return _iterated_update(tracker, x, P, z, missing, R)
    # h(x + d) = h + H d + e
    near = tracker.linearize_measurement(x, P) if H is None else Linearization(apply(H, x), H)
    # y = z - h
    y = tracker.innovation(z, near.mean, missing, plain=H is not None)
    # S = H P H' + R,  K = P H' S^-1,  x = x + K y,  P = (I - K H) P (I - K H)' + K R K'
    R = near.total_noise(R)
    update = update_gaussian(x, P, y, near.jacobian, R, missing, tracker.inv)
    return update._replace(jittered=update.jittered + near.jittered) if near.jittered else update


def _iterated_update(
    tracker: GaussianFilter, x: Float, P: Float, z: Float, missing: Bool | None, R: Float
) -> GaussianUpdate:
    """Return updates by a measurement that is linearized again at each new mean.

    The mean is searched for by Gauss-Newton steps, with tangents or regressions over a small part
    of the belief; steps that would increase the cost are halved, each belief of a batch its own.
    The last linearization is over the whole belief that the search has ended with.
    """
    angles, cost = tracker.state_angles, _cost(tracker, x, P, z, missing, R)
    centre, spread, lowest, jittered, settled = x, P, cost(x), 0, False
    for k in range(1, tracker.iterations + 1):
        last = settled or k == tracker.iterations
        near = tracker.linearize_measurement(centre, spread if last else NEAR * spread)
        # y = z - h(c) - H (x - c)
        y = tracker.innovation(z, near.mean, missing, plain=False)
        y = y - apply(near.jacobian, difference(x, centre, angles))
        # c = x + K y
        noise = near.total_noise(R)
        update = update_gaussian(x, P, y, near.jacobian, noise, missing, tracker.inv)
        jittered += near.jittered + update.jittered
        moved, lowest = _line_search(centre, update.x, lowest, cost, angles)
        std = np.sqrt(np.maximum(update.P.diagonal(0, -2, -1), 0.0))
        settled = bool((np.abs(difference(moved, centre, angles)) <= SETTLED * std).all())
        centre, spread = moved, update.P
        if last:
            break
    return update._replace(x=centre, jittered=jittered)


def _line_search(
    centre: Float, target: Float, lowest: Float, cost: Callable[[Float], Float], angles: Angles
) -> tuple[Float, Float]:
    """Return the farthest points c + t (target - c), t = 1, 1/2, 1/4, ..., that cost no more."""
    step, moved = difference(target, centre, angles), centre
    accepted = np.zeros(np.shape(lowest), dtype=bool)
    for t in 0.5 ** np.arange(MAX_HALVINGS):
        trial = add(centre, t * step, angles)
        value = cost(trial)
        better = ~accepted & (value < lowest + TOLERATED_RISE)
        moved = np.where(better[..., None], trial, moved)
        lowest, accepted = np.where(better, value, lowest), accepted | better
        if accepted.all():
            break
    return moved, lowest


def _cost(
    tracker: GaussianFilter, x: Float, P: Float, z: Float, missing: Bool | None, R: Float
) -> Callable[[Float], Float]:
    """Return the function ½ (z - h(c))' R^-1 (z - h(c)) + ½ (c - x)' P^-1 (c - x)."""
    angles, L_P, L_R = tracker.state_angles, cholesky(P)[1], cholesky(R)[1]
    if missing is not None:
        either = missing[..., :, None] | missing[..., None, :]
        L_R = cholesky(np.where(either, np.eye(len(R)), R))[1]

    def cost(centre: Float) -> Float:
        h = tracker.held_measurement.h(centre)
        y = np.linalg.solve(L_R, tracker.innovation(z, h, missing, plain=False)[..., None])
        d = np.linalg.solve(L_P, difference(centre, x, angles)[..., None])
        return np.asarray(0.5 * ((y**2).sum((-1, -2)) + (d**2).sum((-1, -2))))

    return cost


def warn_if_far_from_linear(
    tracker: GaussianFilter, z: Float, missing: Bool | None, R: Float, S: Float
) -> None:
    """Warn, once, if a measurement from a vague prior does not fit the belief that it has made."""
    if S.item(0) <= VAGUE * R.item(0) or tracker.warned:
        return
    h = tracker.held_measurement.h(np.ravel(tracker.x))
    y = np.abs(tracker.innovation(z, h, missing, plain=False))
    if (y > MISFIT * np.sqrt(R.diagonal())).any():
        tracker.warned = True
        text = (
            f"the measurement is far from linear over the prior: after its update it is more than "
            f"{MISFIT} standard deviations off, and P is too small: set iterations, such as 10"
        )
        warnings.warn(text, UserWarning, stacklevel=3)
