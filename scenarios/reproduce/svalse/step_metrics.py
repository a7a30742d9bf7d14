"""Metrics of SVALSE's paper beyond GOSPA and RMSE: stability, endfire, number, stopped sources."""

from __future__ import annotations

import numpy as np

from arrivals.scenarios.base import Trial
from arrivals.scenarios.metrics.gospa import gospa
from arrivals.scenarios.metrics.registry import CUT_OFF, Metric, pairs_of, sets
from arrivals.trackers.run import Run
from arrivals.typing import Float

ENDFIRE = 50.0  # degrees from broadside, from which a source is near endfire
GHOST = 5.0  # degrees from the last direction of a stopped source


def gospa_steps(trial: Trial, run: Run) -> Float:
    """Return GOSPA of every step, degrees, (n_steps,).

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> trial = create("svalse_fig6", n_steps=3).sample(np.random.default_rng(0))
    >>> gospa_steps(trial, trial.tracker("cbf").run(trial.measurements)).shape
    (3,)
    """
    truth, estimate, period, distance = sets(trial, run)
    steps = zip(truth, estimate, strict=True)
    return np.array(
        [gospa(t, f, CUT_OFF, period=period, distance=distance).total for t, f in steps]
    )


def gospa_std(trial: Trial, run: Run) -> float:
    """Return the standard deviation of GOSPA over the steps of a run, degrees."""
    return float(gospa_steps(trial, run).std())


def number_bias(trial: Trial, run: Run) -> float:
    """Return the mean number of estimates minus that of sources."""
    return float((run.n_found - (~np.isnan(trial.truth)).sum(axis=1)).mean())


def found_near_endfire(trial: Trial, run: Run) -> float:
    """Return the share of sources near endfire that have an estimate within the cut-off."""
    near = np.abs(np.rad2deg(trial.truth)) >= ENDFIRE
    found = np.zeros(near.shape, dtype=np.bool_)
    pairs = pairs_of(trial, run)
    found[pairs.step, pairs.source] = True
    return float(found[near].mean()) if near.any() else np.nan


def ghosts(trial: Trial, run: Run) -> float:
    """Return the share of sources just stopped that still have an estimate of their own."""
    truth, estimate, *_ = sets(trial, run)
    pairs = pairs_of(trial, run)
    free = estimate.copy()
    free[pairs.step, pairs.slot] = np.nan
    step, source = np.nonzero(~np.isnan(truth[:-1]) & np.isnan(truth[1:]))
    if not len(step):
        return np.nan
    distance = np.abs(free[step + 1] - truth[step, source][:, None])
    return float((distance < GHOST).any(axis=1).mean())


STEP_METRICS: dict[str, Metric] = {
    "gospa_std": gospa_std,
    "number_bias": number_bias,
    "found_near_endfire": found_near_endfire,
    "ghosts": ghosts,
}
