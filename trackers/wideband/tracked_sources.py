"""Tracked sources of a mixture: densities on a grid, existence, labels, ages."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.typing import Bool, Float, Int


@dataclass(frozen=True, eq=False)
class TrackedSources:
    """Tracked sources, active or not.

    Parameters
    ----------
    density : ndarray, shape (n, n_points)
        Probability of each point of the grid.
    existence : ndarray, shape (n,)
        Probability of being active.
    label : ndarray of int, shape (n,)
        Identity; -1 before a source is first reported.
    age : ndarray, shape (n,)
        Time since it was last active, s.

    Examples
    --------
    >>> TrackedSources.none(120).n
    0
    """

    density: Float
    existence: Float
    label: Int
    age: Float

    @classmethod
    def none(cls, n_points: int) -> TrackedSources:
        """Return no source on a grid."""
        return cls(np.zeros((0, n_points)), np.zeros(0), np.zeros(0, np.int64), np.zeros(0))

    @property
    def n(self) -> int:
        """Number of sources."""
        return len(self.label)

    def select(self, index: Int) -> TrackedSources:
        """Return some of the sources, by index or mask."""
        return TrackedSources(
            self.density[index], self.existence[index], self.label[index], self.age[index]
        )

    def with_new(self, existence: float) -> TrackedSources:
        """Return the sources and a new one of uniform density."""
        G = self.density.shape[1]
        return TrackedSources(
            np.concatenate([self.density, np.full((1, G), 1 / G)]),
            np.append(self.existence, existence),
            np.append(self.label, -1),
            np.append(self.age, 0.0),
        )

    def relocated(self, probability: float) -> TrackedSources:
        """Return the sources after inactive ones may have moved anywhere."""
        p = np.where(self.age > 0, probability, 0.0)[:, None]
        return replace(self, density=(1 - p) * self.density + p / self.density.shape[1])

    def remembered(self, settings: MixtureSettings) -> Int:
        """Return the indices of those that were active lately."""
        limit = np.where(self.label >= 0, settings.memory, settings.confirm)
        return np.flatnonzero(self.age <= limit * (1 + 1e-9))

    def active(self, settings: MixtureSettings) -> Bool:
        """Return which sources are active, (n,)."""
        return np.asarray(self.existence >= settings.min_existence)

    def labelled(self, n_labels: int, settings: MixtureSettings) -> TrackedSources:
        """Return the sources with the next labels for active ones that have none; age 0."""
        active = self.active(settings)
        new = active & (self.label < 0)
        label = np.where(new, n_labels - 1 + np.cumsum(new), self.label)
        return replace(self, label=label, age=np.where(active, 0.0, self.age))
