"""Assignment, labels and consistency of stated deviations: closed forms and brute force."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from arrivals.scenarios import create, gospa
from arrivals.scenarios.metrics.assignment import label_switches, matches, track_lengths
from arrivals.scenarios.metrics.consistency import (
    circular_nees,
    coverage,
    position_coverage,
    position_nees,
)
from arrivals.scenarios.metrics.registry import METRICS
from arrivals.scenarios.simulations import SixSources
from arrivals.trackers import SVALSE

ROWS = st.lists(st.one_of(st.floats(-180, 180), st.just(np.nan)), min_size=1, max_size=4)


@given(ROWS, ROWS, st.sampled_from([None, 360.0]))
def test_matches_of_directions_equal_those_of_gospa(
    truth: list[float], estimate: list[float], period: float
) -> None:
    pairs = matches([truth], [estimate], c=10.0, period=period)
    whole = gospa(truth, estimate, c=10.0, period=period)
    assert np.abs(pairs.error).sum() == pytest.approx(whole.distance)
    n_true = int((~np.isnan(truth)).sum())
    assert 5.0 * (n_true - len(pairs.step)) == pytest.approx(whole.missed)


def test_matches_errors_wrap_with_a_period() -> None:
    assert matches([[-179.0]], [[178.0]], c=10, period=360).error == pytest.approx([-3.0])
    assert matches([[-179.0]], [[178.0]], c=10).error.size == 0


def test_label_switches_and_track_lengths_match_hand_count() -> None:
    truth = np.array([[0.0, 50.0]] * 6)
    estimate = [[0.0, 50.0], [0, 50], [50, np.nan], [50, 0], [50, 0], [50, 0]]
    label = [[1, 2], [1, 2], [2, -1], [3, 1], [3, 1], [3, 1]]
    pairs = matches(truth, np.array(estimate, dtype=float), c=10)
    assert label_switches(pairs, label) == 1  # source 50 changes from label 2 to 3; 0 returns as 1
    assert sorted(track_lengths(pairs, label)) == [2, 3, 3, 3]


@pytest.mark.parametrize("std", [0.01, 0.3, 1.5])
def test_correct_deviations_have_nees_one_and_nominal_coverage(std: float) -> None:
    error = np.random.default_rng(0).normal(0, std, 200_000)
    stated = np.full(error.shape, std)
    assert circular_nees(error, stated) == pytest.approx(1.0, abs=0.02)
    assert circular_nees(error, stated / 2) > 1.5
    if std < 1:  # wider densities wrap
        assert coverage(error, stated, 0.68) == pytest.approx(0.68, abs=0.005)
        assert coverage(error, stated, 0.95) == pytest.approx(0.95, abs=0.005)


@given(st.integers(0, 5), st.integers(0, 5), st.integers(0, 10_000))
def test_matches_of_positions_equal_those_of_gospa(n_true: int, n_found: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth, estimate = rng.uniform(0, 20, (1, n_true, 2)), rng.uniform(0, 20, (1, n_found, 2))
    pairs = matches(truth, estimate, c=10.0)
    whole = gospa(truth[0], estimate[0], c=10.0)
    assert np.linalg.norm(pairs.error, axis=-1).sum() == pytest.approx(whole.distance)
    assert 5.0 * (n_true - len(pairs.step)) == pytest.approx(whole.missed)


def test_correct_covariances_have_nees_one_and_nominal_coverage() -> None:
    P = np.array([[4.0, 1.5], [1.5, 1.0]])
    error = np.random.default_rng(0).multivariate_normal([0, 0], P, 100_000)
    stated = np.broadcast_to(P, (len(error), 2, 2))
    assert position_nees(error, stated) == pytest.approx(1.0, abs=0.02)
    assert position_nees(error, stated / 4) == pytest.approx(4.0, abs=0.08)
    assert position_coverage(error, stated, 0.68) == pytest.approx(0.68, abs=0.005)
    assert position_coverage(error, stated, 0.95) == pytest.approx(0.95, abs=0.005)
    for bad in (-P, P * np.nan):
        with pytest.raises(ValueError, match="positive definite"):
            position_nees(error[:1], bad[None])
    with pytest.raises(ValueError, match=r"\(n, dim\) and \(n, dim, dim\); got \(2,\)"):
        position_coverage(error[0], P)


def test_nees_of_von_mises_errors_is_one() -> None:
    """The deviation of a density of resultant R is √(-2 ln R) for any shape."""
    from scipy.special import ive

    for kappa in (0.5, 5.0, 500.0):
        error = np.random.default_rng(1).vonmises(0, kappa, 200_000)
        std = np.sqrt(-2 * np.log(ive(1, kappa) / ive(0, kappa)))
        stated = np.full(error.shape, std)
        assert circular_nees(error, stated) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("error", "std", "message"),
    [([0.1], [0.0], "positive"), ([0.1], [np.nan], "positive"), ([0.1], [1, 1], "same shape")],
)
def test_consistency_invalid_argument_is_rejected(
    error: ArrayLike, std: ArrayLike, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        circular_nees(error, std)
    with pytest.raises(ValueError, match="level must lie"):
        coverage([0.1], [0.1], level=1.0)


def test_svalse_deviation_of_one_source_is_consistent() -> None:
    n_steps = 100
    model = SixSources().measurement.replace(noise=0.02)
    rng = np.random.default_rng(2)
    phases = np.exp(2j * np.pi * rng.random((n_steps, 1)))
    truth = np.full((n_steps, 1), 0.3)
    run = SVALSE(model).run(model.simulate(truth, phases, rng))
    first = run.doa[:, :1]
    assert circular_nees((first - truth)[:, 0], run.std[:, 0]) == pytest.approx(1.0, abs=0.5)


def test_metrics_of_a_perfect_run() -> None:
    trial = create("svalse_fig6", n_steps=4).sample(np.random.default_rng(0))
    run = trial.tracker("svalse").run(trial.measurements)
    n = trial.truth.shape[1]
    perfect = type(run)(
        run.kind,
        {name: np.tile(v[:, :1], (1, n)) if v.ndim > 1 else v for name, v in run.fields.items()}
        | {"doa": trial.truth, "label": np.tile(np.arange(n), (4, 1)), "std": np.ones((4, n))}
        | {"existence": np.where(np.isnan(trial.truth), np.nan, 1.0)},
        run.x,
        (~np.isnan(trial.truth)).sum(axis=1),
        run.time,
        run.elapsed,
    )
    values = {name: metric(trial, perfect) for name, metric in METRICS.items()}
    zeros = dict.fromkeys(["gospa", "distance", "missed", "false", "rmse", "ospa", "nees"], 0)
    zeros |= dict.fromkeys(["cardinality", "ece", "brier", "log_score", "label_switches"], 0)
    covered = dict.fromkeys(["coverage50", "coverage68", "coverage90", "coverage95"], 1)
    counts = {"track_length": 4, "converged": values["converged"]}
    assert values == pytest.approx(zeros | covered | counts)


def test_inapplicable_metrics_report_the_reason() -> None:
    trial = create("svalse_fig6", n_steps=2).sample(np.random.default_rng(0))
    run = trial.tracker("cbf").run(trial.measurements)
    with pytest.raises(ValueError, match="does not estimate standard deviations"):
        METRICS["nees"](trial, run)
    with pytest.raises(ValueError, match="does not assign labels"):
        METRICS["track_length"](trial, run)
