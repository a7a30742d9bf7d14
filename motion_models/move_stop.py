"""A random walk that may stand still: two walks of different speed, mixed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import positive, time_step

TINY = 1e-300


class MixtureStep(NamedTuple):
    """Mixture of the modes after a prediction or an update.

    Parameters
    ----------
    shift, variance : ndarray, shape (...)
        Shift of the mixture's mean, and its variance.
    modes : ndarray, shape (3, ..., 2)
        As in `MoveStopWalk`.
    """

    shift: Float
    variance: Float
    modes: Float


@dataclass(frozen=True)
class MoveStopWalk(FrozenModel):
    """A walk with two modes, standing still and moving, each with its own Gaussian density.

    An exact bank of two Kalman filters of a scalar, as in the interacting multiple model (IMM)
    method: the mode stays or is drawn anew, and the densities of the modes are mixed accordingly.

    Parameters
    ----------
    still : float
        Probability, in (0, 1), of standing still when a mode is drawn.
    stay : float
        Probability that the mode stays for a unit of time, in (0, 1).
    slow : float
        Step of the mode that stands still, relative to that of the other.

    Raises
    ------
    ValueError
        If `still` or `stay` lies outside (0, 1), or `slow` is not positive.

    Notes
    -----
    `modes`, of shape (3, ..., 2), has the offsets of the modes' means from the mean of their
    mixture, their variances, and their weights; the last axis is (still, moving). Kalman-type
    filters have the same walk as `IMM` of two members, one with `slow`² times the noise of the
    other.

    References
    ----------
    Blom and Bar-Shalom, IEEE Transactions on Automatic Control 33(8), 1988.

    Examples
    --------
    >>> walk = MoveStopWalk()
    >>> modes = walk.initial(0.01)
    >>> for _ in range(20):                                 # the same place, again and again
    ...     _, _, modes = walk.predict(modes, step_variance=0.01)
    ...     _, variance, modes = walk.update(modes, deviation=0.0, noise=0.01)
    >>> bool(modes[2, 0] > 0.5), bool(variance < 0.005)     # it probably stands still
    (True, True)
    """

    still: float = 0.1
    stay: float = 0.98
    slow: float = 0.03

    def __post_init__(self) -> None:
        for name in ("still", "stay"):
            if not 0 < positive(name, getattr(self, name)) < 1:
                raise ValueError(f"{name} must lie in (0, 1); got {getattr(self, name)}")
        positive("slow", self.slow)

    @cached_property
    def weights(self) -> Float:
        """Weights of the modes when they are drawn."""
        return np.array([self.still, 1 - self.still])

    @cached_property
    def relative_variances(self) -> Float:
        """Variances of the modes' steps, relative to that of the moving one."""
        return np.array([self.slow**2, 1.0])

    def initial(self, variance: ArrayLike) -> Float:
        """Return the modes of new densities of given variances.

        Parameters
        ----------
        variance : array_like, shape (...)

        Returns
        -------
        ndarray, shape (3, ..., 2)
        """
        P = np.asarray(variance, dtype=np.float64)[..., None]
        return _modes(0.0, P, self.weights, P.shape[:-1])

    def renewed(self, modes: Float, variance: ArrayLike) -> Float:
        """Return modes, initial ones where their mixture does not have this variance.

        Parameters
        ----------
        modes : ndarray, shape (3, ..., 2)
        variance : array_like, shape (...)

        Returns
        -------
        ndarray, shape (3, ..., 2)
        """
        variance = np.asarray(variance, dtype=np.float64)
        differs = np.abs(_moments(*modes)[1][..., 0] - variance) > 1e-6 * variance
        if not differs.any():
            return modes
        return np.where(differs[..., None], self.initial(variance), modes)

    def predict(self, modes: Float, step_variance: ArrayLike, dt: float = 1.0) -> MixtureStep:
        """Mix the modes and widen their densities.

        Parameters
        ----------
        modes : ndarray, shape (3, ..., 2)
        step_variance : array_like, shape (...)
            Variance of the moving mode's step per unit of time.
        dt : float
            Length of the step.

        Returns
        -------
        MixtureStep
        """
        o, P, w = modes
        s, omega = self.stay ** time_step(dt), self.weights
        # c_k = Σ Π_jk w_j = s w_k + (1 - s) ω_k
        c = np.maximum(s * w + (1 - s) * omega, TINY)
        mean, variance = _moments(o, P, w)
        kept, drawn = s * w / c, (1 - s) * omega / c
        # o_k, P_k: moments of the mixture that leads to mode k, then its step
        o_k = kept * o + drawn * mean
        P_k = kept * (P + (o - o_k) ** 2) + drawn * (variance + (mean - o_k) ** 2)
        q = np.asarray(step_variance, dtype=np.float64)[..., None] * self.relative_variances
        P_k = P_k + q * dt
        shift, variance = _moments(o_k, P_k, c)
        return MixtureStep(
            shift[..., 0], variance[..., 0], _modes(o_k - shift, P_k, c, P_k.shape[:-1])
        )

    def update(self, modes: Float, deviation: ArrayLike, noise: ArrayLike) -> MixtureStep:
        """Update the modes by a measurement.

        Parameters
        ----------
        modes : ndarray, shape (3, ..., 2)
        deviation : array_like, shape (...)
            Measurement minus the mixture's mean.
        noise : array_like, shape (...)
            Variance of the measurement.

        Returns
        -------
        MixtureStep
        """
        o, P, w = modes
        delta, R = (np.asarray(each, dtype=np.float64)[..., None] for each in (deviation, noise))
        # S_k = P_k + R,  e_k = δ - o_k,  w_k ∝ w_k N(e_k; 0, S_k)
        S, e = P + R, delta - o
        log_w = np.log(np.maximum(w, TINY)) - 0.5 * (np.log(S) + e**2 / S)
        w = np.exp(log_w - log_w.max(axis=-1, keepdims=True))
        w = w / w.sum(axis=-1, keepdims=True)
        # o_k += P_k/S_k e_k,  P_k = P_k R/S_k
        o, P = o + P / S * e, P * R / S
        shift, variance = _moments(o, P, w)
        return MixtureStep(shift[..., 0], variance[..., 0], _modes(o - shift, P, w, P.shape[:-1]))


def _modes(o: Float | float, P: Float, w: Float, shape: tuple[int, ...]) -> Float:
    """Return offsets, variances and weights of densities of a shape as one array, (3, ..., 2)."""
    modes = np.empty((3, *shape, 2))  # faster than np.stack
    modes[0], modes[1], modes[2] = o, P, w
    return modes


def _moments(o: Float, P: Float, w: Float) -> tuple[Float, Float]:
    """Return mean and variance of mixtures, (..., 1)."""
    # two modes: plain additions are faster than sums over an axis
    mean = w[..., :1] * o[..., :1] + w[..., 1:] * o[..., 1:]
    second = w * (P + (o - mean) ** 2)
    return mean, second[..., :1] + second[..., 1:]
