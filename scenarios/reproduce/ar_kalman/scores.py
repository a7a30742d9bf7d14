"""Scores of the parts: errors of directions, AR models and signals, in all forms and of others."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from arrivals.motion_models.autoregressive.estimation import (
    partial_autocorrelation,
    select_order,
)
from arrivals.scenarios.base import Trial
from arrivals.scenarios.metrics.separation import nmse
from arrivals.scenarios.metrics.unlabelled_rmse import best_assignment_rmse
from arrivals.scenarios.reproduce.ar_kalman.experiments import (
    OURS,
    REPORT,
    Experiment,
    run_tracker,
)
from arrivals.scenarios.simulations.speech import SHIPPED, voice
from arrivals.trackers import create
from arrivals.trackers.run import Run
from arrivals.typing import Float

# By (metric, form or method, case), one value a run
Results: TypeAlias = Mapping[tuple[str, str, str], Float]
SUBSPACE = ("esprit", "past", "music")
RATE = 8000  # of the speech, Hz
N_LAGS, FEW = 20, 30  # lags of the partial autocorrelation, and samples of a short interval


class Lines(NamedTuple):
    """Lines of a picture at the ends of intervals.

    Parameters
    ----------
    truth, ours, report : ndarray, shape (n_intervals, n_sources)
        Degrees, of the first run.
    low, high : ndarray, shape (n_intervals, n_sources)
        10 and 90 % of the runs, ours.
    coefficients, low_a, high_a : ndarray, shape (n_intervals, n_sources, order)
        AR coefficients of the first run, ours, and 10 and 90 % of the runs.
    """

    truth: Float
    ours: Float
    report: Float
    low: Float
    high: Float
    coefficients: Float
    low_a: Float
    high_a: Float


def evaluate(
    case: Experiment, n_runs: int, seed: int
) -> tuple[dict[tuple[str, str, str], Float], Lines]:
    """Return the scores of a part, and the lines of its picture.

    Parameters
    ----------
    case : Experiment
    n_runs, seed : int
        Parts of the same scene have the same runs.
    """
    children = np.random.SeedSequence(seed).spawn(n_runs)
    trials = [case.scene.sample(np.random.default_rng(child)) for child in children]
    results: dict[tuple[str, str, str], Float] = {}
    runs: dict[str, list[Run]] = {}
    for form, params in case.forms().items():
        runs[form] = run_tracker(trials, case, params)
        for metric, values in scores(trials, runs[form], case).items():
            results[metric, form, case.name] = values
    n = case.n_compared(n_runs)
    for name in SUBSPACE if n else ():
        results["rmse", name, case.name] = np.array(
            [unlabelled_rmse(trial, name, case) for trial in trials[:n]]
        )
    return results, _lines(trials[0], runs[OURS], runs[REPORT][0], case)


def scores(trials: Sequence[Trial], runs: Sequence[Run], case: Experiment) -> dict[str, Float]:
    """Return the scores of runs: RMSE, bias and spread in degrees; AR error; NMSE in dB.

    The bias is the mean error of the source for which that of all runs is largest, with the sign
    of the latter; the spread is the rms deviation of the errors from their means.
    """
    scored = _scored(case)
    error = np.rad2deg([r.doa[scored] - t.truth[scored] for t, r in zip(trials, runs, strict=True)])
    mean = error.mean(axis=1)
    largest = np.abs(mean.mean(axis=0)).argmax()
    spread = np.sqrt(((error - mean[:, None]) ** 2).mean(axis=(1, 2)))
    signals = [
        float(np.mean(nmse(np.asarray(t.signals)[case.first :], r.signals[case.first :], db=True)))
        for t, r in zip(trials, runs, strict=True)
    ]
    found = {
        "rmse": np.sqrt((error**2).mean(axis=(1, 2))),
        "bias": mean[:, largest],
        "spread": spread,
        "nmse": np.array(signals),
    }
    motion: Any = trials[0].motion
    if not motion.real_valued and case.motion is None:
        known = motion.coefficient_matrix
        errors = [np.sqrt(np.mean((run.coefficients[-1] - known) ** 2)) for run in runs]
        found["ar error"] = np.array(errors)
    return found


def _scored(case: Experiment) -> slice:
    return slice(case.first - 1, None, case.interval)


def unlabelled_rmse(trial: Trial, name: str, case: Experiment) -> float:
    """Return the RMSE, degrees, of a subspace method; NaN if it does not fit the array.

    They need more sensors than sources, and here a uniform line.
    """
    d, n_sources = np.array(case.scene.distances), case.scene.n_sources
    uniform = np.allclose(d, d[0] * np.arange(1, len(d) + 1)) and case.scene.centre
    if not uniform or n_sources > 2 * len(d):
        return float("nan")
    forgetting, scored = case.params["regression__forgetting"], _scored(case)
    tracker = create(name, measurement=trial.measurement, n_sources=n_sources,
                     forgetting=forgetting, interval=case.interval)  # fmt: skip
    run = tracker.run(trial.measurements)
    error = best_assignment_rmse(trial.truth[scored], hold_last(run.doa[scored]))
    return float(np.rad2deg(error))


def hold_last(doa: Float) -> Float:
    """Replace missing directions (n_steps, n_sources) by the last estimates, initially broadside.

    Examples
    --------
    >>> hold_last(np.array([[0.1, 0.2], [0.3, np.nan]]))
    array([[0.1, 0.2],
           [0.3, 0.2]])
    """
    last = np.maximum.accumulate(np.where(np.isnan(doa), 0, np.arange(len(doa))[:, None]), axis=0)
    return np.nan_to_num(np.take_along_axis(doa, last, axis=0))


def _lines(trial: Trial, ours: Sequence[Run], report: Run, case: Experiment) -> Lines:
    ends = slice(case.interval - 1, None, case.interval)
    doa = np.rad2deg([run.doa[ends] for run in ours])
    a = np.array([run.coefficients[ends] for run in ours])
    low, high = np.percentile(doa, [10, 90], axis=0)
    truth = np.rad2deg(trial.truth[ends])
    return Lines(truth, doa[0], np.rad2deg(report.doa[ends]), low, high,
                 a[0], *np.percentile(a, [10, 90], axis=0))  # fmt: skip


def time_of_intervals(case: Experiment, seed: int) -> dict[tuple[str, str, str], Float]:
    """Return the processor times of an interval, three of them, and its duration at 8 kHz, ms.

    Parameters
    ----------
    case : Experiment
        A part with speech.
    seed : int
    """
    trial = case.scene.sample(np.random.default_rng(seed))
    forms, results = case.forms(), {}
    for form in (OURS, REPORT):
        used = []
        for _ in range(3):
            started = time.process_time()
            run_tracker([trial], case, forms[form])
            used.append((time.process_time() - started) / (len(trial.truth) / case.interval))
        results["cpu ms", form, case.name] = 1e3 * np.array(used)
    results["duration ms", "", case.name] = np.array([1e3 * case.interval / RATE])
    return results


def pacf_of_voices() -> dict[tuple[str, str, str], Float]:
    """Return the partial autocorrelation of the shipped voices, its band, and the orders it gives.

    Of the whole recordings, and the share of short intervals with power in which each lag is
    beyond the band.
    """
    results: dict[tuple[str, str, str], Float] = {}
    for n, name in enumerate(SHIPPED):
        signal, label = voice(name), f"voice {n + 1}"
        results["pacf", label, ""] = partial_autocorrelation(signal, N_LAGS)
        results["band", label, ""] = np.array([1.96 / np.sqrt(len(signal))])
        results["order", label, ""] = np.array([select_order(signal, N_LAGS)], dtype=float)
        parts = signal[: len(signal) // FEW * FEW].reshape(-1, FEW)
        active = parts[(parts**2).mean(axis=-1) > SPEECH_GATE]
        beyond = np.abs(partial_autocorrelation(active, 4)) > 1.96 / np.sqrt(FEW)
        results["share", label, ""] = beyond.mean(axis=0)
    return results


SPEECH_GATE = 0.3  # of the mean power, as of the tracker
