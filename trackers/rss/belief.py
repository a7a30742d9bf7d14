"""What is believed of sources that move: a state and a log amplitude each."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from arrivals.motion_models.base import MotionModel
from arrivals.motion_models.linear import ConstantVelocity, LinearMotion, RandomWalk
from arrivals.trackers.gaussian.circular import wrapped
from arrivals.trackers.gaussian.linearization import at_each
from arrivals.trackers.rss.inference.joint_posterior import Marginals, Prior, inverse_2x2
from arrivals.typing import Float

Entries = tuple[int, int]


class SourceBeliefs(NamedTuple):
    """Independent Gaussian beliefs of sources, any leading axes.

    Parameters
    ----------
    x : ndarray, shape (..., n_sources, n)
        States of the motion model.
    P : ndarray, shape (..., n_sources, n, n)
        Their covariances.
    u, v : ndarray, shape (..., n_sources)
        Log amplitudes, Np, and their variances, Np².
    """

    x: Float
    P: Float
    u: Float
    v: Float

    def take(self, rows: Any) -> SourceBeliefs:
        """Return some along the first axis."""
        return SourceBeliefs(*(part[rows] for part in self))

    def joined(self, others: SourceBeliefs) -> SourceBeliefs:
        """Return these and others, along the first axis."""
        return SourceBeliefs(*(np.concatenate(parts) for parts in zip(self, others, strict=True)))

    def predicted(self, motion: MotionModel, dt: float, q_u: float) -> SourceBeliefs:
        """Return the beliefs after `dt`: x = F x, P = F P Fᵀ + Q, v = v + q_u dt."""
        F = transitions(motion, self.x, dt)
        P = F @ self.P @ np.swapaxes(F, -1, -2) + motion.Q(dt)
        return SourceBeliefs(motion.f(self.x, dt), P, self.u, self.v + q_u * dt)

    def prior(self, position: Entries) -> Prior:
        """Return what a variational update takes for its prior."""
        P = self.P[..., position, :][..., position]
        return Prior(self.u, 1 / self.v, self.x[..., position], inverse_2x2(P))

    def corrected(
        self, u: Float, theta: Float, found: Marginals, position: Entries, angles: tuple[int, ...]
    ) -> SourceBeliefs:
        """Return the beliefs once positions and log amplitudes are known better.

        A reading depends on the position alone, so the rest of a state follows exactly:

            G = P:θ Pθθ⁻¹,  x = x⁻ + G (θ - xθ⁻),  P = P⁻ - G (Pθθ - Σ) Gᵀ

        Examples
        --------
        A position known exactly tells half of the correlated rest:

        >>> P = np.array([[[1.0, 0.0, 0.5], [0.0, 1.0, 0.0], [0.5, 0.0, 1.0]]])
        >>> before = SourceBeliefs(np.zeros((1, 3)), P, np.zeros(1), np.ones(1))
        >>> exactly = Marginals(np.ones(1), np.zeros((1, 2, 2)))
        >>> before.corrected(np.zeros(1), np.array([[2.0, 0.0]]), exactly, (0, 1), ()).x
        array([[2., 0., 1.]])
        """
        P_theta = self.P[..., :, position]
        P_theta_theta = P_theta[..., position, :]
        G = P_theta @ inverse_2x2(P_theta_theta)
        x = self.x + (G @ (theta - self.x[..., position])[..., None])[..., 0]
        P = self.P - G @ (P_theta_theta - found.Sigma) @ np.swapaxes(G, -1, -2)
        return SourceBeliefs(wrapped(x, angles), 0.5 * (P + np.swapaxes(P, -1, -2)), u, found.v)

    def flat(self, n_slots: int) -> tuple[Float, Float]:
        """Return one mean and one covariance: state, then u, source by source.

        Unused places are NaN and 0. No leading axes but that of the sources.
        """
        K, n = self.x.shape
        x = np.full((n_slots, n + 1), np.nan)
        x[:K, :n], x[:K, n] = self.x, self.u
        P = np.zeros((n_slots, n + 1, n_slots, n + 1))
        each = np.arange(K)
        P[each, :n, each, :n] = self.P
        P[each, n, each, n] = self.v
        size = n_slots * (n + 1)
        return x.ravel(), P.reshape(size, size)


def unflat(x: Float, P: Float, n: int) -> SourceBeliefs:
    """Return the sources of a flat belief: those whose state is finite.

    Examples
    --------
    >>> one = SourceBeliefs(np.ones((1, 2)), np.eye(2)[None], np.ones(1), np.ones(1))
    >>> x, P = one.flat(2)
    >>> x, unflat(x, P, 2).u
    (array([ 1.,  1.,  1., nan, nan, nan]), array([1.]))
    """
    x = x.reshape(-1, n + 1)
    each = np.flatnonzero(np.isfinite(x).all(axis=1))
    blocks = P.reshape(len(x), n + 1, len(x), n + 1)[each, :, each]
    return SourceBeliefs(x[each, :n], blocks[:, :n, :n], x[each, n], blocks[:, n, n])


def transitions(motion: MotionModel, x: Float, dt: float) -> Float:
    """Return the Jacobians F at states (..., n): one matrix, if it is the same for all.

    Examples
    --------
    >>> transitions(RandomWalk(q=1.0), np.zeros((5, 3, 2)), 1.0).shape
    (2, 2)
    """
    if isinstance(motion, RandomWalk | ConstantVelocity | LinearMotion):
        return motion.F(None, dt)
    if x.size == 0:
        return np.eye(motion.dim_x)
    return at_each(motion.F, x, dt)


def empty(n: int) -> SourceBeliefs:
    """Return no source, of states of n entries."""
    return SourceBeliefs(np.zeros((0, n)), np.zeros((0, n, n)), np.zeros(0), np.zeros(0))


def where_finite(moved: SourceBeliefs, before: SourceBeliefs) -> SourceBeliefs:
    """Return a batch of beliefs after a step, and before it where something is not finite."""
    sound = np.ones(len(moved.u), dtype=np.bool_)
    for part in moved:
        sound &= np.isfinite(part).reshape(len(part), -1).all(axis=1)
    if sound.all():
        return moved
    return SourceBeliefs(*(
        np.where(sound.reshape(-1, *[1] * (new.ndim - 1)), new, old)
        for new, old in zip(moved, before, strict=True)
    ))  # fmt: skip
