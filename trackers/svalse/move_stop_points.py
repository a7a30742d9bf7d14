"""A walk that may stand still, on points: two Kalman filters of one or two unknowns, mixed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.motion_models.move_stop import TINY, MoveStopWalk
from arrivals.symmetric import (
    PAIRS,
    SIZES,
    dot,
    inverse,
    log_det,
    times,
)
from arrivals.typing import Float
from arrivals.validation import time_step

MAX_RELATIVE_CHANGE = 1e-6  # of a covariance, beyond which its modes begin anew


class PointModes(NamedTuple):
    """Modes of points, each with (still, moving) on the last axis.

    Parameters
    ----------
    offset : ndarray, shape (d, L, 2)
        Means, from the mean of their mixture, in the chart.
    covariance : ndarray, shape (d(d+1)/2, L, 2)
        Upper triangles.
    weight : ndarray, shape (L, 2)
    """

    offset: Float
    covariance: Float
    weight: Float

    @classmethod
    def of(cls, rows: Float, d: int) -> PointModes:
        """Return the modes of an array of rows (d + d(d+1)/2 + 1, L, 2)."""
        return cls(rows[:d], rows[d:-1], rows[-1])

    @property
    def rows(self) -> Float:
        """The modes in one array."""
        return np.concatenate([self.offset, self.covariance, self.weight[None]])


class PointMixture(NamedTuple):
    """Mixture of the modes after a prediction or an update.

    Parameters
    ----------
    shift, covariance : ndarray, shapes (d, L), (d(d+1)/2, L)
        Shift of the mean, and covariance.
    modes : PointModes
    """

    shift: Float
    covariance: Float
    modes: PointModes


def initial(walk: MoveStopWalk, covariance: Float) -> PointModes:
    """Return the modes of new densities with covariances (d(d+1)/2, L)."""
    d, L = SIZES[len(covariance)], covariance.shape[1]
    both = np.repeat(covariance[..., None], 2, axis=-1)
    return PointModes(np.zeros((d, L, 2)), both, np.broadcast_to(walk.weights, (L, 2)))


def renewed(walk: MoveStopWalk, modes: PointModes, covariance: Float) -> PointModes:
    """Return modes, initial ones where their mixture does not have this covariance."""
    now = mixed(modes).covariance
    scale = np.abs(covariance).max(axis=0)
    differs = np.abs(now - covariance).max(axis=0) > MAX_RELATIVE_CHANGE * scale
    start = initial(walk, covariance)
    return PointModes(
        *(np.where(differs[:, None], b, a) for a, b in zip(modes, start, strict=True))
    )


def mixed(modes: PointModes) -> PointMixture:
    """Return the moments of mixtures, and the modes with their offsets from the new mean."""
    mean = of_both(modes.weight * modes.offset)
    offset = modes.offset - mean[..., None]
    covariance = of_both(modes.weight * (modes.covariance + spread_of(offset)))
    return PointMixture(mean, covariance, modes._replace(offset=offset))


def of_both(values: Float) -> Float:
    """Return sums over the last axis, of two modes: an addition is faster."""
    return np.asarray(values[..., 0] + values[..., 1])


def spread_of(offset: Float) -> Float:
    """Return the triangles of o oᵀ, (d(d+1)/2, ...)."""
    return np.stack([offset[i] * offset[j] for i, j in PAIRS[len(offset)]])


def predict(walk: MoveStopWalk, modes: PointModes, Q: Float, dt: float = 1.0) -> PointMixture:
    """Mix the modes and widen their densities by a step.

    Parameters
    ----------
    walk : MoveStopWalk
    modes : PointModes
    Q : ndarray, shape (d(d+1)/2, L)
        Covariance of the moving mode's step.
    dt : float
        Length of the step, for the probability that the mode stays.
    """
    s, omega, (mean, whole, centred) = walk.stay ** time_step(dt), walk.weights, mixed(modes)
    # c_k = s w_k + (1 - s) ω_k
    c = np.maximum(s * modes.weight + (1 - s) * omega, TINY)
    kept, drawn = s * modes.weight / c, (1 - s) * omega / c
    # moments of the mixture of the mode itself and of all, of mean 0, that leads to each mode
    o = kept * centred.offset
    P = kept * (modes.covariance + spread_of(centred.offset - o))
    P = P + drawn * (whole[..., None] + spread_of(o)) + Q[..., None] * walk.relative_variances
    new = mixed(PointModes(o, P, c))
    return PointMixture(mean + new.shift, new.covariance, new.modes)


def update(walk: MoveStopWalk, modes: PointModes, force: Float, information: Float) -> PointMixture:
    """Update the modes by data of an information D about the point.

    Parameters
    ----------
    walk : MoveStopWalk
    modes : PointModes
    force : ndarray, shape (d, L)
        D δ, δ the point of the data alone, from the mean of the mixture.
    information : ndarray, shape (d(d+1)/2, L)
        D, positive semidefinite.
    """
    d, L = force.shape
    P = modes.covariance.reshape(len(modes.covariance), 2 * L)
    o = modes.offset.reshape(d, 2 * L)
    D, b = np.repeat(information, 2, axis=1), np.repeat(force, 2, axis=1)
    # P' = (P⁻¹ + D)⁻¹,  o' = o + P' D (δ - o)
    new = inverse(inverse(P) + D)
    pull = b - times(D, o)
    shift = times(new, pull)
    # ln N(δ; o, P + D⁻¹) = ½ ln |P'|/|P| + b·o - ½ oᵀDo + ½ (D(δ - o))ᵀ P' D(δ - o) + const
    log_w = 0.5 * (log_det(new) - log_det(P)) + dot(b - 0.5 * times(D, o), o)
    log_w = (log_w + 0.5 * dot(pull, shift)).reshape(L, 2)
    log_w = log_w + np.log(np.maximum(modes.weight, TINY))
    w = np.exp(log_w - log_w.max(axis=-1, keepdims=True))
    w = w / w.sum(axis=-1, keepdims=True)
    return mixed(PointModes((o + shift).reshape(d, L, 2), new.reshape(len(new), L, 2), w))
