"""Existence of the sources of a mixture, and which of them are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from arrivals.trackers.wideband.density_grid import DensityGrid
from arrivals.trackers.wideband.direction_grid import SMALLEST
from arrivals.trackers.wideband.mixture import Mixture, log_odds_gain
from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.tracked_sources import TrackedSources
from arrivals.typing import Int

CERTAIN = 1e-4  # least distance of an updated existence from 0 and 1


def updated(
    sources: TrackedSources,
    mixture: Mixture,
    grid: DensityGrid,
    settings: MixtureSettings,
    seconds: float,
) -> tuple[TrackedSources, Int]:
    """Return the sources after a step of some seconds, and their indices in the mixture.

    Existence gains the evidence of the step, an active or new source has the density of the
    mixture, and of two sources that are near one is left.
    """
    gain = log_odds_gain(mixture, sources.density, settings.tempering)
    predicted = np.clip(sources.existence, SMALLEST, 1 - np.finfo(float).eps)
    odds = np.log(predicted) - np.log1p(-predicted)
    odds = odds + np.clip(gain, -settings.max_loss * seconds, settings.max_gain)
    existence = np.clip(1 / (1 + np.exp(-np.clip(odds, -20, 20))), CERTAIN, 1 - CERTAIN)
    share = mixture.share[1:]
    decay = float(np.exp(-seconds / settings.unsupported))
    lower = np.maximum(decay * existence, np.minimum(existence, settings.unsupported_existence))
    existence = np.where(share < settings.min_share, lower, existence)
    sources = replace(sources, existence=existence)
    active = sources.active(settings)
    is_new = sources.label < 0
    density = np.where((active | is_new)[:, None], mixture.density, sources.density)
    peaks = density.argmax(axis=1) % len(grid.doa)
    found = mixture.density.argmax(axis=1) % len(grid.doa)
    kept: list[int] = []
    for i in np.lexsort((-share, is_new)):  # those with a label first, then by share
        is_near = bool((grid.distance[peaks[kept], found[i]] < settings.merge).any())
        if not (is_near and (active[i] or is_new[i])):
            kept.append(int(i))
    kept = sorted(kept, key=lambda i: -existence[i])[: settings.max_sources]
    index = np.array(kept, dtype=np.int64)
    return replace(sources, density=density).select(index), index
