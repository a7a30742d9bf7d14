"""Time-frequency bins that count: louder than the noise, and onsets rather than echoes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.typing import Bool, Float

SILENCE_DB = -2900.0
FLOOR_OVER_MINIMUM_DB = 10 * float(np.log10(2.0))  # mean over the least of about ten snapshots


@dataclass(frozen=True, eq=False)
class BinLevels:
    """Noise floor and recent peak of each frequency bin.

    Parameters
    ----------
    floor, peak : ndarray, shape (n_bins,)
        Levels, dB; infinite and minus infinite before the first data.

    Examples
    --------
    >>> energy = np.array([[1.0, 1.0, 100.0, 50.0]])
    >>> levels, loud, onset = BinLevels.empty(1).after(energy, 0.064, MixtureSettings())
    >>> levels.floor.round(1), loud, onset
    (array([3.]), array([[False, False,  True,  True]]), array([[ True, False,  True, False]]))
    """

    floor: Float
    peak: Float

    @classmethod
    def empty(cls, n_bins: int) -> BinLevels:
        """Return the levels before the first data."""
        return cls(np.full(n_bins, np.inf), np.full(n_bins, -np.inf))

    def later(self, seconds: float, settings: MixtureSettings) -> BinLevels:
        """Return the levels after a time without data: the floor rises, the peak falls."""
        floor = self.floor + settings.floor_rise * seconds
        return BinLevels(floor, self.peak - settings.decay * seconds)

    def after(
        self, energy: Float, seconds: float, settings: MixtureSettings
    ) -> tuple[BinLevels, Bool, Bool]:
        """Return the levels after a step, and its loud snapshots and onsets.

        Parameters
        ----------
        energy : ndarray, shape (n_bins, n_snapshots)
            |z|² summed over the sensors; NaN of bins without data.
        seconds : float
            Duration of the step.
        settings : MixtureSettings
            Settings.

        Returns
        -------
        levels : BinLevels
            Levels at the end of the step.
        loud, onset : ndarray of bool, shape (n_bins, n_snapshots)
            Snapshots `floor_db` above the floor, that of this step included, and those `onset_db`
            above the highest level before them, which falls by `decay`.
        """
        n = energy.shape[1]
        level = 10 * np.log10(np.maximum(energy, 10 ** (SILENCE_DB / 10)))
        quietest = np.where(level > SILENCE_DB, level, np.inf).min(axis=1) + FLOOR_OVER_MINIMUM_DB
        later = self.later(seconds, settings)
        floor = np.minimum(later.floor, quietest)
        fall = settings.decay * seconds / n * np.arange(1, n + 1)
        # highest level before each snapshot, as it would have been at the start of the step
        history = np.concatenate([self.peak[:, None], level + fall], axis=1)
        highest = np.fmax.accumulate(history, axis=1)
        loud = level > floor[:, None] + settings.floor_db
        onset = level > highest[:, :-1] - fall + settings.onset_db
        levels = BinLevels(np.asarray(floor), np.asarray(highest[:, -1] - fall[-1]))
        return levels, np.asarray(loud), np.asarray(onset)
