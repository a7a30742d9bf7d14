"""Belief of the sources: state and log amplitude of each."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from arrivals.messages import shown
from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.arguments import overrides
from arrivals.trackers.gaussian.circular import wrapped
from arrivals.trackers.gaussian.equations import predict_gaussian, smooth_gaussian
from arrivals.trackers.gaussian.linalg import inverse_2x2
from arrivals.trackers.gaussian.linearization import at_each
from arrivals.trackers.rss.inference.joint_posterior import Prior
from arrivals.trackers.rss.inference.solution import Marginals
from arrivals.typing import Float
from arrivals.validation import LARGEST

Entries = tuple[int, int]


class SourceBeliefs(NamedTuple):
    """Independent Gaussian beliefs of the sources; leading axes are batch axes.

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

    @classmethod
    def empty(cls, n: int) -> SourceBeliefs:
        """Return no source, with states of n entries."""
        return cls(np.zeros((0, n)), np.zeros((0, n, n)), np.zeros(0), np.zeros(0))

    @classmethod
    def from_state(cls, x: Float, P: Float, n: int) -> SourceBeliefs:
        """Return the sources of a mean and covariance from `to_state`: those with a finite state.

        Examples
        --------
        >>> one = SourceBeliefs(np.ones((1, 2)), np.eye(2)[None], np.ones(1), np.ones(1))
        >>> x, P = one.to_state(2)
        >>> x, SourceBeliefs.from_state(x, P, 2).u
        (array([ 1.,  1.,  1., nan, nan, nan]), array([1.]))
        """
        if x.size % (n + 1) or P.size != x.size**2:
            shapes = f"{x.shape} and {P.shape}"
            raise ValueError(f"x and P must have {n + 1} entries a source; got shapes {shapes}")
        if not (np.abs(P) < LARGEST).all():
            raise ValueError(f"P must be finite and below {LARGEST:g}; got {shown(P)}")
        if (np.abs(x) >= LARGEST).any():
            raise ValueError(f"x must be finite, or NaN in unused slots; got {shown(x)}")
        x = x.reshape(-1, n + 1)
        each = np.flatnonzero(np.isfinite(x).all(axis=1))
        blocks = P.reshape(len(x), n + 1, len(x), n + 1)[each, :, each]
        return cls(x[each, :n], blocks[:, :n, :n], x[each, n], blocks[:, n, n])

    def to_state(self, n_slots: int) -> tuple[Float, Float]:
        """Return one mean and one covariance: state, then u, source by source.

        Unused slots are NaN and 0. The only leading axis is that of the sources.
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

    def select(self, rows: Any) -> SourceBeliefs:
        """Return the beliefs at some rows of the first axis."""
        return SourceBeliefs(*(part[rows] for part in self))

    def joined(self, others: SourceBeliefs) -> SourceBeliefs:
        """Return these and other beliefs, along the first axis."""
        return SourceBeliefs(*(np.concatenate(parts) for parts in zip(self, others, strict=True)))

    def replaced(self, rows: Any, others: SourceBeliefs) -> SourceBeliefs:
        """Return a copy with other beliefs at some rows of the first axis."""
        parts = SourceBeliefs(*(part.copy() for part in self))
        for part, new in zip(parts, others, strict=True):
            part[rows] = new
        return parts

    def predicted(self, motion: MotionModel, dt: float, drift: float) -> SourceBeliefs:
        """Return the beliefs after `dt`, log amplitudes with the variance `drift` per unit time."""
        F = transition_matrices(motion, self.x, dt)
        # P = F P F' + Q
        P = predict_gaussian(self.P, F, motion.Q(dt))
        # x = f(x), v = v + q_u dt
        return SourceBeliefs(motion.f(self.x, dt), P, self.u, self.v + drift * dt)

    def prior(self, position: Entries) -> Prior:
        """Return the prior of log amplitudes and positions."""
        P = self.P[..., position, :][..., position]
        return Prior(self.u, 1 / self.v, self.x[..., position], inverse_2x2(P))

    def updated(
        self,
        u: Float,
        theta: Float,
        moments: Marginals,
        position: Entries,
        motion: MotionModel,
    ) -> SourceBeliefs:
        """Return the beliefs after an update of log amplitudes and positions.

        A reading depends on the position only, so the update of the other entries is exact.

        Parameters
        ----------
        u, theta : ndarray, shape (..., n_sources), (..., n_sources, 2)
            New means of log amplitudes and positions.
        moments : Marginals
            Their variances and covariances.
        position : tuple of two int
            Entries of a state that are the position.
        motion : MotionModel
            Its angles are wrapped.

        Examples
        --------
        A position known exactly determines half of a correlated entry:

        >>> from arrivals.motion_models import RandomWalk
        >>> walk = RandomWalk(q=1.0, n_dims=3)
        >>> P = np.array([[[1.0, 0.0, 0.5], [0.0, 1.0, 0.0], [0.5, 0.0, 1.0]]])
        >>> before = SourceBeliefs(np.zeros((1, 3)), P, np.zeros(1), np.ones(1))
        >>> exact = Marginals(np.ones(1), np.zeros((1, 2, 2)))
        >>> before.updated(np.zeros(1), np.array([[2.0, 0.0]]), exact, (0, 1), walk).x
        array([[2., 0., 1.]])
        """
        P_theta = self.P[..., :, position]
        P_theta_theta = P_theta[..., position, :]
        # G = P_:θ P_θθ⁻¹
        G = P_theta @ inverse_2x2(P_theta_theta)
        G[..., position, :] = np.eye(2)  # exactly, also where P is so large that Σ is rounded off
        # x = x + G (θ - x_θ), P = P + G (Σ - P_θθ) G'
        x, P = smooth_gaussian(
            self.x, self.P, G, theta - self.x[..., position], moments.Sigma - P_theta_theta
        )
        entries = np.array(position)
        P[..., entries[:, None], entries] = moments.Sigma  # exact, however wide P_θθ was
        x[..., position] = theta
        if overrides(type(motion), MotionModel, "angles"):
            x = wrapped(x, motion.angles)
        return SourceBeliefs(x, P, u, moments.v)


def transition_matrices(motion: MotionModel, x: Float, dt: float) -> Float:
    """Return the Jacobians F at states (..., n): one matrix if it is the same for all states.

    Examples
    --------
    >>> from arrivals.motion_models import RandomWalk
    >>> transition_matrices(RandomWalk(q=1.0), np.zeros((5, 3, 2)), 1.0).shape
    (2, 2)
    """
    if motion.is_linear:
        return motion.F(x, dt)
    if x.size == 0:
        return np.eye(motion.dim_x)
    return at_each(motion.F, x, dt)


def keep_finite(after: SourceBeliefs, before: SourceBeliefs) -> SourceBeliefs:
    """Return a batch of beliefs after a step, and those before it where one is not finite."""
    finite = np.ones(len(after.u), dtype=np.bool_)
    for part in after:
        finite &= np.isfinite(part).reshape(len(part), -1).all(axis=1)
    if finite.all():
        return after
    return SourceBeliefs(*(
        np.where(finite.reshape(-1, *[1] * (new.ndim - 1)), new, old)
        for new, old in zip(after, before, strict=True)
    ))  # fmt: skip
