"""Metrics of studies: functions of a trial and a run.

Directions are scored in degrees, on the sphere along great circles, and positions in metres,
according to the trial's truth. The cut-off is that of the trial, else 10 degrees or m.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from arrivals.scenarios.base import Trial
from arrivals.scenarios.metrics.assignment import Matches, label_switches, matches, track_lengths
from arrivals.scenarios.metrics.calibration import reliability
from arrivals.scenarios.metrics.consistency import (
    circular_nees,
    coverage,
    position_coverage,
    position_nees,
)
from arrivals.scenarios.metrics.distances import Distance
from arrivals.scenarios.metrics.gospa import Gospa, mean_gospa, mean_rmse, ospa
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Float

Metric: TypeAlias = Callable[[Trial, Run], float]
CUT_OFF = 10.0  # degrees, the paper's c; for positions metres


class Sets(NamedTuple):
    """True and estimated directions, degrees, or positions, m; NaN for inactive and undetected.

    Parameters
    ----------
    truth, estimate : ndarray, shapes (n_steps, n_sources[, 2]) and (n_steps, n_slots[, 2])
        Truth and estimates: directions, azimuths and elevations, or positions.
    period : float or None
        Period of directions in the plane and on the sphere, degrees.
    distance : {"euclidean", "great_circle"}
        Along great circles for azimuths and elevations.
    """

    truth: Float
    estimate: Float
    period: float | None
    distance: Distance = "euclidean"


def sets(trial: Trial, run: Run) -> Sets:
    """Return truth and estimates: directions if the trial's truth has directions, else positions.

    Raises
    ------
    ValueError
        If the run has no estimates of that kind, or only one of them has elevations.
    """
    noun, name = ("positions", "position") if trial.truth.ndim == 3 else ("directions", "doa")
    if name not in run.fields:
        raise ValueError(f"the trial's truth has {noun}; a run of {run.kind.__name__}s has none")
    if name == "position":
        return Sets(trial.truth, np.asarray(run.fields[name]), None)
    if (trial.elevation is None) != ("elevation" not in run.fields):
        has, run_has = ("none", "some") if trial.elevation is None else ("some", "none")
        raise ValueError(
            f"truth and run must both have elevations, or neither; the trial's truth has {has}, "
            f"a run of {run.kind.__name__}s {run_has}"
        )
    if trial.elevation is not None:
        truth = np.rad2deg(np.stack([trial.truth, trial.elevation], axis=-1))
        estimate = np.rad2deg(np.stack([run.fields["doa"], run.fields["elevation"]], axis=-1))
        return Sets(truth, estimate, 360.0, "great_circle")
    period = 360.0 if trial.measurement.array.dim > 1 else None  # type: ignore[union-attr]  # directions have an array
    return Sets(np.rad2deg(trial.truth), np.rad2deg(run.fields[name]), period)


def cut_off(trial: Trial) -> float:
    """Return the cut-off c of a trial's metrics, degrees or m."""
    return CUT_OFF if trial.cut_off is None else trial.cut_off


@lru_cache(maxsize=1)  # shared by the metrics of its parts
def gospa_of(trial: Trial, run: Run) -> Gospa:
    """Return GOSPA and its parts, degrees or m, averaged over the steps."""
    truth, estimate, period, distance = sets(trial, run)
    return mean_gospa(truth, estimate, c=cut_off(trial), period=period, distance=distance)


@lru_cache(maxsize=1)
def pairs_of(trial: Trial, run: Run) -> Matches:
    """Return the pairs of truth and estimates, errors in rad or m."""
    truth, estimate, period, distance = sets(trial, run)
    pairs = matches(truth, estimate, cut_off(trial), period, distance)
    return pairs if trial.truth.ndim == 3 else pairs._replace(error=np.deg2rad(pairs.error))


def _rmse(trial: Trial, run: Run) -> float:
    truth, estimate, period, distance = sets(trial, run)
    return mean_rmse(truth, estimate, cut_off(trial), period, distance)


def _ospa(trial: Trial, run: Run) -> float:
    truth, estimate, period, distance = sets(trial, run)
    steps, c = zip(truth, estimate, strict=True), cut_off(trial)
    return float(np.mean([ospa(t, f, c, period=period, distance=distance) for t, f in steps]))


def _cardinality(trial: Trial, run: Run) -> float:
    truth = sets(trial, run).truth
    there = ~np.isnan(truth if truth.ndim == 2 else truth[..., 0])
    return float(np.abs(run.n_found - there.sum(axis=1)).mean())


def _stated(trial: Trial, run: Run) -> tuple[Float, Float]:
    """Return errors and stated deviations (n,), rad, or covariances (n, 2, 2), m² or rad²."""
    pairs = pairs_of(trial, run)
    spread = run.fields["std" if pairs.error.ndim == 1 else "covariance"]
    if run.n_found.any() and np.isnan(spread).all():
        raise ValueError("the tracker does not estimate standard deviations")
    return pairs.error, np.asarray(spread[pairs.step, pairs.slot])


def _labels(trial: Trial, run: Run) -> Matches:
    if run.n_found.any() and (run.fields["label"] < 0).all():
        raise ValueError("the tracker does not assign labels")
    return pairs_of(trial, run)


def _gospa(trial: Trial, run: Run) -> float:
    return gospa_of(trial, run).total


def _distance(trial: Trial, run: Run) -> float:
    return gospa_of(trial, run).distance


def _missed(trial: Trial, run: Run) -> float:
    return gospa_of(trial, run).missed


def _false(trial: Trial, run: Run) -> float:
    return gospa_of(trial, run).false


def _nees(trial: Trial, run: Run) -> float:
    error, spread = _stated(trial, run)
    return (circular_nees if error.ndim == 1 else position_nees)(error, spread)


def _covered(trial: Trial, run: Run, level: float) -> float:
    error, spread = _stated(trial, run)
    return (coverage if error.ndim == 1 else position_coverage)(error, spread, level=level)


def _coverage50(trial: Trial, run: Run) -> float:
    return _covered(trial, run, 0.50)


def _coverage68(trial: Trial, run: Run) -> float:
    return _covered(trial, run, 0.68)


def _coverage90(trial: Trial, run: Run) -> float:
    return _covered(trial, run, 0.90)


def _coverage95(trial: Trial, run: Run) -> float:
    return _covered(trial, run, 0.95)


def existence_and_hits(trial: Trial, run: Run) -> tuple[Float, Bool]:
    """Return the stated existence of all estimates, and which are matched to a source, (n,)."""
    existence = run.fields.get("existence", np.full((0, 0), np.nan))
    if run.n_found.any() and np.isnan(existence).all():
        raise ValueError("the tracker does not estimate probabilities of existence")
    pairs = pairs_of(trial, run)
    hit = np.zeros(existence.shape, dtype=np.bool_)
    hit[pairs.step, pairs.slot] = True
    stated = ~np.isnan(existence)
    return np.asarray(existence[stated]), hit[stated]


def _ece(trial: Trial, run: Run) -> float:
    return reliability(*existence_and_hits(trial, run)).ece


def _brier(trial: Trial, run: Run) -> float:
    return reliability(*existence_and_hits(trial, run)).brier


def _log_score(trial: Trial, run: Run) -> float:
    return reliability(*existence_and_hits(trial, run)).log_score


def _label_switches(trial: Trial, run: Run) -> float:
    return float(label_switches(_labels(trial, run), run.fields["label"]))


def _track_length(trial: Trial, run: Run) -> float:
    lengths = track_lengths(_labels(trial, run), run.fields["label"])
    return float(lengths.mean()) if lengths.size else np.nan


def _converged(trial: Trial, run: Run) -> float:
    return float(np.mean(run.converged))


def _near_pairs(trial: Trial, run: Run) -> tuple[Matches, Float, Float]:
    """Return the pairs whose source has a finite range, with true and estimated ranges, m."""
    if trial.range is None or "range" not in run.fields:
        missing = "the trial's truth" if trial.range is None else f"a run of {run.kind.__name__}s"
        raise ValueError(f"errors in range require ranges of truth and run; {missing} has none")
    pairs = pairs_of(trial, run)
    near = np.isfinite(trial.range[pairs.step, pairs.source])
    step, source, slot, error = pairs
    pairs = Matches(step[near], source[near], slot[near], error[near])
    truth, estimate = trial.range[pairs.step, pairs.source], run.range[pairs.step, pairs.slot]
    return pairs, truth, np.asarray(estimate)


def _range_error(trial: Trial, run: Run) -> float:
    _, truth, estimate = _near_pairs(trial, run)
    found = np.isfinite(estimate)
    error = np.abs(estimate[found] / truth[found] - 1)
    return float(np.median(error)) if found.any() else np.nan


def _range_found(trial: Trial, run: Run) -> float:
    estimate = _near_pairs(trial, run)[2]
    return float(np.isfinite(estimate).mean()) if estimate.size else np.nan


def _range_nees(trial: Trial, run: Run) -> float:
    pairs, truth, estimate = _near_pairs(trial, run)
    found = np.isfinite(estimate)
    error = np.stack([pairs.error, 1 / estimate - 1 / truth], axis=-1)[found]
    return position_nees(error, run.covariance[pairs.step, pairs.slot][found])


METRICS: dict[str, Metric] = {
    "gospa": _gospa,
    "distance": _distance,
    "missed": _missed,
    "false": _false,
    "rmse": _rmse,
    "ospa": _ospa,
    "cardinality": _cardinality,
    "nees": _nees,
    "coverage50": _coverage50,
    "coverage68": _coverage68,
    "coverage90": _coverage90,
    "coverage95": _coverage95,
    "ece": _ece,
    "brier": _brier,
    "log_score": _log_score,
    "label_switches": _label_switches,
    "track_length": _track_length,
    "converged": _converged,
}
RANGE_METRICS: dict[str, Metric] = {
    "range_error": _range_error,
    "range_found": _range_found,
    "range_nees": _range_nees,
}
CPU = "cpu_ms"  # processor time of a step, measured by the runner: not reproducible by the seed
