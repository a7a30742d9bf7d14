"""Scores of runs of positions, of one draw and pooled over draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.scenarios.bounds import posterior_bound
from arrivals.scenarios.experiments.statistics import standard_error
from arrivals.scenarios.metrics.assignment import label_switches, matches
from arrivals.scenarios.metrics.registry import METRICS, cut_off, gospa_of, pairs_of
from arrivals.scenarios.simulations.stations import StationsTrial
from arrivals.trackers import Run
from arrivals.typing import Bool, Float

CHI_SQUARE_95 = 5.991  # of two degrees of freedom
SURE = 0.99


@dataclass(frozen=True, eq=False)
class Score:
    """Score of one run.

    Parameters
    ----------
    gospa : ndarray, shape (4,)
        Total, distance, missed and false, m, averaged over the steps.
    ospa : float
        m.
    error, bound : ndarray, shape (n_pairs,)
        Distances of matched positions, and roots of the trace of the bound from the arrays, m.
    square : ndarray, shape (n_pairs,)
        eᵀ P⁻¹ e; NaN without covariances.
    switches : int
        Detections of a source with another label than before.
    existence, hit : ndarray, shape (n,)
        Stated existence, and whether a source is within twice the cut-off.
    ms, station_ms : float
        CPU time of a step, of the fusion and of the stations' trackers, ms.
    """

    gospa: Float
    ospa: float
    error: Float
    bound: Float
    square: Float
    switches: int
    existence: Float
    hit: Bool
    ms: float
    station_ms: float


def score(trial: StationsTrial, run: Run, ms: float, station_ms: float) -> Score:
    """Return the score of one run."""
    g, pairs = gospa_of(trial, run), pairs_of(trial, run)
    drawn = trial.true_stations, trial.truth, trial.power, trial.motion
    bound = np.sqrt(np.trace(posterior_bound(*drawn, trial.P0), axis1=2, axis2=3))
    e, P = pairs.error, run.covariance[pairs.step, pairs.slot]
    square = np.full(len(e), np.nan)
    stated = np.isfinite(P).all(axis=(1, 2))
    square[stated] = np.einsum("ni,ni->n", e[stated], _solve(P[stated], e[stated]))
    near = matches(trial.truth, run.position, 2 * cut_off(trial))
    hit = np.zeros(run.existence.shape, dtype=np.bool_)
    hit[near.step, near.slot] = True
    known = ~np.isnan(run.existence)
    has_labels = bool((run.label >= 0).any())
    return Score(
        gospa=np.array([g.total, g.distance, g.missed, g.false]),
        ospa=METRICS["ospa"](trial, run),
        error=np.linalg.norm(e, axis=1),
        bound=bound[pairs.step, pairs.source],
        square=square,
        switches=label_switches(pairs, run.label) if has_labels else 0,
        existence=run.existence[known],
        hit=hit[known],
        ms=ms,
        station_ms=station_ms,
    )


def _solve(P: Float, e: Float) -> Float:
    return np.asarray(np.linalg.solve(P, e[..., None])[..., 0])


HEADER = (
    "| method | GOSPA ± s.e. (distance/missed/false), m | to step | OSPA | median error / bound, m "
    "| NEES/2 | in 95 % | labels changed | existence > 0.99 true | ms, stations' ms |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def row(name: str, scores: list[Score], reference: list[Score] | None) -> str:
    """Return the row of a method; `reference` has the scores of `step` on the same draws."""
    gospa = np.array([each.gospa for each in scores])
    digits = 1 if gospa[:, 0].mean() > 5 else 2
    total, distance, missed, false = (f"{each:.{digits}f}" for each in gospa.mean(axis=0))
    error = standard_error(gospa[:, 0]) if len(scores) > 1 else np.nan
    squares = np.concatenate([each.square for each in scores])
    squares = squares[~np.isnan(squares)]
    n_pairs = sum(len(each.error) for each in scores)
    ratio = "" if reference is None else _ratio(gospa[:, 0], [each.gospa[0] for each in reference])
    existence = np.concatenate([each.existence for each in scores])
    sure = np.concatenate([each.hit for each in scores])[existence > SURE]
    cells = [
        name,
        f"{total} ± {error:.{digits}f} ({distance}/{missed}/{false})",
        ratio,
        f"{np.mean([each.ospa for each in scores]):.{digits}f}",
        f"{_median(scores, 'error'):.2f} / {_median(scores, 'bound'):.2f}",
        f"{squares.mean() / 2:.2f}" if squares.size else "",
        f"{(squares < CHI_SQUARE_95).mean():.3f}" if squares.size else "",
        f"{100 * sum(each.switches for each in scores) / max(n_pairs, 1):.2f} %",
        f"{sure.mean():.3f} of {len(sure)}" if sure.size else "",
        f"{np.mean([s.ms for s in scores]):.2f}, {np.mean([s.station_ms for s in scores]):.1f}",
    ]
    return f"| {' | '.join(cells)} |"


def _median(scores: list[Score], name: str) -> float:
    """Return the mean over the draws of the median."""
    values = [getattr(each, name) for each in scores]
    return float(np.mean([np.median(each) for each in values if each.size] or [np.nan]))


def _ratio(ours: Float, reference: list[float]) -> str:
    """Return the ratio of the means, and the number of draws in which ours is smaller."""
    ratio = np.mean(ours) / np.mean(reference)
    return f"{ratio:.2f}, {int(np.sum(ours < np.array(reference)))} of {len(ours)}"
