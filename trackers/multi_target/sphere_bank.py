"""Bank of Kalman filters on the sphere, each in the tangent plane at its direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from arrivals.motion_models.base import MotionModel
from arrivals.trackers.gaussian.equations import predict_gaussian, update_gaussian
from arrivals.trackers.multi_target.track_bank import TrackBank
from arrivals.typing import Float, Int

TINY = np.finfo(np.float64).tiny


def offsets(u: Float, v: Float) -> Float:
    """Return the tangent vectors at u (..., 3) that lead to v along great circles, rad.

    Examples
    --------
    >>> offsets(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])).round(4)
    array([0.    , 0.    , 1.5708])
    """
    along = (u * v).sum(axis=-1, keepdims=True)
    across = v - along * u
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    return np.asarray(across * np.arctan2(length, along) / np.maximum(length, TINY))


def moved(u: Float, step: Float, others: Float) -> tuple[Float, Float]:
    """Return directions after tangent steps, and other tangent vectors carried along.

    Parameters
    ----------
    u, step : ndarray, shape (n, 3)
        Unit vectors, and steps along great circles, rad.
    others : ndarray, shape (n, m, 3)
        Tangent vectors at u.

    Returns
    -------
    v : ndarray, shape (n, 3)
        Unit vectors.
    others : ndarray, shape (n, m, 3)
        Tangent vectors at v, by parallel transport.

    Examples
    --------
    >>> east, up = np.eye(3)[1:]
    >>> v, carried = moved(np.eye(3)[:1], np.pi / 2 * east[None], np.stack([east, up])[None])
    >>> v.round(4) + 0, carried[0].round(4) + 0
    (array([[0., 1., 0.]]), array([[-1.,  0.,  0.],
           [ 0.,  0.,  1.]]))
    """
    length = np.linalg.norm(step, axis=-1, keepdims=True)
    v = np.cos(length) * u + np.sinc(length / np.pi) * step
    v = v / np.linalg.norm(v, axis=-1, keepdims=True)
    middle = u + v  # zero after half a turn, which no step makes
    share = (others @ v[..., None]) / np.maximum((middle * v).sum(axis=-1), TINY)[:, None, None]
    return np.asarray(v), np.asarray(others - share * middle[:, None])


@dataclass(frozen=True, eq=False)
class SphereBank(TrackBank):
    """Tracks on the sphere: the same linear motion along both axes of the tangent plane.

    Measurements have the same variance along both axes, so that one covariance serves both.

    Parameters
    ----------
    mean : ndarray, shape (n_slots, n, 3)
        Unit vector, then the other entries of the state as tangent vectors. NaN in free slots.
    covariance, label, hits, misses, n_labels
        As in `TrackBank`.
    normal : ndarray, shape (3,), or None
        Of the plane above which directions lie: one that leads below is mirrored.

    Examples
    --------
    >>> from arrivals.motion_models import ConstantVelocity
    >>> bank = SphereBank.empty(2, 2).add(np.eye(3)[:1], 0.01 * np.eye(2))
    >>> bank = bank.predict(ConstantVelocity(q=0.01, n_dims=1), 1.0)
    >>> bank = bank.update(np.array([0]), np.array([[0.0, 0.1, 0.0]]), 0.01)
    >>> bank.mean[0].round(3)
    array([[ 0.998,  0.07 ,  0.   ],
           [-0.003,  0.045,  0.   ]])
    """

    normal: Float | None = None

    @classmethod
    def empty(cls, n_slots: int, n: int) -> Self:
        """Return a bank without tracks."""
        flat = super().empty(n_slots, n)
        return replace(flat, mean=np.full((n_slots, n, 3), np.nan))

    def predict(self, motion: MotionModel, dt: float) -> Self:
        """Return the bank after a step of a linear motion, so far without a measurement."""
        F, used = motion.F(np.zeros(motion.dim_x), dt), self.used
        P = predict_gaussian(self.covariance[used], F, motion.Q(dt))
        mean = self.mean[used]
        # the direction is the origin of its tangent plane
        step = F[:, 1:] @ mean[:, 1:]
        predicted = self.replace_slots(used, mean=self._moved(mean[:, 0], step), covariance=P)
        return replace(predicted, misses=self.misses + used)

    def update(self, slots: Int, residual: Float, variance: float) -> Self:
        """Return the bank after a measurement of some tracks; residuals are tangent vectors."""
        H, R = np.eye(1, self.mean.shape[1]), np.full((1, 1), variance)
        still, one = np.zeros(self.mean[slots].shape[:2]), np.ones((len(slots), 1))
        updated = update_gaussian(still, self.covariance[slots], one, H, R)
        mean = self.mean[slots]
        step = updated.x[..., None] * residual[:, None]  # K y
        step[:, 1:] += mean[:, 1:]
        return self.replace_slots(
            slots,
            mean=self._moved(mean[:, 0], step),
            covariance=updated.P,
            hits=self.hits[slots] + 1,
            misses=0,
        )

    def _moved(self, u: Float, step: Float) -> Float:
        """Return means (n, n_entries, 3) at directions u after steps of all entries."""
        v, others = moved(u, step[:, 0], step[:, 1:])
        mean = np.concatenate([v[:, None], others], axis=1)
        if self.normal is not None:
            below = v @ self.normal < 0
            mean[below] -= 2 * (mean[below] @ self.normal)[..., None] * self.normal
        return mean
