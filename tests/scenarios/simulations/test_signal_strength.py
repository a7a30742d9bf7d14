"""Scenarios, bounds, detection and metrics of the paper on signal strength."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import gamma

from arrivals.measurement_models import AveragedEnvelope, LogNormalRSS, db_to_neper
from arrivals.scenarios import available, create
from arrivals.scenarios.bounds.detection import (
    amplitude_gaussian_detection,
    exact_detection,
    log_gaussian_detection,
    network_detection,
    true_false_alarm,
)
from arrivals.scenarios.bounds.signal_strength import rss_bound
from arrivals.scenarios.metrics.position_errors import Assignment, assign, huber, scores
from arrivals.scenarios.reproduce.rss.trials import bounds, draws
from arrivals.scenarios.simulations.signal_strength import RSSTrial, Table1K3, Table1K7, lattice

HOW: tuple[Assignment, Assignment] = ("nearest", "one-to-one")
NAMES = ("rss_table1_k3", "rss_table1_k7", "rss_crossing", "rss_birth_death")


@pytest.mark.parametrize("name", NAMES)
def test_rss_scenarios_are_registered_and_accept_any_number_of_sources(name: str) -> None:
    assert name in available()
    for params in ({}, {"n_sources": 50, "n_sensors": 700}, {"n_sources": 1}):
        scenario: Any = create(name, **params)
        trial = scenario.sample(np.random.default_rng(0))
        assert isinstance(trial, RSSTrial)
        n_steps, K = trial.truth.shape[:2]
        assert scenario.n_sources == K
        assert trial.measurements.shape == (n_steps, scenario.n_sensors)
        assert np.isfinite(trial.measurements).all()
    again = create(name).sample(np.random.default_rng(0))
    np.testing.assert_array_equal(
        again.measurements, create(name).sample(np.random.default_rng(0)).measurements
    )


@pytest.mark.parametrize("name", NAMES)
def test_rss_trackers_accept_the_arguments_of_a_trial(name: str) -> None:
    trial = create(name, n_sensors=60).sample(np.random.default_rng(1))
    for kind in ("rss_vb", "rss_ml"):
        tracker: Any = trial.tracker(kind)
        tracker.predict()
        tracker.update(trial.measurements[0])
        assert np.isfinite(tracker.estimate.position).all()


def test_rss_vb_locates_with_a_hundred_thousand_sensors() -> None:
    trial = Table1K3(n_sensors=100_000).sample(np.random.default_rng(0))
    tracker: Any = trial.tracker("rss_vb")
    tracker.update(trial.measurements[0])
    error = np.linalg.norm(tracker.estimate.position - trial.truth[0], axis=-1)
    assert error.max() < 0.5


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"n_sources": 51}, "n_sources must be at most 50; got 51"),
        ({"n_sensors": 100_001}, "n_sensors must be at most 100000"),
        ({"n_sources": 0}, "n_sources must be at least 1"),
        ({"radius": -1.0}, "radius must be finite and positive"),
        ({"start_at": "anywhere"}, "start_at must be one of"),
        ({"spacing": 0.0}, "spacing must be finite and positive"),
    ],
)
def test_rss_scenario_invalid_parameter_is_rejected(params: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Table1K3(**params)


@given(st.integers(2, 50), st.booleans())
def test_lattice_points_have_the_given_spacing(n: int, centred: bool) -> None:
    points = lattice(n, 30.0, centred)
    apart = np.linalg.norm(points[:, None] - points, axis=-1) + 1e9 * np.eye(n)
    assert apart.min() == pytest.approx(30.0)
    assert len(points) == n


# bounds


def test_rss_bound_is_the_inverse_covariance_of_the_score() -> None:
    """The inverse information is the covariance of the score, drawn from the exact statistic."""
    rng = np.random.default_rng(0)
    model = LogNormalRSS(rng.uniform(-80, 80, (40, 2)), log_noise=float(db_to_neper(40.0)))
    u, theta = db_to_neper([80.0]), np.array([[5.0, -10.0]])
    from arrivals.measurement_models.signal_strength.path_loss import slopes

    levels = model.levels(u, theta)
    z = model.draw(np.tile(u, (20000, 1)), np.tile(theta, (20000, 1, 1)), rng)
    e2 = np.exp(2 * (z - levels.log_sigma))
    score = 2 * 50 * (e2 - 1) @ slopes(levels, 2.0)  # of the Gamma statistic N e²
    exact = np.linalg.inv(score.T @ score / 20000)
    bound = rss_bound(model, u, theta)
    np.testing.assert_allclose(bound.Sigma[0], exact[1:, 1:], rtol=0.06)
    np.testing.assert_allclose(bound.v, exact[0, 0], rtol=0.06)


def test_priors_reduce_the_rss_bound_and_resolve_ambiguity() -> None:
    model = LogNormalRSS([[0.0, 0.0], [60.0, 0.0]])
    with pytest.raises(
        ValueError, match="must determine the 3 unknowns of 1 sources; got 2 readings"
    ):
        rss_bound(model, [9.2], [[20.0, 0.0]])
    bound = rss_bound(model, [9.2], [[20.0, 30.0]], v0=0.1, P0=100.0 * np.eye(2))
    assert bound.position[0] < np.sqrt(200.0)
    assert bound.amplitude[0] < np.sqrt(0.1)


def test_rss_bound_matches_section_11() -> None:
    for case, position, level in ((Table1K3(), 1.9, 0.62), (Table1K7(), 1.6, 0.50)):
        result = bounds(draws(case, 200, 0))
        far = np.median(np.sqrt(np.trace(result.Sigma, axis1=-2, axis2=-1)))
        assert far == pytest.approx(position, rel=0.1)
        assert np.median(np.sqrt(result.v)) / db_to_neper(1.0) == pytest.approx(level, rel=0.1)


# detection: the table of section 8


@pytest.mark.parametrize(
    ("N", "snr_db", "alarm", "exact", "log", "amplitude", "true_log", "true_amplitude"),
    [
        (10, 0, 0.1, 0.820, 0.819, 0.828, 0.070, 0.089),
        (10, 0, 0.01, 0.536, 0.447, 0.582, 0.0030, 0.0104),
        (10, 0, 0.001, 0.306, 0.185, 0.370, 7.8e-5, 1.4e-3),
        (50, -3, 0.01, 0.742, 0.708, 0.758, 0.0061, 0.0103),
        (100, -3, 0.001, 0.864, 0.835, 0.876, 5.0e-4, 1.1e-3),
    ],
)
def test_detection_matches_section_8(
    N: int, snr_db: float, alarm: float, exact: float, log: float, amplitude: float,
    true_log: float, true_amplitude: float,
) -> None:  # fmt: skip
    snr = 10 ** (snr_db / 10)
    assert exact_detection(alarm, N, snr) == pytest.approx(exact, abs=6e-4)
    assert log_gaussian_detection(alarm, N, snr) == pytest.approx(log, abs=6e-4)
    assert amplitude_gaussian_detection(alarm, N, snr) == pytest.approx(amplitude, abs=6e-4)
    got = true_false_alarm(alarm, N)
    assert [float(p) for p in got] == pytest.approx([true_log, true_amplitude], rel=0.06)


def test_exact_detection_matches_simulation() -> None:
    rng = np.random.default_rng(0)
    model = LogNormalRSS([[0.0, 0.0]], AveragedEnvelope(10), log_noise=0.0)
    u, place = np.zeros((100_000, 1)), np.tile([[[2.0, 0.0]]], (100_000, 1, 1))
    z = model.draw(u, place, rng)[:, 0]
    threshold = 0.5 * np.log(gamma.isf(0.01, 10) / 10)
    assert exact_detection(0.01, 10, 0.25) == pytest.approx(np.mean(z > threshold), abs=0.005)


@given(st.floats(1e-4, 0.5), st.integers(1, 200))
def test_detection_without_source_equals_false_alarm(alarm: float, N: int) -> None:
    for probability in (exact_detection, log_gaussian_detection, amplitude_gaussian_detection):
        assert probability(alarm, N, 0.0) == pytest.approx(alarm, rel=1e-6)
    assert network_detection(alarm, np.ones(5), 0.0) == pytest.approx(alarm, rel=1e-6)


# metrics


def test_huber_matches_sklearn_for_equal_scales() -> None:
    from sklearn.linear_model import HuberRegressor

    rng = np.random.default_rng(0)
    e = np.concatenate([rng.normal(0.5, 1.0, 400), rng.normal(30.0, 5.0, 40)])
    fit = HuberRegressor(epsilon=1.345, alpha=0.0).fit(np.zeros((440, 1)), e)
    assert huber(e).bias == pytest.approx(fit.intercept_, abs=0.1)
    assert huber(e).rms < 0.5 * np.sqrt(np.mean(e**2))


@given(st.floats(0.01, 100), st.floats(-50, 50))
def test_huber_is_equivariant_to_shift_and_scale(scale: float, shift: float) -> None:
    e = np.random.default_rng(0).standard_t(2, 60)
    assert huber(scale * e + shift).bias == pytest.approx(scale * huber(e).bias + shift, abs=1e-3)
    assert huber(scale * e).rms == pytest.approx(scale * huber(e).rms, rel=1e-3)


def test_huber_empty_and_nan_errors_are_rejected() -> None:
    for errors in ([], [1.0, np.nan]):
        with pytest.raises(ValueError, match="errors must be finite, at least one"):
            huber(errors)
    assert huber([2.0, 2.0]).bias == 2.0


def test_nearest_assignment_favours_merged_solutions() -> None:
    truth = np.array([[[0.0, 0.0], [30.0, 0.0]]] * 5)
    merged = np.array([[[15.0, 0.0], [500.0, 0.0]]] * 5)
    u = np.zeros((5, 2))
    near, strict = (scores(merged, truth, u, u, how) for how in HOW)
    assert near.lost == 0
    assert strict.lost == 0.5
    assert near.median == 15
    with pytest.raises(ValueError, match="theta must have at least 2 rows for one-to-one; got 1"):
        assign([[0.0, 0.0]], truth[0], "one-to-one")


def test_estimates_that_are_not_finite_count_as_lost() -> None:
    truth = np.zeros((4, 1, 2))
    result = np.array([[[0.1, 0.0]], [[0.0, 0.2]], [[np.nan, 0.0]], [[np.inf, 0.0]]])
    u = np.zeros((4, 1))
    assert scores(result, truth, u, u).lost == 0.5
