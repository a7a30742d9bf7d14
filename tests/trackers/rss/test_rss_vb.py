"""Tests of the trackers of signal strength: golden case, batches, seeded trials, errors."""

import copy
from typing import Any

import numpy as np
import pytest
from joblib import parallel_config

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.motion_models import ConstantVelocity, CoordinatedTurn, RandomWalk
from arrivals.scenarios.metrics.position_errors import scores
from arrivals.scenarios.reproduce.rss.trials import bounds, draws, estimates
from arrivals.scenarios.simulations.moving_emitters import CrossingSources
from arrivals.scenarios.simulations.signal_strength import Table1K3, Table1K7
from arrivals.trackers import (
    RSSML,
    RSSVB,
    AmplitudePrior,
    BirthDeath,
    GridSearch,
    MAPSolver,
    VariationalSolver,
)

SENSORS = np.array([(0, 0), (60, 0), (60, 60), (0, 60), (30, -15), (75, 30), (30, 75), (-15, 30)])
START = np.array([[[24.0, 18.0], [40.0, 42.0]]])
EXACT: dict[str, Any] = {"tol_u": 0.0, "tol_theta": 0.0}


def same(value: Any, expected: Any) -> None:
    np.testing.assert_allclose(np.squeeze(value), expected, rtol=0, atol=1e-5)


MODEL = LogNormalRSS(SENSORS, log_noise=float(db_to_neper(40.0)), position=(0, 1))
STILL = RandomWalk(q=0.0)
INITIAL: tuple[Any, Any] = (START[0], 64 * np.eye(2))
TRUTH = np.array([[[18.0, 22.0], [44.0, 36.0]]])
XI = MODEL.levels(db_to_neper([[81.0, 78.0]]), TRUTH).log_sigma


def test_tracker_returns_the_golden_fixed_point_and_its_joint_covariance() -> None:
    for tracker in (
        RSSVB(STILL, MODEL, *INITIAL, solver=VariationalSolver(max_iterations=300, **EXACT)),
        RSSML(STILL, MODEL, *INITIAL, solver=MAPSolver(tolerance=1e-12)),
    ):
        tracker.update(XI[0])
        estimate = tracker.estimate
        same(estimate.position, [(18.069962, 20.878713), (41.402592, 36.511710)])
        same(estimate.log_amplitude, [9.284684, 9.059046])
        std = np.sqrt(estimate.covariance[:, [0, 1], [0, 1]])
        same(std, [(3.376997, 2.763690), (4.606965, 3.786303)])
        assert not estimate.diverged


def test_belief_may_be_assigned() -> None:
    tracker = RSSVB(STILL, MODEL, START[0], 64 * np.eye(2))
    x, P = tracker.x.copy(), tracker.P.copy()
    tracker.update(XI[0])
    first = tracker.estimate.position
    tracker.x, tracker.P = x, P
    tracker.update(XI[0])
    np.testing.assert_array_equal(tracker.estimate.position, first)


def test_likelihood_is_largest_at_the_true_shadowing() -> None:
    rng = np.random.default_rng(5)
    z = XI[0] + 0.3 * rng.standard_normal(8)
    trackers = {
        sigma: RSSVB(STILL, MODEL.replace(sigma=sigma), START[0], 64 * np.eye(2))
        for sigma in (0.03, 0.3, 3.0)
    }
    for tracker in trackers.values():
        tracker.update(z)
    assert max(trackers, key=lambda sigma: trackers[sigma].log_likelihood) == 0.3
    assert trackers[0.03].estimate.poor_fit
    assert not trackers[0.3].estimate.poor_fit


def test_correlated_readings_have_less_weight() -> None:
    z = MODEL.h(np.array([30.0, 20.0]))
    ends = []
    for tau in (None, 10.0):
        amplitude = AmplitudePrior(mean=0.0, drift=0.0)
        tracker = RSSVB(STILL, MODEL, [[31.0, 22.0]], 64 * np.eye(2), amplitude=amplitude,
                        correlation_time=tau)  # fmt: skip
        for _ in range(10):
            tracker.predict()
            tracker.update(z)
        ends.append(np.linalg.inv(tracker.estimate.covariance[0]) - np.eye(2) / 64)
    # weights: the first 1, nine 0.1 each, 1.9 instead of 10
    np.testing.assert_allclose(ends[1] / ends[0], 0.19, rtol=0.1)


@pytest.mark.parametrize("motion", [
    RandomWalk(q=6.0), ConstantVelocity(q=0.1), CoordinatedTurn(q=0.1, q_turn=1e-4)
])  # fmt: skip
def test_any_motion_keeps_labels_and_estimates_speeds(motion: Any) -> None:
    trial = CrossingSources(n_steps=25).sample(np.random.default_rng(2))
    n, xy = motion.dim_x, (0, 1) if motion.dim_x == 2 else (0, 2)
    x0 = np.zeros((3, n))
    x0[:, xy] = trial.truth[0] + 2.0
    P0 = np.diag([9.0, 6.0, 9.0, 6.0, 1e-4])[:n, :n] if n > 2 else 9 * np.eye(2)
    tracker = RSSVB(motion, trial.measurement.replace(position=xy), x0, P0)
    run = tracker.run(trial.measurements)
    assert (run.label == [0, 1, 2]).all()
    far = np.linalg.norm(run.position - trial.truth, axis=-1)
    if n == 2:  # a random walk loses the tracks where they cross
        assert np.median(far[:8]) < 4
    else:
        assert np.median(far[5:]) < 2
        speed = np.diff(trial.truth[-2:], axis=0)[0]
        states = run.x[-1].reshape(3, n + 1)
        np.testing.assert_allclose(states[:, [1, 3]], speed, atol=1.2)


def test_batch_with_missing_readings_equals_the_loop() -> None:
    trial = CrossingSources(n_steps=6).sample(np.random.default_rng(0))
    tracker = trial.tracker("rss_vb")
    z = trial.measurement.draw(
        np.broadcast_to(trial.log_amplitude, (5, 6, 3)),
        np.broadcast_to(trial.truth, (5, 6, 3, 2)), np.random.default_rng(1),
    )  # fmt: skip
    z[1, 2], z[3, :, 4], z[2, 0, ::2] = np.nan, np.nan, np.nan
    single = [trial.tracker("rss_vb").run(one) for one in z]
    for one, other in zip(tracker.run_batch(z), single, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
        np.testing.assert_array_equal(one.fit, other.fit)


# figures of section 13, seeded and small


def rms(case: Any, method: str, runs: int = 60) -> float:
    trials = draws(case, runs, 1)
    result = estimates(trials, method)
    return scores(result.theta, trials.theta, result.u, trials.u).location_rms


def test_one_source_reaches_the_bound() -> None:
    trials = draws(Table1K7(n_sources=1, prior_std=20.0), 200, 0)
    far = np.linalg.norm(estimates(trials, "vb").theta - trials.theta, axis=-1)[:, 0]
    bound = np.sqrt(np.mean(np.trace(bounds(trials).Sigma, axis1=-2, axis2=-1)))
    assert np.mean(far < 5) > 0.93
    assert np.sqrt(np.mean(far[far < 5] ** 2)) == pytest.approx(bound, rel=0.15)


def test_vb_from_a_random_start_has_smaller_errors_than_the_joint_maximum() -> None:
    case = Table1K3(start_at="random")
    ours, theirs = rms(case, "vb"), rms(case, "lm")
    assert 7.5 < ours < 13.5
    assert 12.0 < theirs < 21.0
    assert ours < 0.9 * theirs


def test_vb_and_joint_maximum_from_the_prior_are_equal_and_literal_refresh_is_worse() -> None:
    ours, theirs, literal = (rms(Table1K3(), name) for name in ("vb", "lm", "vb_literal"))
    assert 3.5 < ours < 7.0
    assert ours == pytest.approx(theirs, rel=0.25)
    assert literal > 1.2 * ours


def test_seven_sources_from_the_prior() -> None:
    ours, literal = rms(Table1K7(), "vb", 40), rms(Table1K7(), "vb_literal", 40)
    assert 2.3 < ours < 3.8
    assert literal > 1.3 * ours


def test_undamped_updates_diverge_and_are_flagged() -> None:
    undamped = VariationalSolver(sweep="jacobi", damping=1.0, line_search=False)
    for seed in range(6):
        trial = Table1K3().sample(np.random.default_rng(seed))
        tracker = trial.tracker("rss_vb", solver=undamped)
        tracker.update(trial.measurements[0])
        assert tracker.estimate.diverged or tracker.estimate.poor_fit  # type: ignore[attr-defined]
        assert np.isfinite(tracker.x).all()


def test_crossing_sources_are_tracked() -> None:
    inside, far = [], []
    for seed in range(4):
        trial = CrossingSources().sample(np.random.default_rng([10, seed]))
        run = trial.tracker("rss_vb").run(trial.measurements)
        miss = run.position - trial.truth
        far.append(np.hypot(*np.moveaxis(miss, -1, 0)))
        nees = np.einsum("tki,tkij,tkj->tk", miss, np.linalg.inv(run.covariance), miss)
        inside.append(nees < 5.991)
    assert np.median(far) < 1.0
    assert np.mean(inside) > 0.75


# errors and warnings


@pytest.mark.parametrize(
    ("settings", "params", "message"),
    [
        (AmplitudePrior, {"variance": 0.0}, "variance must be positive"),
        (AmplitudePrior, {"mean": np.nan}, "mean must be a finite number"),
        (AmplitudePrior, {"drift": -1.0}, "drift must be finite and not negative"),
        (VariationalSolver, {"damping": 1.5}, "damping must lie in"),
        (VariationalSolver, {"sweep": "gauss"}, "sweep must be one of"),
        (VariationalSolver, {"refresh": "never"}, "refresh must be one of"),
        (VariationalSolver, {"covariance": "both"}, "covariance must be one of"),
        (VariationalSolver, {"max_iterations": 0}, "max_iterations must be at least 1"),
        (MAPSolver, {"method": "newton"}, "method must be one of"),
        (GridSearch, {"grid_step": 0.0}, "grid_step must be finite and positive"),
        (BirthDeath, {"confirm_steps": 0}, "confirm_steps must be at least 1"),
    ],
)
def test_invalid_settings_raise_an_error(
    settings: type, params: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        settings(**params)


def test_settings_change_by_nested_names() -> None:
    tracker = RSSVB(STILL, MODEL, *INITIAL, births=True)
    tracker.set_params(solver__damping=0.5, amplitude__drift=0.0, births__confirm_steps=2)
    assert tracker.solver == VariationalSolver(damping=0.5)
    assert tracker.amplitude == AmplitudePrior(drift=0.0)
    assert tracker.births == BirthDeath(confirm_steps=2)


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"x0": [[1.0]]}, "x0 must be finite, of shape"),
        ({"x0": [[1.0, np.nan]]}, "x0 must be finite"),
        ({"P0": None}, "P0 must be the covariance .* if x0 is set; got None"),
        ({"P0": np.zeros((2, 2))}, "P0 must have positive variances of the positions"),
        ({"P0": np.eye(3)}, "P0 must have shape"),
        ({"amplitude": AmplitudePrior(mean=[9.0])}, "mean must be a number or have shape"),
        ({"n_sources": 3}, "n_sources must be 2, the sources of x0; got 3"),
        ({"births": True, "search": GridSearch(max_sources=1)}, "max_sources must be at least 2"),
        ({"correlation_time": 0.0}, "correlation_time must be finite and positive"),
        ({"measurement": MODEL.replace(position=(0, 2))}, "position of the measurement"),
    ],
)
def test_invalid_arguments_raise_an_error(params: dict[str, Any], message: str) -> None:
    good = {"motion": STILL, "measurement": MODEL, "x0": START[0], "P0": np.eye(2)}
    with pytest.raises(ValueError, match=message):
        RSSVB(**good | params)


def test_parts_of_the_wrong_type_raise_an_error() -> None:
    with pytest.raises(TypeError, match="measurement must be a LogNormalRSS"):
        RSSVB(STILL, "rss", START[0], np.eye(2))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="births must be a BirthDeath, True, False or None"):
        RSSVB(STILL, MODEL, *INITIAL, births=3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="motion must be a MotionModel"):
        RSSVB(None, MODEL, START[0], np.eye(2))  # type: ignore[arg-type]


def test_invalid_readings_leave_the_belief_unchanged() -> None:
    tracker = RSSVB(STILL, MODEL, START[0], 64 * np.eye(2))
    before = tracker.x.copy()
    for z in (np.full(8, -70.0), np.full(8, 80.0), np.zeros(3)):
        with pytest.raises(ValueError, match=r"readings|z must"):
            tracker.update(z)
        np.testing.assert_array_equal(tracker.x, before)
    with pytest.raises(ValueError, match="u must be None or 0"):
        tracker.predict(1.0)


def test_fewer_readings_than_unknowns_raise_a_warning() -> None:
    few = MODEL.replace(sensors=SENSORS[:5])
    with pytest.warns(UserWarning, match="5 readings are fewer than the 6 unknowns of 2 sources"):
        tracker = RSSVB(STILL, few, START[0], 64 * np.eye(2))
    tracker.update(XI[0, :5])
    assert np.isfinite(tracker.estimate.position).all()
    with pytest.warns(UserWarning, match="depends on the prior"):
        alone = RSSML(STILL, few, *INITIAL, solver=MAPSolver(prior=False))
    with pytest.raises(
        ValueError, match="readings must be at least 6, the number of unknowns; got 5"
    ):
        alone.update(XI[0, :5])


def test_a_start_on_a_sensor_raises_a_warning() -> None:
    with pytest.warns(UserWarning, match="source 1 starts on sensor 3"):
        RSSVB(STILL, MODEL, [[10.0, 10.0], [0.0, 60.0]], 64 * np.eye(2))


def test_run_batch_with_births_in_several_workers_equals_single_runs() -> None:
    tracker = RSSVB(STILL, MODEL, *INITIAL, births=True)
    rng = np.random.default_rng(0)
    zs = [[MODEL.draw(np.full(2, 9.2), INITIAL[0][:2], rng) for _ in range(3)] for _ in range(3)]
    with parallel_config(backend="threading", n_jobs=2):
        runs = tracker.run_batch(zs)
    for z, run in zip(zs, runs, strict=True):
        np.testing.assert_array_equal(run.x, copy.deepcopy(tracker).run(z).x)
