"""Metrics of trials that state their cut-off, and of runs of positions from several stations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from arrivals.scenarios import gospa
from arrivals.scenarios.metrics.registry import METRICS, gospa_of, pairs_of
from arrivals.scenarios.simulations import StationsRadio, StationsSound, StationsTrial
from arrivals.trackers import PositionEstimate, Run
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Float


def run_of(position: Float, std: float, label: Float) -> Run:
    """Return a run of positions (n_steps, n, 2) with the same standard deviation."""
    recorder = RunRecorder(PositionEstimate)
    for places, names in zip(position, label, strict=True):
        n = len(places)
        P = np.tile(std**2 * np.eye(2), (n, 1, 1))
        one = PositionEstimate(places, P, np.full(n, np.nan), np.full(n, 0.8), names.astype(int))
        recorder.add(one, np.zeros(0))
    return recorder.run(dt=1.0, elapsed=0.0)


def trial_of(cut_off: float | None) -> StationsTrial:
    trial = StationsRadio(n_sources=1, n_steps=4).sample(np.random.default_rng(0))
    return replace(trial, cut_off=cut_off)


@pytest.mark.parametrize(("cut_off", "c"), [(None, 10.0), (50.0, 50.0), (15.0, 15.0)])
def test_cut_off_of_a_trial_is_that_of_its_metrics(cut_off: float | None, c: float) -> None:
    trial, offset = trial_of(cut_off), np.array([12.0, -16.0])
    run = run_of(trial.truth + offset, 10.0, np.array([[1], [1], [2], [2]]))
    each = gospa(trial.truth[0], trial.truth[0] + offset, c=c)
    assert gospa_of(trial, run) == each
    assert METRICS["ospa"](trial, run) == pytest.approx(min(20.0, c))
    assert METRICS["rmse"](trial, run) == pytest.approx(min(20.0, c))
    found = c > 20
    assert len(pairs_of(trial, run).error) == 4 * found
    assert METRICS["label_switches"](trial, run) == found
    assert METRICS["nees"](trial, run) == pytest.approx(2.0 if found else np.nan, nan_ok=True)
    assert METRICS["brier"](trial, run) == pytest.approx(0.04 if found else 0.64)


def test_coverage_of_positions_counts_errors_within_the_ellipse() -> None:
    trial = trial_of(50.0)
    offset = np.array([0.0, 11.0, 13.0, 30.0])[:, None, None] * [1.0, 0.0]
    run = run_of(trial.truth + offset, 5.0, np.ones((4, 1)))
    # radii of 50, 68, 90 and 95 %: 5.9, 7.5, 10.7 and 12.2 m
    shares = [METRICS[f"coverage{level}"](trial, run) for level in (50, 90, 95)]
    assert shares == [0.25, 0.25, 0.5]


@pytest.mark.parametrize("scene", [StationsRadio(n_steps=25), StationsSound(n_steps=25)])
def test_every_metric_has_a_value_for_fused(scene: StationsRadio | StationsSound) -> None:
    trial = scene.sample(np.random.default_rng(0))
    run = trial.tracker("fused").run(trial.measurements)
    values = {name: metric(trial, run) for name, metric in METRICS.items()}
    assert np.isfinite(list(values.values())).all(), values
    assert values["gospa"] < 2 * trial.cut_off  # type: ignore[operator]  # these state one
