"""Tests of variational Bayes for signal strength: golden case of section 12, derivatives, laws."""

from typing import Any

import numpy as np
import pytest
from scipy.differentiate import hessian, jacobian

from arrivals.measurement_models import db_to_neper
from arrivals.measurement_models.signal_strength.path_loss import PropagationModel
from arrivals.motion_models import ConstantVelocity
from arrivals.scenarios.reproduce.rss.trials import draws, estimates
from arrivals.scenarios.simulations.signal_strength import Table1K7
from arrivals.trackers import MAPSolver, VariationalSolver
from arrivals.trackers.gaussian.linalg import inverse_2x2
from arrivals.trackers.rss.belief import SourceBeliefs
from arrivals.trackers.rss.inference.factors import PositionCost
from arrivals.trackers.rss.inference.joint_posterior import (
    JointPosterior,
    Prior,
    VariationalPosterior,
    marginals,
)
from arrivals.trackers.rss.inference.map_search import maximize
from arrivals.trackers.rss.inference.solution import Marginals
from arrivals.trackers.rss.rss_vb import variational_posterior
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


def golden(**settings: Any) -> VariationalPosterior:
    return variational_posterior(GOLDEN, MU, START, VariationalSolver(**EXACT | settings))


def same(value: Any, expected: Any) -> None:
    np.testing.assert_allclose(np.squeeze(value), expected, rtol=0, atol=1e-5)


def test_golden_readings_and_responsibilities() -> None:
    same(XI, [6.064946, 5.788684, 5.868353, 5.787123, 5.829661, 5.809926, 5.700325, 5.914332])
    result = FIELD.levels(MU, START)
    same(result.log_sigma, [5.96198, 5.838962, 6.052577, 5.779475, 5.882808, 5.845435, 5.866214,
                           5.764477])  # fmt: skip
    same(result.responsibilities, [
        [0.736627, 0.523392, 0.180749, 0.408127, 0.690407, 0.304914, 0.24442, 0.591051],
        [0.197076, 0.391818, 0.763941, 0.496371, 0.231922, 0.611387, 0.675289, 0.310539],
    ])  # fmt: skip
    same(GOLDEN.log_posterior(MU, START), -10.118834)


def test_golden_jacobi_iteration() -> None:
    result = golden(sweep="jacobi", damping=1.0, line_search=False, max_iterations=1)
    same(result.u, [9.220093, 9.094960])
    same(1 / result.w, [0.002455, 0.002446])
    same(result.theta, [(17.365096, 18.005596), (34.745842, 35.767836)])
    same(inverse_2x2(result.P), [[(5.764337, -1.158485), (-1.158485, 4.992632)],
                                [(7.692249, -0.421781), (-0.421781, 6.348430)]])  # fmt: skip


@pytest.mark.parametrize("settings", [{}, {"sweep": "jacobi", "damping": 0.5}])
def test_golden_fixed_point(settings: dict[str, Any]) -> None:
    result = golden(max_iterations=800 if settings else 300, **settings)
    same(result.u, [9.284684, 9.059046])
    same(result.theta, [(18.069962, 20.878713), (41.402592, 36.511710)])
    same(1 / result.w, [0.001860, 0.003563])
    same(inverse_2x2(result.P), [[(4.694445, -0.527914), (-0.527914, 4.332690)],
                                [(8.510042, -1.145833), (-1.145833, 7.993878)]])  # fmt: skip
    same(result.log_posterior, -0.850739)
    J = GOLDEN.information(FIELD.levels(result.u, result.theta))
    std = np.sqrt(np.diag(np.linalg.inv(J[0])))
    same(std, [0.130671, 0.194443, 3.376997, 2.763690, 4.606965, 3.786303])


def test_golden_literal_refresh() -> None:
    result = golden(sweep="jacobi", damping=1.0, refresh="literal", max_iterations=10)
    same(result.u, [9.231220, 9.138542])
    same(result.theta, [(17.289441, 20.130556), (39.245817, 35.421061)])
    same(1 / result.w, [0.000226, 0.000297])


def test_fixed_point_is_the_joint_maximum() -> None:
    result = golden(max_iterations=400)
    assert np.abs(GOLDEN.gradient(result.u, result.theta)).max() < 1e-9
    one = JointPosterior(FIELD, XI[0], GOLDEN.W[0], PRIOR.select(0))
    for method, tolerance in (("lm", 1e-6), ("bfgs", 1e-2)):
        solver = MAPSolver(method, tolerance=1e-12)  # type: ignore[arg-type]
        maximum = maximize(one, result.u[0], result.theta[0], solver)
        np.testing.assert_allclose(maximum.theta, result.theta[0], atol=tolerance)


# slopes against differences, for an exponent that is not 2

CURVED = GOLDEN._replace(propagation=FIELD._replace(alpha=3.0))


def test_gradient_of_the_joint_posterior_is_its_derivative() -> None:
    def along(x: Float) -> Float:
        moved = np.moveaxis(x, 0, -1)
        return CURVED.log_posterior(moved[..., :2], moved[..., 2:].reshape(*moved.shape[:-1], 2, 2))

    x = np.concatenate([MU[0] + 0.1, START[0].ravel() + 1.0])
    slope = jacobian(along, x, tolerances={"rtol": 1e-10}).df
    ours = CURVED.gradient(x[None, :2], x[None, 2:].reshape(1, 2, 2))
    np.testing.assert_allclose(ours[0], slope, rtol=1e-6)


def test_gradient_and_hessian_of_the_position_cost_are_its_derivatives() -> None:
    result = CURVED.propagation.levels(MU, START)
    r = (CURVED.xi - result.log_sigma)[:, None]
    c, log_range = 1.5 * result.responsibilities, result.offsets.log_range
    cost = PositionCost.at(CURVED, c, r, log_range, slice(None))
    near = START + np.array([[-3.0, 4.0], [2.0, -5.0]])
    gradient, H = cost.derivatives(near, cost.evaluate(near))
    for j in range(2):

        def phi(x: Float, j: int = j) -> Float:
            def one(position: Float) -> float:
                theta = near.copy()
                theta[0, j] = position
                return float(cost.evaluate(theta).phi[0, j])

            return np.apply_along_axis(one, 0, x)

        slope = jacobian(phi, near[0, j], tolerances={"rtol": 1e-9}).df
        np.testing.assert_allclose(gradient[0, j], slope, rtol=1e-6)
        second = hessian(phi, near[0, j], tolerances={"rtol": 1e-7}).ddf
        if np.linalg.eigvalsh(second)[0] > 0.01:
            np.testing.assert_allclose(H[0, j], second, rtol=1e-5)
        assert np.linalg.eigvalsh(H[0, j])[0] > 0


# laws


def test_one_source_without_noise_is_linear_in_its_logarithms() -> None:
    quiet = FIELD._replace(log_noise=-np.inf)
    u, theta = np.array([[9.0]]), np.array([[[20.0, 20.0]]])
    result = quiet.levels(u, theta)
    far = quiet.levels(u + 0.7, theta + 15.0)
    log_range = far.offsets.log_range - result.offsets.log_range
    np.testing.assert_allclose(result.responsibilities, 1.0)
    np.testing.assert_allclose(far.log_sigma, result.log_sigma + 0.7 - log_range[:, 0], atol=1e-12)


def test_literal_covariance_shrinks_with_the_iterations() -> None:
    rng = np.random.default_rng(0)
    sensors = rng.uniform(-80, 80, (60, 2))
    model = FIELD._replace(sensors=sensors)
    theta, u = np.array([[[5.0, 5.0]]]), np.array([[9.2]])
    prior = Prior(u, np.full((1, 1), 1e-6), theta, 1e-6 * np.eye(2)[None, None])
    problem = JointPosterior(
        model, model.levels(u, theta).log_sigma, np.full((1, 60), 200.0), prior
    )
    right = variational_posterior(problem, u, theta, VariationalSolver(**EXACT))
    for n in (4, 16):
        literal = VariationalSolver(refresh="literal", max_iterations=n, **EXACT)
        wrong = variational_posterior(problem, u, theta, literal)
        ratio = np.sqrt(np.trace(right.P[0, 0]) / np.trace(wrong.P[0, 0]))
        assert ratio * np.sqrt(n) == pytest.approx(1, rel=0.05)


def test_factor_variances_are_smaller_than_the_joint_ones() -> None:
    result = golden(max_iterations=100)
    joint = marginals(GOLDEN.information(FIELD.levels(result.u, result.theta)))
    assert (1 / result.w < joint.v).all()
    wider = np.linalg.eigvalsh(joint.Sigma - inverse_2x2(result.P))
    assert (wider > 0).all()


def test_iterations_with_line_search_never_end_below_their_start() -> None:
    trials = draws(Table1K7(start_at="random"), 20, 0)
    q = estimates(trials, "vb").posterior
    assert q is not None
    assert (q.log_posterior >= q.initial).all()


def test_readings_without_weight_leave_the_prior() -> None:
    missing = GOLDEN._replace(W=np.zeros((1, 8)))
    solver = VariationalSolver(max_iterations=60, **EXACT)
    result = variational_posterior(missing, MU + 1, START + 9.0, solver)
    np.testing.assert_allclose(result.theta, START, atol=1e-6)
    np.testing.assert_allclose(result.u, MU, atol=1e-9)


def test_update_of_a_state_is_the_kalman_filters() -> None:
    """A position measured with noise R updates the other entries as a Kalman filter does."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(4, 4))
    P, R, x, z = A @ A.T, np.diag([2.0, 3.0]), rng.normal(size=4), rng.normal(size=2)
    H = np.eye(4)[::2]
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    x_post, P_post = x + K @ (z - H @ x), P - K @ H @ P
    before = SourceBeliefs(x[None], P[None], np.zeros(1), np.ones(1))
    moments = Marginals(np.ones(1), (H @ P_post @ H.T)[None])
    after = before.updated(
        np.zeros(1), (H @ x_post)[None], moments, (0, 2), ConstantVelocity(q=1.0)
    )
    np.testing.assert_allclose(after.x[0], x_post, atol=1e-10)
    np.testing.assert_allclose(after.P[0], P_post, atol=1e-10)


def test_state_of_a_belief_is_a_round_trip() -> None:
    rng = np.random.default_rng(0)
    own = SourceBeliefs(rng.normal(size=(2, 4)), np.array([np.eye(4), 2 * np.eye(4)]), np.ones(2),
                  np.full(2, 3.0))  # fmt: skip
    for part, back in zip(own, SourceBeliefs.from_state(*own.to_state(5), 4), strict=True):
        np.testing.assert_array_equal(part, back)
