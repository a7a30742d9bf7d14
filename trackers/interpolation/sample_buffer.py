"""What a filter that waits for later samples has heard: the newest snapshots, and their power."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class SampleBuffer:
    """The newest snapshots of independent recordings, and the energy of all of them.

    Parameters
    ----------
    frames : ndarray, shape (..., span, n_places)
        NaN where nothing was heard.
    energy, n_samples : ndarray, shape (...)
        Sum of squares of all samples so far, and how many they were.
    n_snapshots : int

    Examples
    --------
    >>> heard = SampleBuffer.nothing(span=2, n_places=3).then(np.array([2.0, np.nan, -2.0]))
    >>> heard.n_snapshots, heard.scaled(power=None, noise_ratio=0.0)[-1]
    (1, array([ 1., nan, -1.]))
    """

    frames: Float
    energy: Float
    n_samples: Float
    n_snapshots: int = 0

    @classmethod
    def nothing(cls, span: int, n_places: int) -> SampleBuffer:
        """Return what is known before the first snapshot."""
        return cls(np.full((span, n_places), np.nan), np.zeros(()), np.zeros(()))

    def copies(self, shape: tuple[int, ...]) -> SampleBuffer:
        """Return the same for recordings of leading axes `shape`."""
        frames = np.broadcast_to(self.frames, shape + self.frames.shape)
        energy, n_samples = (np.broadcast_to(a, shape) for a in (self.energy, self.n_samples))
        return SampleBuffer(frames, energy, n_samples, self.n_snapshots)

    def then(self, frame: Float) -> SampleBuffer:
        """Return what is known after another snapshot, (..., n_places)."""
        return SampleBuffer(
            np.concatenate([self.frames[..., 1:, :], frame[..., None, :]], axis=-2),
            self.energy + np.nansum(frame * frame, axis=-1),
            self.n_samples + np.isfinite(frame).sum(axis=-1),
            self.n_snapshots + 1,
        )

    def scaled(self, power: float | None, noise_ratio: float) -> Float:
        """Return the snapshots, scaled to a source of power 1.

        The source's `power` is given, or learned: the samples' mean power over 1 + ε.
        """
        if power is not None:
            return self.frames / math.sqrt(power)
        mean = self.energy / np.maximum(self.n_samples, 1) / (1 + noise_ratio)
        scale = np.sqrt(np.maximum(mean, np.finfo(float).tiny))[..., None, None]
        scaled: Float = self.frames / scale
        return scaled
