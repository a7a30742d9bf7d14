"""Variational Bayes for signal strength: the golden case, laws, errors, and seeded trials."""

from typing import Any

import numpy as np
import pytest
from scipy.differentiate import hessian, jacobian

from arrivals.measurement_models import LogNormalRSS, db_to_neper
from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
from arrivals.motion_models import ConstantVelocity, CoordinatedTurn, RandomWalk
from arrivals.scenarios.metrics.position_errors import scores
from arrivals.scenarios.reproduce.rss.trials import answers, bounds, draws
from arrivals.scenarios.simulations.moving_emitters import CrossingSources
from arrivals.scenarios.simulations.signal_strength import Table1K3, Table1K7
from arrivals.trackers import RSSML, RSSVB
from arrivals.trackers.rss.belief import SourceBeliefs, unflat
from arrivals.trackers.rss.inference.factors import bowl_of
from arrivals.trackers.rss.inference.joint_posterior import (
    JointPosterior,
    Marginals,
    Prior,
    inverse_2x2,
    marginals,
)
from arrivals.trackers.rss.inference.map_search import maximum
from arrivals.trackers.rss.inference.variational import (
    VariationalIterate,
    VariationalSettings,
    solve,
)
from arrivals.typing import Float

# section 12

SENSORS = np.array([(0, 0), (60, 0), (60, 60), (0, 60), (30, -15), (75, 30), (30, 75), (-15, 30)])
FIELD = PropagationModel(SENSORS.astype(float), 2.0, float(db_to_neper(40.0)), 1.0)
MU = np.full((1, 2), float(db_to_neper(80.0)))
START = np.array([[[24.0, 18.0], [40.0, 42.0]]])
PRIOR = Prior(MU, np.full((1, 2), 1 / float(db_to_neper(3.0)) ** 2), START,
              np.tile(np.eye(2) / 64, (1, 2, 1, 1)))  # fmt: skip
XI = FIELD.levels(db_to_neper([[81.0, 78.0]]), np.array([[[18.0, 22.0], [44.0, 36.0]]])).log_sigma
GOLDEN = JointPosterior(FIELD, XI, np.full((1, 8), 200.0), PRIOR)
EXACT: dict[str, Any] = {"tol_u": 0.0, "tol_theta": 0.0}


def golden(**how: Any) -> VariationalIterate:
    return solve(GOLDEN, MU, START, VariationalSettings(**EXACT | how))


def same(value: Any, expected: Any) -> None:
    np.testing.assert_allclose(np.squeeze(value), expected, rtol=0, atol=1e-5)


def test_golden_readings_and_shares() -> None:
    same(XI, [6.064946, 5.788684, 5.868353, 5.787123, 5.829661, 5.809926, 5.700325, 5.914332])
    found = FIELD.levels(MU, START)
    same(found.log_sigma, [5.96198, 5.838962, 6.052577, 5.779475, 5.882808, 5.845435, 5.866214,
                           5.764477])  # fmt: skip
    same(found.shares, [
        [0.736627, 0.523392, 0.180749, 0.408127, 0.690407, 0.304914, 0.24442, 0.591051],
        [0.197076, 0.391818, 0.763941, 0.496371, 0.231922, 0.611387, 0.675289, 0.310539],
    ])  # fmt: skip
    same(GOLDEN.log_posterior(MU, START), -10.118834)


def test_golden_jacobi_cycle() -> None:
    found = golden(sweep="jacobi", guard=False, max_cycles=1)
    same(found.u, [9.220093, 9.094960])
    same(1 / found.w, [0.002455, 0.002446])
    same(found.theta, [(17.365096, 18.005596), (34.745842, 35.767836)])
    same(inverse_2x2(found.P), [[(5.764337, -1.158485), (-1.158485, 4.992632)],
                                [(7.692249, -0.421781), (-0.421781, 6.348430)]])  # fmt: skip


@pytest.mark.parametrize("how", [{}, {"sweep": "jacobi", "damping": 0.5}])
def test_golden_fixed_point(how: dict[str, Any]) -> None:
    found = golden(max_cycles=800 if how else 300, **how)
    same(found.u, [9.284684, 9.059046])
    same(found.theta, [(18.069962, 20.878713), (41.402592, 36.511710)])
    same(1 / found.w, [0.001860, 0.003563])
    same(inverse_2x2(found.P), [[(4.694445, -0.527914), (-0.527914, 4.332690)],
                                [(8.510042, -1.145833), (-1.145833, 7.993878)]])  # fmt: skip
    same(found.log_posterior, -0.850739)
    J = GOLDEN.information(FIELD.levels(found.u, found.theta))
    std = np.sqrt(np.diag(np.linalg.inv(J[0])))
    same(std, [0.130671, 0.194443, 3.376997, 2.763690, 4.606965, 3.786303])


def test_golden_literal_refresh() -> None:
    found = golden(sweep="jacobi", refresh="literal", max_cycles=10)
    same(found.u, [9.231220, 9.138542])
    same(found.theta, [(17.289441, 20.130556), (39.245817, 35.421061)])
    same(1 / found.w, [0.000226, 0.000297])


def test_fixed_point_is_the_joint_maximum() -> None:
    found = golden(max_cycles=400)
    assert np.abs(GOLDEN.gradient(found.u, found.theta)).max() < 1e-9
    one = JointPosterior(FIELD, XI[0], GOLDEN.W[0], PRIOR.take(0))
    for method, tolerance in (("lm", 1e-6), ("bfgs", 1e-2)):
        best = maximum(one, found.u[0], found.theta[0], method, tolerance=1e-12)  # type: ignore[arg-type]
        np.testing.assert_allclose(best.theta, found.theta[0], atol=tolerance)


# slopes against differences, for an exponent that is not 2

CURVED = GOLDEN._replace(field=FIELD._replace(alpha=3.0))


def test_gradient_of_the_joint_posterior_is_its_slope() -> None:
    def along(x: Float) -> Float:
        moved = np.moveaxis(x, 0, -1)
        return CURVED.log_posterior(moved[..., :2], moved[..., 2:].reshape(*moved.shape[:-1], 2, 2))

    x = np.concatenate([MU[0] + 0.1, START[0].ravel() + 1.0])
    slope = jacobian(along, x, tolerances={"rtol": 1e-10}).df
    ours = CURVED.gradient(x[None, :2], x[None, 2:].reshape(1, 2, 2))
    np.testing.assert_allclose(ours[0], slope, rtol=1e-6)


def test_gradient_and_hessian_of_the_bowl_are_its_slopes() -> None:
    found = CURVED.field.levels(MU, START)
    r = (CURVED.xi - found.log_sigma)[:, None]
    bowl = bowl_of(CURVED, 1.5 * found.shares, r, found.offsets.log_range, slice(None))
    near = START + np.array([[-3.0, 4.0], [2.0, -5.0]])
    gradient, H = bowl.slopes(near, bowl.look(near))
    for j in range(2):

        def phi(x: Float, j: int = j) -> Float:
            def one(place: Float) -> float:
                theta = near.copy()
                theta[0, j] = place
                return float(bowl.look(theta).phi[0, j])

            return np.apply_along_axis(one, 0, x)

        slope = jacobian(phi, near[0, j], tolerances={"rtol": 1e-9}).df
        np.testing.assert_allclose(gradient[0, j], slope, rtol=1e-6)
        bend = hessian(phi, near[0, j], tolerances={"rtol": 1e-7}).ddf
        if np.linalg.eigvalsh(bend)[0] > 0.01:
            np.testing.assert_allclose(H[0, j], bend, rtol=1e-5)
        assert np.linalg.eigvalsh(H[0, j])[0] > 0


# laws


def test_one_source_without_noise_is_linear_in_its_logarithms() -> None:
    quiet = FIELD._replace(log_noise=-np.inf)
    u, theta = np.array([[9.0]]), np.array([[[20.0, 20.0]]])
    found = quiet.levels(u, theta)
    far = quiet.levels(u + 0.7, theta + 15.0)
    log_range = far.offsets.log_range - found.offsets.log_range
    np.testing.assert_allclose(found.shares, 1.0)
    np.testing.assert_allclose(far.log_sigma, found.log_sigma + 0.7 - log_range[:, 0], atol=1e-12)


def test_literal_covariance_shrinks_with_the_cycles() -> None:
    rng = np.random.default_rng(0)
    sensors = rng.uniform(-80, 80, (60, 2))
    field = FIELD._replace(sensors=sensors)
    theta, u = np.array([[[5.0, 5.0]]]), np.array([[9.2]])
    prior = Prior(u, np.full((1, 1), 1e-6), theta, 1e-6 * np.eye(2)[None, None])
    problem = JointPosterior(
        field, field.levels(u, theta).log_sigma, np.full((1, 60), 200.0), prior
    )
    right = solve(problem, u, theta, VariationalSettings(**EXACT))
    for cycles in (4, 16):
        wrong = solve(
            problem, u, theta, VariationalSettings(refresh="literal", max_cycles=cycles, **EXACT)
        )
        ratio = np.sqrt(np.trace(right.P[0, 0]) / np.trace(wrong.P[0, 0]))
        assert ratio * np.sqrt(cycles) == pytest.approx(1, rel=0.05)


def test_factors_are_surer_than_the_joint_posterior() -> None:
    found = golden(max_cycles=100)
    joint = marginals(GOLDEN.information(FIELD.levels(found.u, found.theta)))
    assert (1 / found.w < joint.v).all()
    wider = np.linalg.eigvalsh(joint.Sigma - inverse_2x2(found.P))
    assert (wider > 0).all()


def test_guarded_cycles_never_end_below_their_start() -> None:
    trials = draws(Table1K7(start_at="random"), 20, 0)
    found = answers(trials, "vb").solution
    assert found is not None
    assert (found.log_posterior >= found.start).all()


def test_readings_without_weight_tell_nothing() -> None:
    silent = GOLDEN._replace(W=np.zeros((1, 8)))
    found = solve(silent, MU + 1, START + 9.0, VariationalSettings(max_cycles=60, **EXACT))
    np.testing.assert_allclose(found.theta, START, atol=1e-6)
    np.testing.assert_allclose(found.u, MU, atol=1e-9)


def test_correction_of_a_state_is_the_kalman_filters() -> None:
    """A position measured with noise R tells of the rest what a Kalman update tells."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(4, 4))
    P, R, x, z = A @ A.T, np.diag([2.0, 3.0]), rng.normal(size=4), rng.normal(size=2)
    H = np.eye(4)[::2]
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    x_post, P_post = x + K @ (z - H @ x), P - K @ H @ P
    before = SourceBeliefs(x[None], P[None], np.zeros(1), np.ones(1))
    told = Marginals(np.ones(1), (H @ P_post @ H.T)[None])
    after = before.corrected(np.zeros(1), (H @ x_post)[None], told, (0, 2), ())
    np.testing.assert_allclose(after.x[0], x_post, atol=1e-10)
    np.testing.assert_allclose(after.P[0], P_post, atol=1e-10)


def test_flat_belief_is_a_round_trip() -> None:
    rng = np.random.default_rng(0)
    own = SourceBeliefs(rng.normal(size=(2, 4)), np.array([np.eye(4), 2 * np.eye(4)]), np.ones(2),
                  np.full(2, 3.0))  # fmt: skip
    for mine, back in zip(own, unflat(*own.flat(5), 4), strict=True):
        np.testing.assert_array_equal(mine, back)


# the tracker

HEARD = LogNormalRSS(SENSORS, log_noise=float(db_to_neper(40.0)), position=(0, 1))
STILL = RandomWalk(q=0.0)


def test_tracker_gives_the_golden_fixed_point_and_its_joint_covariance() -> None:
    for tracker in (
        RSSVB(STILL, HEARD, START[0], 64 * np.eye(2), max_cycles=300, tol_u=0, tol_theta=0),
        RSSML(STILL, HEARD, START[0], 64 * np.eye(2), tolerance=1e-12),
    ):
        tracker.update(XI[0])
        estimate = tracker.estimate
        same(estimate.position, [(18.069962, 20.878713), (41.402592, 36.511710)])
        same(estimate.log_amplitude, [9.284684, 9.059046])
        std = np.sqrt(estimate.covariance[:, [0, 1], [0, 1]])
        same(std, [(3.376997, 2.763690), (4.606965, 3.786303)])
        assert not estimate.diverged


def test_belief_may_be_assigned() -> None:
    tracker = RSSVB(STILL, HEARD, START[0], 64 * np.eye(2))
    x, P = tracker.x.copy(), tracker.P.copy()
    tracker.update(XI[0])
    first = tracker.estimate.position
    tracker.x, tracker.P = x, P
    tracker.update(XI[0])
    np.testing.assert_array_equal(tracker.estimate.position, first)


def test_likelihood_prefers_the_right_shadowing() -> None:
    rng = np.random.default_rng(5)
    z = XI[0] + 0.3 * rng.standard_normal(8)
    told = {
        sigma: RSSVB(STILL, HEARD.replace(sigma=sigma), START[0], 64 * np.eye(2))
        for sigma in (0.03, 0.3, 3.0)
    }
    for tracker in told.values():
        tracker.update(z)
    assert max(told, key=lambda sigma: told[sigma].log_likelihood) == 0.3
    assert told[0.03].estimate.poor_fit
    assert not told[0.3].estimate.poor_fit


def test_correlated_readings_count_less() -> None:
    z = HEARD.h(np.array([30.0, 20.0]))
    ends = []
    for tau in (None, 10.0):
        tracker = RSSVB(STILL, HEARD, [[31.0, 22.0]], 64 * np.eye(2), mu0=0.0, q_u=0.0,
                        correlation_time=tau)  # fmt: skip
        for _ in range(10):
            tracker.predict()
            tracker.update(z)
        ends.append(np.linalg.inv(tracker.estimate.covariance[0]) - np.eye(2) / 64)
    # the first counts in full, nine a tenth each: 1.9 in place of 10
    np.testing.assert_allclose(ends[1] / ends[0], 0.19, rtol=0.1)


@pytest.mark.parametrize("motion", [
    RandomWalk(q=6.0), ConstantVelocity(q=0.1), CoordinatedTurn(q=0.1, q_turn=1e-4)
])  # fmt: skip
def test_any_motion_keeps_labels_and_finds_speeds(motion: Any) -> None:
    trial = CrossingSources(n_steps=25).sample(np.random.default_rng(2))
    n, xy = motion.dim_x, (0, 1) if motion.dim_x == 2 else (0, 2)
    x0 = np.zeros((3, n))
    x0[:, xy] = trial.truth[0] + 2.0
    P0 = np.diag([9.0, 6.0, 9.0, 6.0, 1e-4])[:n, :n] if n > 2 else 9 * np.eye(2)
    tracker = RSSVB(motion, trial.measurement.replace(position=xy), x0, P0)
    run = tracker.run(trial.measurements)
    assert (run.label == [0, 1, 2]).all()
    far = np.linalg.norm(run.position - trial.truth, axis=-1)
    if n == 2:  # it cannot keep up once they meet
        assert np.median(far[:8]) < 4
    else:
        assert np.median(far[5:]) < 2
        speed = np.diff(trial.truth[-2:], axis=0)[0]
        states = run.x[-1].reshape(3, n + 1)
        np.testing.assert_allclose(states[:, [1, 3]], speed, atol=1.2)


def test_batch_with_gaps_is_the_loop() -> None:
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
    found = answers(trials, method)
    return scores(found.theta, trials.theta, found.u, trials.u).location_rms


def test_one_source_reaches_the_bound() -> None:
    trials = draws(Table1K7(n_sources=1, prior_std=20.0), 200, 0)
    far = np.linalg.norm(answers(trials, "vb").theta - trials.theta, axis=-1)[:, 0]
    bound = np.sqrt(np.mean(np.trace(bounds(trials).Sigma, axis1=-2, axis2=-1)))
    assert np.mean(far < 5) > 0.93
    assert np.sqrt(np.mean(far[far < 5] ** 2)) == pytest.approx(bound, rel=0.15)


def test_from_a_random_start_vb_beats_the_joint_maximum() -> None:
    case = Table1K3(start_at="random")
    ours, theirs = rms(case, "vb"), rms(case, "lm")
    assert 7.5 < ours < 13.5
    assert 12.0 < theirs < 21.0
    assert ours < 0.9 * theirs


def test_from_the_prior_they_are_equal_and_the_literal_refresh_is_worse() -> None:
    ours, theirs, literal = (rms(Table1K3(), name) for name in ("vb", "lm", "vb_literal"))
    assert 3.5 < ours < 7.0
    assert ours == pytest.approx(theirs, rel=0.25)
    assert literal > 1.2 * ours


def test_seven_sources_from_the_prior() -> None:
    ours, literal = rms(Table1K7(), "vb", 40), rms(Table1K7(), "vb_literal", 40)
    assert 2.3 < ours < 3.8
    assert literal > 1.3 * ours


def test_undamped_updates_diverge_and_are_flagged() -> None:
    for seed in range(6):
        trial = Table1K3().sample(np.random.default_rng(seed))
        tracker = trial.tracker("rss_vb", sweep="jacobi", damping=1.0, guard=False)
        tracker.update(trial.measurements[0])
        assert tracker.estimate.diverged or tracker.estimate.poor_fit  # type: ignore[attr-defined]
        assert np.isfinite(tracker.x).all()


def test_crossing_sources_are_followed() -> None:
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


# what it refuses, and what it warns of


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"x0": [[1.0]]}, "x0 must be finite, of shape"),
        ({"x0": [[1.0, np.nan]]}, "x0 must be finite"),
        ({"P0": None}, "x0 needs P0"),
        ({"P0": np.zeros((2, 2))}, "must leave every position uncertain"),
        ({"P0": np.eye(3)}, "P0 must have shape"),
        ({"mu0": [9.0]}, "mu0 must be a finite number or 2 of them"),
        ({"v0": 0.0}, "v0 must be positive"),
        ({"q_u": -1.0}, "q_u must be finite and not negative"),
        ({"n_sources": 3}, "n_sources is 3, but x0 has 2 sources"),
        ({"births": True, "max_sources": 1}, "more sources at first than max_sources=1"),
        ({"damping": 1.5}, "damping must lie in"),
        ({"sweep": "gauss"}, "sweep must be one of"),
        ({"refresh": "never"}, "refresh must be one of"),
        ({"covariance": "both"}, "covariance must be one of"),
        ({"max_cycles": 0}, "max_cycles must be at least 1"),
        ({"correlation_time": 0.0}, "correlation_time must be finite and positive"),
        ({"measurement": HEARD.replace(position=(0, 2))}, "position of the measurement"),
    ],
)
def test_nonsense_is_refused(params: dict[str, Any], message: str) -> None:
    good = {"motion": STILL, "measurement": HEARD, "x0": START[0], "P0": np.eye(2)}
    with pytest.raises(ValueError, match=message):
        RSSVB(**good | params)


def test_parts_of_the_wrong_kind_are_refused() -> None:
    with pytest.raises(TypeError, match="measurement must be a LogNormalRSS"):
        RSSVB(STILL, "rss", START[0], np.eye(2))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="motion must be a MotionModel"):
        RSSVB(None, HEARD, START[0], np.eye(2))  # type: ignore[arg-type]


def test_bad_readings_leave_the_belief() -> None:
    tracker = RSSVB(STILL, HEARD, START[0], 64 * np.eye(2))
    before = tracker.x.copy()
    for z in (np.full(8, -70.0), np.full(8, 80.0), np.full(8, np.inf), np.zeros(3)):
        with pytest.raises(ValueError, match=r"readings|z must"):
            tracker.update(z)
        np.testing.assert_array_equal(tracker.x, before)
    with pytest.raises(ValueError, match="no control input"):
        tracker.predict(1.0)


def test_fewer_readings_than_unknowns_warn_that_the_prior_decides() -> None:
    few = HEARD.replace(sensors=SENSORS[:5])
    with pytest.warns(UserWarning, match="5 readings are fewer than the 6 unknowns of 2 sources"):
        tracker = RSSVB(STILL, few, START[0], 64 * np.eye(2))
    tracker.update(XI[0, :5])
    assert np.isfinite(tracker.estimate.position).all()
    with pytest.warns(UserWarning, match="the prior decides"):
        alone = RSSML(STILL, few, START[0], 64 * np.eye(2), prior=False)
    with pytest.raises(ValueError, match="5 readings cannot tell 6 unknowns without a prior"):
        alone.update(XI[0, :5])


def test_a_start_on_a_sensor_is_warned_of() -> None:
    with pytest.warns(UserWarning, match="source 1 starts on sensor 3"):
        RSSVB(STILL, HEARD, [[10.0, 10.0], [0.0, 60.0]], 64 * np.eye(2))
