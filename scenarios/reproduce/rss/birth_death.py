"""Sources that appear and vanish: a tracker told nothing of them beside one told the truth."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.scenarios.metrics.gospa import Gospa, mean_gospa
from arrivals.scenarios.simulations.signal_strength import RSSTrial
from arrivals.trackers import RSSVB
from arrivals.trackers.rss.belief import SourceBeliefs
from arrivals.typing import Bool, Float

CUT_OFF = 10.0  # m: what is farther away is missed, and false


def gospa_over_time(trial: RSSTrial, positions: Float) -> Gospa:
    """Return GOSPA and its parts, p = 1, cut off at 10 m, the mean of the steps.

    Parameters
    ----------
    trial : RSSTrial
    positions : ndarray, shape (n_steps, n_slots, 2)
        What was found, m; NaN where nothing was.
    """
    return mean_gospa(trial.truth, positions, c=CUT_OFF)


def told_nothing(trial: RSSTrial, **params: Any) -> Float:
    """Return what `rss_vb` with births and deaths finds, (n_steps, n_slots, 2), m."""
    tracker = trial.tracker("rss_vb", births=True, **params)
    return np.asarray(tracker.run(trial.measurements).position)


def told_the_truth(trial: RSSTrial, start_std: float = 5.0, **params: Any) -> Float:
    """Return what `rss_vb` finds that is told when a source appears, about where, and vanishes.

    Parameters
    ----------
    trial : RSSTrial
    start_std : float
        Error that it may reckon with at first, each coordinate, m; it is told the true position.
    **params
        Of `RSSVB`.

    Returns
    -------
    ndarray, shape (n_steps, n_sources, 2)
    """
    on: Bool = np.isfinite(trial.truth[..., 0])
    found = np.full(trial.truth.shape, np.nan)
    tracker: RSSVB | None = None
    before = np.zeros(on.shape[1], dtype=np.bool_)
    for step, z in enumerate(trial.measurements):
        held = None if tracker is None else tracker.by_source()
        sources = _told(trial, step, held, before, start_std)
        before = on[step]
        if len(sources.u) == 0:
            tracker = None
            continue
        tracker = _tracker(trial, sources, params)
        tracker.update(z)
        found[step, on[step]] = tracker.estimate.position
        tracker.predict()
    return found


def _told(
    trial: RSSTrial, step: int, held: SourceBeliefs | None, before: Bool, start_std: float
) -> SourceBeliefs:
    """Return the beliefs in the sources that are on, in their order."""
    on = np.flatnonzero(np.isfinite(trial.truth[step, :, 0]))
    own = np.cumsum(before) - 1  # where each source of the last step stands in `held`
    P0 = trial.P0.copy()
    P0[::2, ::2] = start_std**2 * np.eye(2)
    beliefs = []
    for j in on:
        if before[j] and held is not None:
            beliefs.append(held.take(own[j]))
            continue
        x = np.zeros(4)
        x[::2] = trial.truth[step, j]
        beliefs.append(SourceBeliefs(x, P0, np.float64(trial.mu0), np.float64(trial.v0)))  # type: ignore[arg-type]  # stacked below
    if not beliefs:
        return SourceBeliefs(np.zeros((0, 4)), np.zeros((0, 4, 4)), np.zeros(0), np.zeros(0))
    return SourceBeliefs(*(np.stack(parts) for parts in zip(*beliefs, strict=True)))


def _tracker(trial: RSSTrial, sources: SourceBeliefs, params: dict[str, Any]) -> RSSVB:
    told = {"x0": sources.x, "P0": sources.P, "mu0": sources.u, "v0": sources.v}
    return RSSVB(trial.motion, trial.measurement, **told | params)
