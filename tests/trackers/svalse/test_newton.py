"""The Newton solver's mathematics: derivatives, monotony, exact gains, agreement in batches."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from newton_states import MODEL, evaluation_of, scene

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.trackers.svalse.components import MERGE_DISTANCE, ComponentPrior
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.candidate_grid import AngleCandidates
from arrivals.trackers.svalse.newton.candidates import (
    RemovedComponents,
    add_candidates,
    grid_evidence,
    removal_gains,
)
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.solver import NewtonSolver
from arrivals.trackers.svalse.newton.step import (
    negative_hessian,
    newton_step,
    slopes,
    update_variances,
    weights,
)
from arrivals.typing import Complex

GAPS = ArraySnapshot(SensorArray.ula(14, spacing=0.4, missing=[2, 9]), wavelength=1.0)
NONE = np.zeros(1, dtype=np.bool_)


def shifted(
    state: Evaluation, name: str, k: int, by: float, response: ExpectedResponse
) -> Evaluation:
    components = state.components.copy()
    getattr(components, name)[0, k] += by
    return evaluation_of(response, state.Y, components, state.nu[0, 0])


def slope_of(state: Evaluation, name: str, k: int, h: float, response: ExpectedResponse) -> float:
    """∂F by differences of the fourth order."""
    at = {n: shifted(state, name, k, n * h, response).F[0] for n in (-2, -1, 1, 2)}
    return float((at[-2] - 8 * at[-1] + 8 * at[1] - at[2]) / (12 * h))


# -- derivatives ------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [MODEL, GAPS])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_gradients_equal_numerical_slopes(seed: int, model: ArraySnapshot) -> None:
    state, response = scene(seed, model), ExpectedResponse(model.angle_manifold())
    g, curvature = slopes(response, state, *weights(state))
    of_s = 0.5 / state.components.variance[0] - 0.5 * curvature[0, 0]
    for k in range(5):
        s = float(state.components.variance[0, k])
        along_mu, along_s = (
            slope_of(state, "mu", k, 1e-4, response),
            slope_of(state, "variance", k, 0.01 * s, response),
        )
        assert g[0, 0, k] == pytest.approx(along_mu, abs=1e-7 * np.abs(g).max())
        assert of_s[k] == pytest.approx(along_s, abs=1e-7 * np.abs(of_s).max())


@pytest.mark.parametrize("model", [MODEL, GAPS])
def test_hessian_equals_the_slope_of_the_gradient_to_a_hundredth(model: ArraySnapshot) -> None:
    """At 20 dB; the term left out is a thousandth."""
    state, response = scene(0, model), ExpectedResponse(model.angle_manifold())
    for _ in range(5):
        state = newton_step(response, state, NONE)
    v, P = weights(state)
    N = negative_hessian(response, state, P, slopes(response, state, v, P)[1])
    np.testing.assert_allclose(N, N.swapaxes(1, 2), atol=1e-9 * np.abs(N).max())
    for k in range(5):
        ends = [shifted(state, "mu", k, h, response) for h in (1e-6, -1e-6)]
        up, down = (slopes(response, end, *weights(end))[0][0, 0] for end in ends)
        np.testing.assert_allclose(N[0, :, k], (down - up) / 2e-6, atol=0.01 * np.abs(N).max())


# -- the objective ----------------------------------------------------------------------------


def written_out(state: Evaluation, w: Complex, C: Complex) -> float:
    """The bound for any means and covariance of the amplitudes, from the model."""
    A, M, K = state.A[0, 0], state.Y.shape[2], state.A.shape[2]
    J = A.conj() @ A.T
    np.fill_diagonal(J, M)
    nu, tau = float(state.nu[0, 0]), float(state.tau[0, 0])
    misfit = M - 2 * np.vdot(A.conj() @ state.Y[0, 0, :, 0], w).real + np.vdot(w, J @ w).real
    likelihood = -M * np.log(np.pi * nu) - (misfit + np.trace(J @ C).real) / nu
    amplitudes = -K * np.log(np.pi * tau) - (np.vdot(w, w).real + C.trace().real) / tau
    entropy = K * np.log(np.pi * np.e) + np.linalg.slogdet(C)[1]
    angles = (state.components.log_odds[0] - state.D[0]).sum()
    return float(likelihood + amplitudes + entropy + angles)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6))
def test_objective_is_the_elbo_at_the_optimal_amplitudes(seed: int) -> None:
    state, rng = scene(seed), np.random.default_rng(seed)
    w, C = state.W[0, 0, :, 0], state.nu[0, 0] * state.G[0, 0]
    assert written_out(state, w, C) == pytest.approx(state.F[0], abs=1e-8)
    other = w * (1 + 0.01 * rng.standard_normal(5))
    assert written_out(state, other, C) < state.F[0]
    assert written_out(state, w, C * 1.05) < state.F[0]
    assert written_out(state, w, C * 0.95) < state.F[0]


def test_divergence_equals_the_integral_of_its_definition() -> None:
    state = scene(3)
    for k in range(5):
        mu, s, prior, kappa = state.components.packed[0, :4, k]
        theta = mu + np.linspace(-1, 1, 200_001)
        log_q = -((theta - mu) ** 2) / (2 * s) - 0.5 * np.log(2 * np.pi * s)
        log_p = kappa * np.cos(theta - prior) - np.log(2 * np.pi * np.i0(kappa))
        cost = np.trapezoid(np.exp(log_q) * (log_q - log_p), theta)
        assert state.D[0, k] == pytest.approx(cost, abs=1e-6)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.booleans(), st.sampled_from([0.003, 0.01, 0.1, 0.5]))
def test_newton_step_never_decreases_the_objective(seed: int, estimate_nu: bool, nu: float) -> None:
    rng, response = np.random.default_rng(seed), ExpectedResponse(MODEL.angle_manifold())
    state = scene(seed)
    components = state.components.copy()
    components.mu[0] += 0.3 * rng.standard_normal(5)  # far from the top
    state = evaluation_of(response, state.Y, components, nu)
    F = [state.F[0]]
    for _ in range(15):
        state = newton_step(response, state, np.array([estimate_nu]))
        F.append(state.F[0])
    assert np.diff(F).min() > -1e-6
    assert F[-1] > F[0]


def test_noise_and_power_converge_to_the_fixed_points_of_em() -> None:
    state, response = scene(4), ExpectedResponse(MODEL.angle_manifold())
    for _ in range(40):
        state = newton_step(response, state, np.ones(1, dtype=np.bool_))
    A, w, M = state.A[0, 0], state.W[0, 0, :, 0], 15
    J = A.conj() @ A.T
    np.fill_diagonal(J, M)
    C = state.nu[0, 0] * state.G[0, 0]
    misfit = M - 2 * np.vdot(A.conj() @ state.Y[0, 0, :, 0], w).real + np.vdot(w, J @ w).real
    assert state.nu[0, 0] == pytest.approx((misfit + np.trace(J @ C).real) / M, rel=0.02)  # (58)
    assert state.tau[0, 0] == pytest.approx((np.vdot(w, w) + C.trace()).real / 5, rel=1e-4)  # (59)
    assert update_variances(response, state).F[0] == pytest.approx(state.F[0], abs=1e-4)


# -- moves ------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6), st.floats(0, 1))
def test_removal_changes_the_criterion_by_its_gain(seed: int, kl_weight: float) -> None:
    state, response = scene(seed), ExpectedResponse(MODEL.angle_manifold())
    gains = removal_gains(ExpectedResponse(MODEL.angle_manifold()), state, kl_weight)[0]
    for k in range(5):
        components = state.components.without(np.array([k])).first(4)
        rest = evaluation_of(response, state.Y, components, state.nu[0, 0])
        change = rest.criterion(kl_weight) - state.criterion(kl_weight)
        assert change[0] == pytest.approx(gains[k], abs=1e-7)


def test_addition_changes_the_evidence_by_its_gain() -> None:
    state, response = scene(0), ExpectedResponse(MODEL.angle_manifold())
    grid = AngleCandidates(response, 8, merge=0.0)
    gain = grid_evidence(grid, state)[0][0]
    for g in (3, 40, 77):
        new = Components.zeros(1, 1)
        new.mu[0], new.variance[0] = grid.theta[g], 1e-14  # a point
        both = np.concatenate([state.components.packed, new.packed], axis=2)
        more = evaluation_of(response, state.Y, Components(both))
        assert more.criterion(0.0)[0] - state.criterion(0.0)[0] == pytest.approx(gain[g], abs=1e-6)


def test_candidates_keep_the_merge_distance_and_removed_components_return() -> None:
    state, response = scene(0), ExpectedResponse(MODEL.angle_manifold())
    for _ in range(5):
        state = newton_step(response, state, NONE)
    components = state.components.without(np.array([3])).first(4)
    rest = evaluation_of(response, state.Y, components, state.nu[0, 0])
    grid = AngleCandidates(response, 8, merge=np.deg2rad(1.5))
    excluded, room = np.zeros((1, len(grid.theta)), dtype=np.bool_), np.ones(1, dtype=np.int64)
    memory = state.components.with_slots(np.arange(5))
    gone = np.array([[False, False, False, True, False]])
    odds = np.array([-2.2])
    forgotten = RemovedComponents(memory, gone & False, excluded)
    fresh = add_candidates(grid, rest, odds, forgotten, room, 0.5)
    back = add_candidates(grid, rest, odds, RemovedComponents(memory, gone, excluded), room, 0.5)
    assert fresh.n[0] == back.n[0] == 1
    assert fresh.components.slot[0, 0] == -1
    assert back.components.slot[0, 0] == 3  # its odds are better
    assert back.components.mu[0, 0] == pytest.approx(state.components.mu[0, 3], abs=0.1)
    excluded[:] = grid.beside(state.components.point[:, :, 3:4])[0]
    elsewhere = add_candidates(
        grid, rest, odds, RemovedComponents(memory, gone, excluded), room, 0.5
    )
    doa = grid.manifold.to_doa([elsewhere.components.mu[0, 0], state.components.mu[0, 3]])
    assert elsewhere.n[0] == 0 or abs(doa[0] - doa[1]) >= np.deg2rad(1.5)


def test_duplicates_are_seen_beside_angles_without_a_direction() -> None:
    response = ExpectedResponse(GAPS.angle_manifold())
    state = scene(0, GAPS)
    components = state.components.copy()
    components.mu[0] = 2.9, -2.9, 0.5, 0.505, 1.5  # the first two beyond endfire
    state = evaluation_of(response, state.Y, components)
    grid = AngleCandidates(response, 8, merge=MERGE_DISTANCE)
    assert grid.first_duplicate(state).tolist() == [3]


# -- leading axes -----------------------------------------------------------------------------


def test_unused_slots_and_other_problems_have_no_effect() -> None:
    states = [scene(0, K=5), scene(1, K=3), scene(2, K=4)]
    components = Components.zeros(3, 6)
    for i, state in enumerate(states):
        packed = state.components.packed[0]
        components.packed[i, :, : packed.shape[1]] = packed
    response, K = ExpectedResponse(MODEL.angle_manifold()), np.array([5, 3, 4])
    y = np.concatenate([state.Y for state in states])
    nu, tau = np.full((3, 1), 0.01), np.full((3, 1), 0.2)
    batch = evaluate(response, y, components, K, nu, tau, np.zeros(3))
    estimate_nu = np.array([True, False, True])
    for _ in range(4):
        batch = newton_step(response, batch, estimate_nu)
        states = [
            newton_step(response, state, estimate_nu[i : i + 1]) for i, state in enumerate(states)
        ]
        for i, (state, k) in enumerate(zip(states, K, strict=True)):
            assert batch.F[i] == pytest.approx(state.F[0], abs=1e-9)
            np.testing.assert_allclose(
                batch.components.mu[i, :k], state.components.mu[0], atol=1e-11
            )
            np.testing.assert_allclose(batch.W[i, 0, :k], state.W[0, 0], atol=1e-10)


@dataclass(frozen=True, eq=False)
class Explicit(UniformLineManifold):
    """The line with its identity written out."""

    @property
    def coefficients(self) -> Any:
        return np.eye(len(self.grid_index), dtype=np.complex128)[None, None]


def test_response_with_coefficients_has_equal_steps() -> None:
    line = GAPS.angle_manifold()
    assert isinstance(line, UniformLineManifold)
    explicit: Any = Explicit(line.grid_index, line.step, line.origin, line.reference)
    state = scene(0, GAPS)
    one, other = ExpectedResponse(line), ExpectedResponse(explicit)
    assert other.extent == pytest.approx(one.extent)
    state2 = evaluation_of(other, state.Y, state.components)
    for _ in range(4):
        state, state2 = newton_step(one, state, NONE), newton_step(other, state2, NONE)
        np.testing.assert_allclose(state2.components.packed, state.components.packed, atol=1e-10)
    gram, expected = np.broadcast_arrays(AngleCandidates(other).gram, AngleCandidates(one).gram)
    np.testing.assert_allclose(gram, expected)


def test_extent_of_a_filled_line_is_its_number_of_sensors() -> None:
    for n in (2, 5, 8, 15):
        for reference in ("middle", "first"):
            line = ArraySnapshot(SensorArray.ula(n, 0.5), wavelength=1.0).angle_manifold(
                "first" if reference == "first" else "middle"
            )
            assert ExpectedResponse(line).extent == pytest.approx(n)


def test_batch_of_snapshots_equals_single_fits() -> None:
    rng = np.random.default_rng(0)
    Ys, known = [], []
    for n in range(12):
        doa = rng.uniform(-1, 1, 1 + n % 4)
        y = MODEL.replace(noise=0.02).simulate(doa, np.exp(2j * np.pi * rng.random(len(doa))), rng)
        Ys.append(y[None, :, None] * 10.0 ** (n - 6))
        mu = MODEL.angle_manifold().from_doa(doa[: n % 3]) + 0.02
        kappa, rho = np.full(len(mu), 100.0), np.full(len(mu), 0.75)
        age = np.arange(len(mu)) % 2
        known.append(ComponentPrior(mu, kappa, rho, 0.1, age, 15.0 + n) if n % 4 else None)
    Ys[5] = np.zeros((1, 15, 1), dtype=np.complex128)
    solver = NewtonSolver(merge=MERGE_DISTANCE, snr_db=20.0)  # also without a prior
    manifold = MODEL.angle_manifold()
    together = solver.solve_batch(Ys, manifold, known)
    for Y, prediction, fit in zip(Ys, known, together, strict=True):
        alone = solver.solve(Y, manifold, prediction)
        np.testing.assert_allclose(fit.theta, alone.theta, atol=1e-9)
        np.testing.assert_allclose(fit.amplitude, alone.amplitude, rtol=1e-8)
        assert fit.age.tolist() == alone.age.tolist()
        assert (fit.iterations, fit.converged) == (alone.iterations, alone.converged)
        assert fit.noise == pytest.approx(alone.noise, rel=1e-8)
