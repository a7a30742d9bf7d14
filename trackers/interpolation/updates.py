"""How one snapshot corrects what is known of a delay: from neighbour to neighbour, or all at once.

Both work on beliefs x (..., dim_x), P (..., dim_x, dim_x) with the delay Δ as element 0, and on
any leading axes: many independent filters are one array program. What was not heard is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.delays.delay_line import SourceAtCentre
from arrivals.measurement_models.delays.interpolation import InterpolationDelay
from arrivals.trackers.gaussian.linalg import symmetric
from arrivals.typing import Bool, Float


def move(x: Float, P: Float, F: Float, Q: Float) -> tuple[Float, Float]:
    """Predict beliefs: F x and F P Fᵀ + Q, kept symmetric to the last bit.

    Examples
    --------
    >>> move(np.ones(1), np.eye(1), np.full((1, 1), 2.0), np.eye(1))
    (array([2.]), array([[5.]]))
    """
    return (F @ x[..., None])[..., 0], symmetric(F @ P @ F.T + Q)


def fuse(x: Float, P: Float, e: Float, H: Float, R: Float) -> tuple[Float, Float]:
    """Correct beliefs by residuals e, (..., n), that see element 0 alone, with slopes H.

    The n residuals are independent, of one variance R (...); together they are one scalar
    measurement of the information i = Σ H²/R:

        K = P₀ / (1 + i P₀₀),    x ← x + K Σ He/R,    P ← P - i K P₀ᵀ

    Examples
    --------
    >>> x, P = fuse(np.zeros(1), np.eye(1), np.array([1.0]), np.array([1.0]), np.array(1.0))
    >>> x, P
    (array([0.5]), array([[0.5]]))
    """
    i = (H * H).sum(axis=-1) / R
    gradient = (H * e).sum(axis=-1) / R
    K = P[..., 0] / (1 + i * P[..., 0, 0])[..., None]
    x = x + K * gradient[..., None]
    return x, P - (i[..., None] * K)[..., :, None] * P[..., None, 0, :]


def kept(e: Float, variance: Float, gate: float | None) -> Bool:
    """Tell which residuals to use: those that are there, and within `gate` standard deviations.

    Examples
    --------
    >>> kept(np.array([0.1, np.nan, 5.0]), np.ones(3), gate=3.0)
    array([ True, False, False])
    """
    inside = np.isfinite(e)
    return inside if gate is None else inside & (e * e <= gate**2 * variance)


class DelayObservation(NamedTuple):
    """What a snapshot says of a state, to first order: one residual y = H d + v for each sensor."""

    y: Float  # (..., n_sensors), 0 where a sensor says nothing
    H: Float  # (..., n_sensors, dim_x), 0 there too
    R: Float  # variances of v, (..., n_sensors)


@dataclass(frozen=True)
class PairwiseUpdate:
    """Corrections along the array: each sensor is foretold from one `baseline` away.

    Parameters
    ----------
    looks : sequence of InterpolationDelay
        Used one after the other, each at the newest snapshot for which it has all taps.
    kappa : float
        The delay is clipped to ±κ.
    highest : float
        Highest frequency of the source, cycles per sample.
    each_sensor : bool
        Coefficients are taken at the newest delay for every sensor, as in the specification's
        reference recursion; if false, once for all sensors of a look (a vector update, in which
        e - H (Δ - Δ₀) is the linear correction).
    aligned : bool
        All looks treat the same snapshot, that of the longest latency.
    gate : float, optional
        Standard deviations beyond which a residual is dropped.
    """

    looks: tuple[InterpolationDelay, ...]
    kappa: float
    highest: float
    each_sensor: bool = False
    aligned: bool = False
    gate: float | None = None
    phase_limit: float = 0.35

    @property
    def latency(self) -> int:
        """Snapshots by which the estimate may lag."""
        return max(look.latency for look in self.looks)

    @property
    def span(self) -> int:
        """Snapshots that must be kept."""
        return self.latency + 1 + max(look.memory for look in self.looks)

    def update(self, x: Float, P: Float, frames: Float) -> tuple[Float, Float]:
        """Correct beliefs by the newest of `frames`, (..., span or more, n_sensors)."""
        newest = frames.shape[-2] - 1
        for look in self.looks:
            z, X = look.split(frames, newest - (self.latency if self.aligned else look.latency))
            step = 1 if self.each_sensor else look.dim_z
            for first in range(0, look.dim_z, step):
                sensors = slice(first, first + step)
                x, P = fuse(x, P, *self._residuals(x, P, look, z[..., sensors], X[..., sensors, :]))
                x[..., 0] = np.clip(x[..., 0], -self.kappa, self.kappa)
        return x, P

    def linearise(self, x: Float, P: Float, frames: Float) -> DelayObservation:
        """Return what the newest of `frames` says near beliefs, all looks of a sensor as one.

        The looks l of a sensor have residuals e, slopes h and variances r. Of the delay they say
        as much as one residual y with the slope H and the variance R of the first look, where
        H² / R = Σ h² / r and H y / R = Σ h e / r.
        """
        newest = frames.shape[-2] - 1
        information, gradient, sign = np.zeros((3, *frames.shape[:-2], frames.shape[-1]))
        R = self.looks[0].linearise(x[..., 0])[1][..., None]
        for look in self.looks:
            z, X = look.split(frames, newest - (self.latency if self.aligned else look.latency))
            e, h, r = self._residuals(x, P, look, z, X)
            sensors = slice(max(look.baseline, 0), max(look.baseline, 0) + look.dim_z)
            information[..., sensors] += h * h / r[..., None]
            gradient[..., sensors] += h * e / r[..., None]
            sign[..., sensors] += (sign[..., sensors] == 0) * np.sign(h)
        slope = sign * np.sqrt(information * R)
        heard = slope != 0
        y = np.where(heard, gradient * R / np.where(heard, slope, 1.0), 0.0)
        H = np.zeros((*slope.shape, x.shape[-1]))
        H[..., 0] = slope
        return DelayObservation(y, H, R + np.zeros_like(y))

    def _residuals(
        self, x: Float, P: Float, look: InterpolationDelay, z: Float, X: Float
    ) -> tuple[Float, Float, Float]:
        """Return residuals, slopes and variance of a look; 0 where one is not used."""
        taps, R = look.linearise(x[..., 0])
        foretold = taps @ np.swapaxes(X, -1, -2)  # X c and X c', (..., 2, n)
        e, H = z - foretold[..., 0, :], look.baseline * foretold[..., 1, :]
        used = kept(e, H * H * P[..., :1, 0] + R[..., None], self.gate)
        used &= self._unambiguous(look.baseline, P)[..., None]
        return np.where(used, e, 0.0), np.where(used, H, 0.0), R

    def _unambiguous(self, baseline: int, P: Float) -> Bool:
        """Tell where a longer baseline's phase is known well enough to be no cycle off."""
        if abs(baseline) == 1:
            return np.ones(P.shape[:-2], dtype=np.bool_)
        phase_std = 2 * np.pi * self.highest * abs(baseline) * np.sqrt(P[..., 0, 0])
        return np.asarray(phase_std < self.phase_limit)


@dataclass(frozen=True)
class JointUpdate:
    """One vector correction by all sensors, the source's waveform being part of the state.

    Parameters
    ----------
    line : SourceAtCentre
    kappa, gate
        As in `PairwiseUpdate`.
    """

    line: SourceAtCentre
    kappa: float
    gate: float | None = None

    latency = 0
    span = 1

    def update(self, x: Float, P: Float, frames: Float) -> tuple[Float, Float]:
        """Correct beliefs by the newest of `frames`, (..., span or more, n_sensors)."""
        e, H, R = self.linearise(x, P, frames)
        HP = H @ P
        S = HP @ np.swapaxes(H, -1, -2) + R[..., None] * np.eye(R.shape[-1])
        K = np.swapaxes(np.linalg.solve(S, HP), -1, -2)
        x = x + (K @ e[..., None])[..., 0]
        I_KH = np.eye(x.shape[-1]) - K @ H
        P = I_KH @ P @ np.swapaxes(I_KH, -1, -2) + (K * R[..., None, :]) @ np.swapaxes(K, -1, -2)
        x[..., 0] = np.clip(x[..., 0], -self.kappa, self.kappa)
        return x, symmetric(P)

    def linearise(self, x: Float, P: Float, frames: Float) -> DelayObservation:
        """Return what the newest of `frames` says near beliefs."""
        h, H, R = self.line.linearise(x)
        e = frames[..., -1, :] - h
        used = kept(e, ((H @ P) * H).sum(axis=-1) + R, self.gate)
        return DelayObservation(np.where(used, e, 0.0), np.where(used[..., None], H, 0.0), R)
