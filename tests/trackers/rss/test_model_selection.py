"""Tests of sources of unknown number: grid search, model selection, births and deaths."""

import warnings

import numpy as np
import pytest

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
from arrivals.motion_models import ConstantVelocity, RandomWalk
from arrivals.scenarios.reproduce.rss.birth_death import (
    gospa_over_time,
    track_known_births,
    track_unknown_births,
)
from arrivals.scenarios.simulations.moving_emitters import BirthsAndDeaths
from arrivals.scenarios.simulations.signal_strength import in_disc
from arrivals.trackers import RSSML, RSSVB, AmplitudePrior
from arrivals.trackers.rss.detection import select_sources
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior, grid_search
from arrivals.trackers.rss.model_order.model_selection import (
    Candidate,
    best_model,
    forward_selection,
    local_search,
    no_source,
)
from arrivals.trackers.rss.model_order.track_table import MAX_LOG_ODDS, TrackTable
from arrivals.typing import Float

NOISE = float(db_to_neper(40.0))
V0 = float(db_to_neper(3.0)) ** 2


def network(seed: int, n_sensors: int = 100) -> LogNormalRSS:
    sensors = in_disc(np.random.default_rng(seed), (n_sensors,), 100.0)
    return LogNormalRSS(sensors, log_noise=NOISE, position=(0, 1))


TRUTH = np.array([[-50.0, 10.0], [20.0, -40.0], [35.0, 45.0]])
U = db_to_neper([82.0, 79.0, 80.0])


def test_evidence_equals_the_integral() -> None:
    """Compare with quadrature over the three parameters of one source."""
    model = network(0, 6).replace(sigma__n_snapshots=400)
    new = NewSourcePrior(float(U[0]), V0, np.array([-45.0, 15.0]), 6.0, 2.0)
    xi = model.levels(U[:1], TRUTH[:1]).log_sigma
    problem = JointPosterior(model.propagation, xi, 1 / model.variance, new.prior(1))
    fit = Candidate(problem, U[:1], TRUTH[:1]).refitted()
    J = problem.information(fit.levels)
    std = np.sqrt(np.diag(np.linalg.inv(J)))
    n, reach = 41, 6.0
    axes = [c + reach * s * np.linspace(-1, 1, n)
            for c, s in zip([fit.u[0], *fit.theta[0]], std, strict=True)]  # fmt: skip
    u, x, y = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    L = problem.log_posterior(u[:, None], np.stack([x, y], axis=-1)[:, None])
    prior = 0.5 * np.log(1 / V0 / 6.0**4) - 1.5 * np.log(2 * np.pi)
    cell = np.prod([axis[1] - axis[0] for axis in axes])
    assert fit.log_evidence == pytest.approx(float(np.log(np.exp(L + prior).sum() * cell)), abs=0.1)


def test_grid_search_returns_the_true_position_and_power() -> None:
    model = network(1)
    new = NewSourcePrior.among(model.sensors, 9.2, V0)
    xi = model.levels(U[:1], TRUTH[:1]).log_sigma
    empty = no_source(model.propagation, xi, 1 / model.variance)
    u, position = grid_search(empty.problem, empty.levels.log_sigma, new)[0]
    assert np.abs(position - TRUTH[0]).max() <= new.step
    assert abs(u - U[0]) < 0.4


def test_missing_readings_do_not_affect_the_grid_search() -> None:
    model = network(2, 40)
    xi = model.levels(U[:1], TRUTH[:1]).log_sigma
    W = 1 / model.variance.copy()
    W[::3] = 0.0
    incomplete = np.where(W > 0, xi, 0.0)
    new = NewSourcePrior.among(model.sensors, 9.2, V0)
    fit = forward_selection(no_source(model.propagation, incomplete, W), new, 1)[1]
    np.testing.assert_allclose(fit.theta, TRUTH[:1], atol=0.5)


@pytest.mark.parametrize("K", [0, 1, 2, 3])
def test_number_of_sources_is_estimated(K: int) -> None:
    right = 0
    for seed in range(6):
        model = network(10 + seed)
        xi = model.draw(U[:K], TRUTH[:K], np.random.default_rng(seed))
        new = NewSourcePrior.among(model.sensors, 9.21, V0)
        empty = no_source(model.propagation, xi, 1 / model.variance)
        fit = best_model(forward_selection(empty, new, 5, patience=2), new)
        right += len(fit.u) == K
    assert right >= 5


def test_local_search_removes_a_superfluous_source() -> None:
    model = network(3)
    xi = model.levels(U, TRUTH).log_sigma
    new = NewSourcePrior.among(model.sensors, 9.21, V0)
    prior = Prior(*(np.concatenate([part, part[:1]]) for part in new.prior(3)))
    split = np.vstack([TRUTH, TRUTH[0] + 3.0])
    u = np.append(U, U[0]) - np.array([0.35, 0, 0, 0.35])
    fit = Candidate(
        JointPosterior(model.propagation, xi, 1 / model.variance, prior), u, split
    ).refitted()
    result = best_model([fit], new)
    assert len(result.u) == 3
    assert local_search(fit, new, same_number=True).theta.shape == (4, 2)


@pytest.mark.parametrize("kind", [RSSVB, RSSML])
def test_tracker_detects_the_requested_number_of_sources(kind: type[RSSVB] | type[RSSML]) -> None:
    model = network(4)
    tracker = kind(RandomWalk(q=0.1), model, n_sources=3)
    assert tracker.estimate.n_found == 0
    tracker.update(model.draw(U, TRUTH, np.random.default_rng(0)))
    far = np.linalg.norm(tracker.estimate.position[:, None] - TRUTH, axis=-1)
    assert (far.min(axis=0) < 5).all()
    np.testing.assert_array_equal(tracker.estimate.label, [0, 1, 2])


def test_unsupported_number_of_sources_raises_a_warning() -> None:
    model = network(5)
    z = model.draw(U[:1], TRUTH[:1], np.random.default_rng(0))
    tracker = RSSVB(RandomWalk(q=0.1), model, n_sources=4)
    with pytest.warns(UserWarning, match="the readings support 1 sources, not 4"):
        tracker.update(z)
    assert tracker.estimate.n_found == 4
    few = RSSVB(RandomWalk(q=0.1), network(5, 5), n_sources=2)
    with pytest.warns(UserWarning, match="5 readings are fewer than the 6 unknowns"):
        few.update(z[:5])


def test_a_state_with_velocities_requires_their_covariance() -> None:
    model = network(6).replace(position=(0, 2))
    with pytest.raises(
        ValueError, match=r"P0 must have shape \(4, 4\); got None: new sources need"
    ):
        RSSVB(ConstantVelocity(q=0.1), model, n_sources=1)
    with pytest.raises(ValueError, match=r"amplitude\.mean must be one number where x0 is None"):
        RSSVB(ConstantVelocity(q=0.1), model, P0=np.eye(4), amplitude=AmplitudePrior([9.0, 9.0]))


# births and deaths


def test_confirmation_and_deletion_take_the_requested_steps() -> None:
    for confirm_steps in (1, 3, 5):
        tracks = TrackTable.certain(0).extended([100.0], confirm_steps)
        steps = 1
        while not tracks.confirmed.all():
            tracks = tracks.updated(np.array([100.0]), confirm_steps)
            steps += 1
        assert steps == confirm_steps
        for _ in range(confirm_steps):
            assert tracks.log_odds[0] > -MAX_LOG_ODDS
            tracks = tracks.updated(np.array([-100.0]), confirm_steps)
        assert tracks.log_odds[0] == -MAX_LOG_ODDS


def test_existence_follows_the_whole_evidence_of_a_step() -> None:
    tracks = TrackTable.certain(0).extended([100.0, 100.0, 100.0], 1)
    after = tracks.updated(np.array([-100.0, -MAX_LOG_ODDS, 0.0]), 3)
    np.testing.assert_allclose(after.existence, [0.01, 0.5, 0.99])
    assert after.active.all()  # the decision to delete takes three steps


def n_active(positions: Float) -> list[int]:
    return [int(n) for n in np.isfinite(positions[..., 0]).sum(axis=1)]


def test_a_source_is_confirmed_after_three_steps_and_deleted_after_three() -> None:
    model = network(7)
    rng = np.random.default_rng(1)
    one, two = (model.draw(np.tile(U[:k], (8, 1)), np.tile(TRUTH[:k], (8, 1, 1)), rng)
                for k in (1, 2))  # fmt: skip
    tracker = RSSVB(RandomWalk(q=0.5), model, births=True)
    run = tracker.run(np.vstack([one, two, one]))
    assert run.n_found.tolist() == [0, 0, *[1] * 8, *[2] * 8, *[1] * 6]
    assert (run.label[2:, 0] == 0).all()
    assert np.nanmin(run.existence[5:10, 0]) > 0.98


def test_noise_alone_initiates_no_track() -> None:
    model = network(8)
    z = model.draw(np.zeros((12, 0)), np.zeros((12, 0, 2)), np.random.default_rng(0))
    assert RSSVB(RandomWalk(q=0.5), model, births=True).run(z).n_found.max() == 0


def test_unknown_births_cost_little_more_than_known_ones() -> None:
    trial = BirthsAndDeaths(n_steps=30).sample(np.random.default_rng([11, 0]))
    unknown, known = track_unknown_births(trial), track_known_births(trial)
    assert n_active(known) == n_active(trial.truth)
    ours, best_possible = gospa_over_time(trial, unknown), gospa_over_time(trial, known)
    assert best_possible.missed == best_possible.false == 0
    changes = np.abs(np.diff(np.isfinite(trial.truth[..., 0]).astype(int), axis=0)).sum()
    delay = 3 * (changes + 2) * 5.0 / 30  # three steps for each change, at half the cut-off
    assert ours.total < best_possible.total + delay + 1.0


def test_new_sources_join_known_ones() -> None:
    model = network(9)
    z = model.draw(np.tile(U[:2], (6, 1)), np.tile(TRUTH[:2], (6, 1, 1)), np.random.default_rng(0))
    tracker = RSSVB(RandomWalk(q=0.5), model, TRUTH[:1] + 1.0, 4 * np.eye(2), births=True)
    run = tracker.run(z)
    assert run.n_found.tolist() == [1, 1, 2, 2, 2, 2]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tracker.label[:2].tolist() == [0, 1]


def test_search_in_many_sensors_ends_at_the_maximum_of_all_readings() -> None:
    rng = np.random.default_rng(0)
    model = PropagationModel(rng.uniform(-100.0, 100.0, (9000, 2)), log_noise=4.6)
    truth = np.array([[-40.0, 10.0], [30.0, 50.0]])
    xi = model.levels(np.array([9.0, 9.2]), truth).log_sigma + 0.1 * rng.normal(size=9000)
    new = NewSourcePrior.among(model.sensors, mu=9.2, v=0.12)
    empty = no_source(model, xi, np.full(9000, 100.0))
    few = empty.thinned()
    assert few is not empty
    assert len(few.problem.W) == 2250
    assert few.thinned() is few
    for n_sources in (2, None):
        best = select_sources(empty, new, n_sources, 4)
        assert best.problem.W.shape == (9000,)
        again = best.refitted()
        np.testing.assert_allclose(again.theta, best.theta, atol=1e-4)
        np.testing.assert_allclose(best.theta[best.theta[:, 0].argsort()], truth, atol=0.5)


def test_source_that_only_all_readings_show_is_added() -> None:
    rng = np.random.default_rng(2)
    model = PropagationModel(rng.uniform(-100.0, 100.0, (20_000, 2)), log_noise=4.6)
    truth = np.array([[-40.0, 10.0], [30.0, 50.0]])
    xi = model.levels(np.array([9.0, 6.9]), truth).log_sigma + rng.normal(size=20_000)
    new = NewSourcePrior.among(model.sensors, mu=8.0, v=4.0)
    empty = no_source(model, xi, np.full(20_000, 1.0))
    assert len(best_model(forward_selection(empty.thinned(), new, 3), new).u) == 1
    assert len(select_sources(empty, new, None, 3).u) == 2
