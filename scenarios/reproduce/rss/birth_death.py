"""Sources that appear and disappear: tracking with unknown and with known births."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.scenarios.metrics.gospa import Gospa, mean_gospa
from arrivals.scenarios.simulations.signal_strength import RSSTrial
from arrivals.trackers import RSSVB, AmplitudePrior
from arrivals.trackers.rss.belief import SourceBeliefs
from arrivals.typing import Bool, Float

CUT_OFF = 10.0  # m: a larger distance counts as a missed and a false source


def gospa_over_time(trial: RSSTrial, positions: Float) -> Gospa:
    """Return the mean GOSPA metric of the steps and its parts, p = 1, cut-off 10 m.

    Parameters
    ----------
    trial : RSSTrial
    positions : ndarray, shape (n_steps, n_slots, 2)
        Estimated positions, m; NaN in unused slots.
    """
    return mean_gospa(trial.truth, positions, c=CUT_OFF)


def track_unknown_births(trial: RSSTrial, **params: Any) -> Float:
    """Return positions by `rss_vb` with births and deaths, (n_steps, n_slots, 2), m."""
    tracker = trial.tracker("rss_vb", births=True, **params)
    return np.asarray(tracker.run(trial.measurements).position)


def track_known_births(trial: RSSTrial, start_std: float = 5.0, **params: Any) -> Float:
    """Return positions by `rss_vb` with known times of births and deaths and known positions.

    Parameters
    ----------
    trial : RSSTrial
    start_std : float
        Standard deviation of the initial coordinates, m; their mean is the true position.
    **params
        Parameters of `RSSVB`.

    Returns
    -------
    ndarray, shape (n_steps, n_sources, 2)
    """
    active: Bool = np.isfinite(trial.truth[..., 0])
    positions = np.full(trial.truth.shape, np.nan)
    tracker: RSSVB | None = None
    before = np.zeros(active.shape[1], dtype=np.bool_)
    for step, z in enumerate(trial.measurements):
        tracked = None if tracker is None else tracker.source_beliefs()
        sources = _active_sources(trial, step, tracked, before, start_std)
        before = active[step]
        if len(sources.u) == 0:
            tracker = None
            continue
        tracker = _tracker(trial, sources, params)
        tracker.update(z)
        positions[step, active[step]] = tracker.estimate.position
        tracker.predict()
    return positions


def _active_sources(
    trial: RSSTrial, step: int, tracked: SourceBeliefs | None, before: Bool, start_std: float
) -> SourceBeliefs:
    """Return the beliefs of the active sources, in their order."""
    active = np.flatnonzero(np.isfinite(trial.truth[step, :, 0]))
    index = np.cumsum(before) - 1  # of each source of the last step in `tracked`
    P0 = trial.P0.copy()
    P0[::2, ::2] = start_std**2 * np.eye(2)
    beliefs = []
    for j in active:
        if before[j] and tracked is not None:
            beliefs.append(tracked.select(index[j]))
            continue
        x = np.zeros(4)
        x[::2] = trial.truth[step, j]
        beliefs.append(SourceBeliefs(x, P0, np.float64(trial.mu0), np.float64(trial.v0)))  # type: ignore[arg-type]  # stacked below
    if not beliefs:
        return SourceBeliefs.empty(4)
    return SourceBeliefs(*(np.stack(parts) for parts in zip(*beliefs, strict=True)))


def _tracker(trial: RSSTrial, sources: SourceBeliefs, params: dict[str, Any]) -> RSSVB:
    amplitude = AmplitudePrior(mean=sources.u, variance=sources.v)
    initial: dict[str, Any] = {"x0": sources.x, "P0": sources.P, "amplitude": amplitude}
    return RSSVB(trial.motion, trial.measurement, **initial | params)
