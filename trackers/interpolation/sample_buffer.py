"""Buffer of the newest snapshots, with the estimate of their power."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.measurements import is_missing
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class SampleBuffer:
    """Newest snapshots of independent recordings, and the energy of all snapshots so far.

    Parameters
    ----------
    frames : ndarray, shape (..., span, n_grid_points)
        Snapshots on the grid of the line, the newest last; NaN where data are missing.
    energy, n_samples : ndarray, shape (...)
        Sum of squares and number of all samples so far.
    n_snapshots : int
        Number of snapshots so far.

    Examples
    --------
    >>> buffer = SampleBuffer.empty(span=2, n_grid_points=3).append(np.array([2.0, np.nan, -2.0]))
    >>> buffer.n_snapshots, buffer.scaled(power=None, noise_ratio=0.0)[-1]
    (1, array([ 1., nan, -1.]))
    """

    frames: Float
    energy: Float
    n_samples: Float
    n_snapshots: int = 0

    @classmethod
    def empty(cls, span: int, n_grid_points: int) -> SampleBuffer:
        """Return the buffer before the first snapshot."""
        return cls(np.full((span, n_grid_points), np.nan), np.zeros(()), np.zeros(()))

    def broadcast(self, shape: tuple[int, ...]) -> SampleBuffer:
        """Return the same buffer for recordings of leading axes `shape`."""
        frames = np.broadcast_to(self.frames, shape + self.frames.shape)
        energy, n_samples = (np.broadcast_to(a, shape) for a in (self.energy, self.n_samples))
        return SampleBuffer(frames, energy, n_samples, self.n_snapshots)

    def append(self, frame: Float) -> SampleBuffer:
        """Return the buffer after another snapshot, (..., n_grid_points)."""
        return SampleBuffer(
            np.concatenate([self.frames[..., 1:, :], frame[..., None, :]], axis=-2),
            self.energy + np.nansum(frame * frame, axis=-1),
            self.n_samples + np.isfinite(frame).sum(axis=-1),
            self.n_snapshots + 1,
        )

    def scaled(self, power: float | None, noise_ratio: float) -> Float:
        """Return the snapshots scaled to a source of power 1.

        A `power` of None is estimated: the mean power of the samples over 1 + ε.
        """
        if power is not None:
            return self.frames / math.sqrt(power)
        mean = self.energy / np.maximum(self.n_samples, 1) / (1 + noise_ratio)
        scale = np.sqrt(np.maximum(mean, np.finfo(float).tiny))[..., None, None]
        scaled: Float = self.frames / scale
        return scaled


def to_snapshot(z: ArrayLike | None, n: int) -> NDArray[Any]:
    """Return a snapshot as an array (n,), NaN if all of it is missing.

    Examples
    --------
    >>> to_snapshot(None, 2), to_snapshot([[1.0], [2.0]], 2)
    (array([nan, nan]), array([1., 2.]))
    """
    snapshot = np.asarray(np.nan if z is None else z)
    if snapshot.shape == (n,):
        return snapshot
    if is_missing(snapshot):
        return np.full(n, np.nan)
    if snapshot.shape != (n, 1):
        raise ValueError(f"a snapshot must have shape ({n},) or ({n}, 1); got {snapshot.shape}")
    return snapshot[:, 0]
