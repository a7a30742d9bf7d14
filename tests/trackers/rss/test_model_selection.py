"""Sources that nobody told of: found, counted, born and dead."""

import warnings

import numpy as np
import pytest

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.motion_models import ConstantVelocity, RandomWalk
from arrivals.scenarios.reproduce.rss.birth_death import (
    gospa_over_time,
    told_nothing,
    told_the_truth,
)
from arrivals.scenarios.simulations.moving_emitters import BirthsAndDeaths
from arrivals.scenarios.simulations.signal_strength import in_disc
from arrivals.trackers import RSSML, RSSVB
from arrivals.trackers.rss.inference.joint_posterior import JointPosterior, Prior
from arrivals.trackers.rss.model_order.birth_death import SURE, TrackTable
from arrivals.trackers.rss.model_order.grid_search import NewSourcePrior, scan
from arrivals.trackers.rss.model_order.model_selection import (
    Candidate,
    best,
    grown,
    nothing,
    refined,
)
from arrivals.typing import Float

NOISE = float(db_to_neper(40.0))
V0 = float(db_to_neper(3.0)) ** 2


def field(seed: int, n_sensors: int = 100) -> LogNormalRSS:
    places = in_disc(np.random.default_rng(seed), (n_sensors,), 100.0)
    return LogNormalRSS(places, log_noise=NOISE, position=(0, 1))


TRUTH = np.array([[-50.0, 10.0], [20.0, -40.0], [35.0, 45.0]])
U = db_to_neper([82.0, 79.0, 80.0])


def test_evidence_is_the_integral() -> None:
    """One source, by quadrature over its three numbers."""
    heard = field(0, 6).replace(n_snapshots=400)
    new = NewSourcePrior(float(U[0]), V0, np.array([-45.0, 15.0]), 6.0, 2.0)
    xi = heard.levels(U[:1], TRUTH[:1]).log_sigma
    problem = JointPosterior(heard.field, xi, 1 / heard.variance, new.prior(1))
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


def test_scan_finds_the_place_and_power_that_explain_most() -> None:
    heard = field(1)
    new = NewSourcePrior.among(heard.sensors, 9.2, V0)
    xi = heard.levels(U[:1], TRUTH[:1]).log_sigma
    empty = nothing(heard.field, xi, 1 / heard.variance)
    u, place = scan(empty.problem, empty.levels.log_sigma, new)[0]
    assert np.abs(place - TRUTH[0]).max() <= new.step
    assert abs(u - U[0]) < 0.4


def test_missing_readings_do_not_count_in_a_scan() -> None:
    heard = field(2, 40)
    xi = heard.levels(U[:1], TRUTH[:1]).log_sigma
    W = 1 / heard.variance.copy()
    W[::3] = 0.0
    spoilt = np.where(W > 0, xi, 0.0)
    new = NewSourcePrior.among(heard.sensors, 9.2, V0)
    fit = grown(heard.field, spoilt, W, new, 1)[1]
    np.testing.assert_allclose(fit.theta, TRUTH[:1], atol=0.5)


@pytest.mark.parametrize("K", [0, 1, 2, 3])
def test_number_of_sources_is_found(K: int) -> None:
    right = 0
    for seed in range(6):
        heard = field(10 + seed)
        xi = heard.draw(U[:K], TRUTH[:K], np.random.default_rng(seed))
        new = NewSourcePrior.among(heard.sensors, 9.21, V0)
        fit = best(grown(heard.field, xi, 1 / heard.variance, new, 5, patience=2), new)
        right += len(fit.u) == K
    assert right >= 5


def test_pruning_takes_a_needless_source_away() -> None:
    heard = field(3)
    xi = heard.levels(U, TRUTH).log_sigma
    new = NewSourcePrior.among(heard.sensors, 9.21, V0)
    prior = Prior(*(np.concatenate([part, part[:1]]) for part in new.prior(3)))
    split = np.vstack([TRUTH, TRUTH[0] + 3.0])
    u = np.append(U, U[0]) - np.array([0.35, 0, 0, 0.35])
    fit = Candidate(JointPosterior(heard.field, xi, 1 / heard.variance, prior), u, split).refitted()
    found = best([fit], new)
    assert len(found.u) == 3
    assert refined(fit, new).theta.shape == (4, 2)


@pytest.mark.parametrize("kind", [RSSVB, RSSML])
def test_tracker_finds_as_many_as_it_is_asked_for(kind: type[RSSVB] | type[RSSML]) -> None:
    heard = field(4)
    tracker = kind(RandomWalk(q=0.1), heard, n_sources=3)
    assert tracker.estimate.n_found == 0
    tracker.update(heard.draw(U, TRUTH, np.random.default_rng(0)))
    far = np.linalg.norm(tracker.estimate.position[:, None] - TRUTH, axis=-1)
    assert (far.min(axis=0) < 5).all()
    np.testing.assert_array_equal(tracker.estimate.label, [0, 1, 2])


def test_more_sources_than_the_readings_tell_apart_are_warned_of() -> None:
    heard = field(5)
    z = heard.draw(U[:1], TRUTH[:1], np.random.default_rng(0))
    tracker = RSSVB(RandomWalk(q=0.1), heard, n_sources=4)
    with pytest.warns(UserWarning, match="the readings tell 1 sources apart, not 4"):
        tracker.update(z)
    assert tracker.estimate.n_found == 4
    few = RSSVB(RandomWalk(q=0.1), field(5, 5), n_sources=2)
    with pytest.warns(UserWarning, match="5 readings are fewer than the 6 unknowns"):
        few.update(z[:5])


def test_a_state_with_speeds_wants_to_know_how_fast_new_sources_may_be() -> None:
    heard = field(6).replace(position=(0, 2))
    with pytest.raises(ValueError, match=r"P0 must be given, shape \(4, 4\): how fast"):
        RSSVB(ConstantVelocity(q=0.1), heard, n_sources=1)
    with pytest.raises(ValueError, match="mu0 must be one number where x0 is None"):
        RSSVB(ConstantVelocity(q=0.1), heard, P0=np.eye(4), mu0=[9.0, 9.0])


# births and deaths


def test_confirming_takes_as_many_steps_as_asked_either_way() -> None:
    for confirm in (1, 3, 5):
        census = TrackTable.known(0).with_newborn([100.0], confirm)
        steps = 1
        while not census.confirmed.all():
            census = census.weighed(np.array([100.0]), confirm)
            steps += 1
        assert steps == confirm
        for _ in range(confirm):
            assert census.odds[0] > -SURE
            census = census.weighed(np.array([-100.0]), confirm)
        assert census.odds[0] == -SURE


def on_and_off(positions: Float) -> list[int]:
    return [int(n) for n in np.isfinite(positions[..., 0]).sum(axis=1)]


def test_a_source_is_shown_after_three_steps_and_gone_after_three() -> None:
    heard = field(7)
    rng = np.random.default_rng(1)
    one, two = (heard.draw(np.tile(U[:k], (8, 1)), np.tile(TRUTH[:k], (8, 1, 1)), rng)
                for k in (1, 2))  # fmt: skip
    tracker = RSSVB(RandomWalk(q=0.5), heard, births=True)
    run = tracker.run(np.vstack([one, two, one]))
    assert run.n_found.tolist() == [0, 0, *[1] * 8, *[2] * 8, *[1] * 6]
    assert (run.label[2:, 0] == 0).all()
    assert np.nanmin(run.existence[5:10, 0]) > 0.98


def test_noise_alone_gives_birth_to_nothing() -> None:
    heard = field(8)
    z = heard.draw(np.zeros((12, 0)), np.zeros((12, 0, 2)), np.random.default_rng(0))
    assert RSSVB(RandomWalk(q=0.5), heard, births=True).run(z).n_found.max() == 0


def test_told_nothing_costs_little_more_than_told_the_truth() -> None:
    trial = BirthsAndDeaths(n_steps=30).sample(np.random.default_rng([11, 0]))
    blind, told = told_nothing(trial), told_the_truth(trial)
    assert on_and_off(told) == on_and_off(trial.truth)
    ours, best_possible = gospa_over_time(trial, blind), gospa_over_time(trial, told)
    assert best_possible.missed == best_possible.false == 0
    changes = np.abs(np.diff(np.isfinite(trial.truth[..., 0]).astype(int), axis=0)).sum()
    delay = 3 * (changes + 2) * 5.0 / 30  # three steps each, at half the cut-off
    assert ours.total < best_possible.total + delay + 1.0


def test_known_sources_may_be_joined_by_others() -> None:
    heard = field(9)
    z = heard.draw(np.tile(U[:2], (6, 1)), np.tile(TRUTH[:2], (6, 1, 1)), np.random.default_rng(0))
    tracker = RSSVB(RandomWalk(q=0.5), heard, TRUTH[:1] + 1.0, 4 * np.eye(2), births=True)
    run = tracker.run(z)
    assert run.n_found.tolist() == [1, 1, 2, 2, 2, 2]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tracker.label[:2].tolist() == [0, 1]
