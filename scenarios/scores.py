"""What a run is worth, held against the truth of its trial: one number each, degrees and steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from arrivals.measurement_models import LogNormalRSS
from arrivals.scenarios.base import Trial
from arrivals.scenarios.calibration import circular_nees, coverage
from arrivals.scenarios.matching import Matches, label_switches, matches, track_lengths
from arrivals.scenarios.metrics import Gospa, mean_gospa, mean_rmse, ospa
from arrivals.trackers.recorder import Run
from arrivals.typing import Float

Metric: TypeAlias = Callable[[Trial, Run], float]
CUT_OFF = 10.0  # degrees: the paper's c


def angles(trial: Trial, run: Run) -> tuple[Float, Float, float | None]:
    """Return true and found directions, degrees, and their period: None on a line.

    Raises
    ------
    ValueError
        If the run holds no directions, or not as many steps as the trial.
    """
    if "doa" not in run.fields:
        raise ValueError(f"a run of {run.kind.__name__}s holds no directions")
    if isinstance(trial.measurement, LogNormalRSS):
        raise ValueError("a trial of signal strength has positions for truth, no directions")
    period = 360.0 if trial.measurement.array.dim > 1 else None
    return np.rad2deg(trial.truth), np.rad2deg(run.doa), period


@lru_cache(maxsize=1)  # the parts are asked for one after the other
def gospa_of(trial: Trial, run: Run) -> Gospa:
    """Return GOSPA and its parts, degrees, means over the steps."""
    truth, found, period = angles(trial, run)
    return mean_gospa(truth, found, c=CUT_OFF, period=period)


@lru_cache(maxsize=1)
def pairs_of(trial: Trial, run: Run) -> Matches:
    """Return the pairs of true and found directions, errors in rad."""
    truth, found, period = angles(trial, run)
    pairs = matches(truth, found, CUT_OFF, period)
    return pairs._replace(error=np.deg2rad(pairs.error))


def _rmse(trial: Trial, run: Run) -> float:
    truth, found, period = angles(trial, run)
    return mean_rmse(truth, found, CUT_OFF, period)


def _ospa(trial: Trial, run: Run) -> float:
    truth, found, period = angles(trial, run)
    steps = [ospa(t, f, CUT_OFF, period=period) for t, f in zip(truth, found, strict=True)]
    return float(np.mean(steps))


def _cardinality(trial: Trial, run: Run) -> float:
    true = (~np.isnan(angles(trial, run)[0])).sum(axis=1)
    return float(np.abs(run.n_found - true).mean())


def _stated(trial: Trial, run: Run) -> tuple[Float, Float]:
    pairs = pairs_of(trial, run)
    if run.n_found.any() and np.isnan(run.fields["std"]).all():
        raise ValueError("the tracker states no standard deviations")
    return pairs.error, np.asarray(run.fields["std"][pairs.step, pairs.slot])


def _labels(trial: Trial, run: Run) -> Matches:
    if run.n_found.any() and (run.fields["label"] < 0).all():
        raise ValueError("the tracker gives no labels")
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
    return circular_nees(*_stated(trial, run))


def _coverage68(trial: Trial, run: Run) -> float:
    return coverage(*_stated(trial, run), level=0.68)


def _coverage95(trial: Trial, run: Run) -> float:
    return coverage(*_stated(trial, run), level=0.95)


def _label_switches(trial: Trial, run: Run) -> float:
    return float(label_switches(_labels(trial, run), run.fields["label"]))


def _track_length(trial: Trial, run: Run) -> float:
    lengths = track_lengths(_labels(trial, run), run.fields["label"])
    return float(lengths.mean()) if lengths.size else np.nan


def _converged(trial: Trial, run: Run) -> float:
    return float(np.mean(run.converged))


METRICS: dict[str, Metric] = {
    "gospa": _gospa,
    "distance": _distance,
    "missed": _missed,
    "false": _false,
    "rmse": _rmse,
    "ospa": _ospa,
    "cardinality": _cardinality,
    "nees": _nees,
    "coverage68": _coverage68,
    "coverage95": _coverage95,
    "label_switches": _label_switches,
    "track_length": _track_length,
    "converged": _converged,
}
CPU = "cpu_ms"  # processor time of a step, measured by the runner: the seed does not settle it
