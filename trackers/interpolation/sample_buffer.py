"""Buffer of the newest snapshots, with what is learned of their power and their residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.measurements import real_numbers
from arrivals.trackers.interpolation.channel_filters import ChannelFilters
from arrivals.typing import Bool, Float

if TYPE_CHECKING:
    from arrivals.trackers.interpolation.interpolation_ekf import InterpolationEKF

ACQUISITION = 30  # snapshots before residuals are gated: the belief is not consistent yet
LEARNING = 30, 60  # samples before outliers are limited; snapshots in which the power can fall


@dataclass(frozen=True, eq=False)
class SampleBuffer:
    """Newest snapshots of independent recordings, and the energy of all snapshots so far.

    Parameters
    ----------
    frames : ndarray, shape (..., span, n_grid_points)
        Snapshots on the grid of the line, the newest last; NaN where data are missing.
    energy, n_samples : ndarray, shape (...)
        Sum of squares of all samples so far, outliers limited, and their number.
    misfit : ndarray, shape (...)
        That of `gating.updated_misfit`; infinite until there are samples enough for a gate.
    missing : ndarray of bool, shape (...)
        True if no sample of the newest snapshot is left, and of an earlier one is.
    n_snapshots : int
        Number of snapshots so far.

    Examples
    --------
    >>> buffer = SampleBuffer.empty(span=2, n_grid_points=3).append(np.array([2.0, np.nan, -2.0]))
    >>> buffer.n_snapshots, buffer.frames[-1], float(buffer.energy)
    (1, array([ 2., nan, -2.]), 8.0)
    """

    frames: Float
    energy: Float
    n_samples: Float
    misfit: Float
    missing: Bool
    n_snapshots: int = 0

    @classmethod
    def empty(cls, span: int, n_grid_points: int) -> SampleBuffer:
        """Return the buffer before the first snapshot."""
        zero, frames = np.zeros(()), np.full((span, n_grid_points), np.nan)
        return cls(frames, zero, zero, zero + np.inf, zero > 0)

    def broadcast(self, shape: tuple[int, ...]) -> SampleBuffer:
        """Return the same buffer for recordings of leading axes `shape`."""
        arrays = {
            name: np.broadcast_to(value, shape + value.shape)
            for name, value in vars(self).items()
            if name != "n_snapshots"
        }
        return SampleBuffer(**arrays, n_snapshots=self.n_snapshots)

    def append(
        self, frame: Float, gate: float | None = None, power: float | None = None
    ) -> SampleBuffer:
        """Return the buffer after another snapshot, (..., n_grid_points).

        Samples beyond `2 gate` times the root of their mean power are missing; that power is at
        least `power`, and follows a lasting change.
        """
        square, energy = frame * frame, self.energy
        if gate is not None:
            factor = min(2 * gate, 1e30) ** 2
            if power is None:
                mean = energy / np.maximum(self.n_samples, 1)
                suspect = square > (factor * mean)[..., None]
            else:
                suspect = square > factor * power
            if suspect.any():
                limit = factor * self._level(power)[..., None]
                frame, square = np.where(square > limit, np.nan, frame), np.minimum(square, limit)
            if self.n_snapshots < LEARNING[1] and power is None:
                # the first samples were outliers, or silence
                quiet = np.nanmax(square, axis=-1, initial=0.0) * factor**2 < mean
                energy = np.where(quiet, energy / 2, energy)
        valid = np.isfinite(frame)
        complete = bool(valid.all())
        n_valid = np.full(valid.shape[:-1], valid.shape[-1]) if complete else valid.sum(axis=-1)
        n_samples, misfit = self.n_samples + n_valid, self.misfit
        if not (misfit < np.inf).all():
            enough = n_samples >= ACQUISITION * frame.shape[-1]
            misfit = np.where(enough & np.isinf(misfit), 1.0, misfit)
        if complete:
            received, missing = square.sum(axis=-1), np.zeros(n_valid.shape, dtype=np.bool_)
        else:
            received, missing = np.nansum(square, axis=-1), (n_valid == 0) & (n_samples > 0)
        return SampleBuffer(
            np.concatenate([self.frames[..., 1:, :], frame[..., None, :]], axis=-2),
            energy + received, n_samples, misfit, missing, self.n_snapshots + 1,
        )  # fmt: skip

    def _level(self, power: float | None) -> Float:
        """Return the power above which samples are outliers, over the factor; ∞ if unknown."""
        mean = self.energy / np.maximum(self.n_samples, 1)
        if power is None:
            return np.where(self.n_samples < LEARNING[0], np.inf, mean)
        return np.maximum(mean, power)

    def with_misfit(self, misfit: Float) -> SampleBuffer:
        """Return the buffer with another `misfit`."""
        if misfit is self.misfit:
            return self
        return replace(self, misfit=misfit)

    def scaled(self, measurement: ArraySamples) -> Float:
        """Return the snapshots scaled to a source of power 1.

        Without a power of the model it is estimated: the mean power of the samples over 1 + ε.
        """
        if measurement.power is not None:
            return self.frames / math.sqrt(measurement.power)
        noise_ratio = measurement.received_noise_ratio
        mean = self.energy / np.maximum(self.n_samples, 1) / (1 + noise_ratio)
        scale = np.sqrt(np.maximum(mean, np.finfo(float).tiny))[..., None, None]
        scaled: Float = self.frames / scale
        return scaled


def receive(
    tracker: InterpolationEKF, channels: ChannelFilters, buffer: SampleBuffer, z: Float
) -> tuple[ChannelFilters, SampleBuffer]:
    """Return the states of channels and samples after snapshots, (..., n_sensors)."""
    measurement, gate = tracker.measurement, tracker.gate
    channels, z = channels.accept(z, gate)
    power = measurement.power
    if power is not None:
        power *= 1 + measurement.received_noise_ratio
    return channels, buffer.append(measurement.on_grid(z), gate, power)


def to_snapshot(z: ArrayLike | None, n: int) -> Float:
    """Return a snapshot as an array (n,), NaN where it is missing.

    Examples
    --------
    >>> to_snapshot(None, 2), to_snapshot([[1.0], [2.0]], 2)
    (array([nan, nan]), array([1., 2.]))
    """
    snapshot = real_numbers("z", np.nan if z is None else z)
    if snapshot.shape == (n,):
        return snapshot
    if snapshot.size > 0 and np.isnan(snapshot).all():
        return np.full(n, np.nan)
    if snapshot.shape != (n, 1):
        raise ValueError(f"a snapshot must have shape ({n},) or ({n}, 1); got {snapshot.shape}")
    return snapshot[:, 0]
