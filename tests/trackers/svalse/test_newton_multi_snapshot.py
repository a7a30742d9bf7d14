"""The Newton solver on several bins and snapshots, directional elements and planar arrays."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from newton_states import MODEL, active_components, evaluation_of, prior_of
from newton_states import scene as of_a_line
from svalse_scenes import CIRCLE, ELEMENTS, MODELS, NAMES, SEVERAL, SPARSE

from arrivals.measurement_models import ArraySnapshot
from arrivals.motion_models.bessel import log_i0
from arrivals.scenarios import create
from arrivals.trackers import SVALSE
from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.candidate_grid import AngleCandidates
from arrivals.trackers.svalse.newton.candidates import (
    grid_evidence,
    reestimation_gains,
    removal_gains,
)
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.problems import StepInput
from arrivals.trackers.svalse.newton.solver import NewtonSolver, support_search
from arrivals.trackers.svalse.newton.step import (
    negative_hessian,
    newton_step,
    slopes,
    update_variances,
    weights,
)
from arrivals.typing import Complex

every_model = pytest.mark.parametrize("model", MODELS, ids=NAMES)
DOA = np.array([-1.1, -0.1, 0.7])


def drawn(model: ArraySnapshot, seed: int, noise: float = 0.03) -> Complex:
    """Return snapshots (F, M, N) of three sources."""
    rng = np.random.default_rng(seed)
    w = np.exp(2j * np.pi * rng.random((*model.shape[:-1], 3)))
    return model.snapshots(model.replace(noise=noise).simulate(DOA, w, rng))


def scene(
    model: ArraySnapshot, seed: int = 0, tempering: float = 1.0
) -> tuple[ExpectedResponse, Evaluation]:
    """Components beside three sources, some of which have a prior."""
    rng, response = np.random.default_rng(seed), ExpectedResponse(model.angle_manifold(), tempering)
    components = Components.zeros(1, 3)
    components.mu[0] = model.angle_manifold().from_doa(DOA) + 0.02 * rng.standard_normal(3)
    components.variance[0] = rng.uniform(5e-4, 3e-3, 3)
    components.prior_mu[0] = components.mu[0] + 0.1
    components.prior_kappa[0] = 0.0, 120.0, 60.0
    components.kl_constant[0] = np.log(2 * np.pi) + log_i0(components.prior_kappa[0])
    components.log_odds[0] = -2.2, 1.1, 1.1
    Y = StepInput(drawn(model, seed), None, 3).Y[None]
    bins = np.ones((1, model.n_bins))
    nu, tau = 0.02 * bins * rng.uniform(0.5, 2, bins.shape), 0.3 * bins
    return response, evaluate(response, Y, components, np.array([3]), nu, tau, np.zeros(1))


def again(response: ExpectedResponse, state: Evaluation, components: Components) -> Evaluation:
    """The evaluation with other components."""
    e, K = state, np.array([components.mu.shape[1]])
    return evaluate(response, e.Y, components, K, e.nu, e.tau, e.log_prior_inactive)


def shifted(
    response: ExpectedResponse, state: Evaluation, name: str, k: int, by: float
) -> Evaluation:
    components = state.components.copy()
    getattr(components, name)[0, k] += by
    return again(response, state, components)


def slope_of(response: ExpectedResponse, state: Evaluation, name: str, k: int, h: float) -> float:
    """∂F by differences of the fourth order."""
    at = {n: shifted(response, state, name, k, n * h).F[0] for n in (-2, -1, 1, 2)}
    return float((at[-2] - 8 * at[-1] + 8 * at[1] - at[2]) / (12 * h))


# -- derivatives and gains ----------------------------------------------------------------------


@every_model
@pytest.mark.parametrize("tempering", [1.0, 3.0])
def test_gradients_equal_numerical_slopes(model: ArraySnapshot, tempering: float) -> None:
    response, state = scene(model, tempering=tempering)
    g, curvature = slopes(response, state, *weights(state))
    of_s = 0.5 / state.components.variance[0] - 0.5 * curvature[0, 0]
    for k in range(3):
        s = float(state.components.variance[0, k])
        along_mu = slope_of(response, state, "mu", k, 5e-5)
        along_s = slope_of(response, state, "variance", k, 0.01 * s)
        assert g[0, 0, k] == pytest.approx(along_mu, abs=1e-6 * np.abs(g).max())
        assert of_s[k] == pytest.approx(along_s, abs=1e-6 * np.abs(of_s).max())


@every_model
def test_hessian_equals_the_slope_of_the_gradient_to_a_hundredth(model: ArraySnapshot) -> None:
    response, state = scene(model)
    for _ in range(8):
        state = newton_step(response, state, np.zeros(1, dtype=np.bool_))
    v, P = weights(state)
    N = negative_hessian(response, state, P, slopes(response, state, v, P)[1])
    np.testing.assert_allclose(N, N.swapaxes(1, 2), atol=1e-9 * np.abs(N).max())
    for k in range(3):
        ends = [shifted(response, state, "mu", k, h) for h in (1e-6, -1e-6)]
        up, down = (slopes(response, end, *weights(end))[0][0, 0] for end in ends)
        np.testing.assert_allclose(N[0, :, k], (down - up) / 2e-6, atol=0.01 * np.abs(N).max())


def test_mean_responses_and_norms_equal_a_dense_sum() -> None:
    response, mu, s = (
        ExpectedResponse(ELEMENTS.angle_manifold()),
        np.array([[[0.4]]]),
        np.array([[[0.02]]]),
    )
    theta = 0.4 + np.linspace(-1, 1, 4001)
    q = np.exp(-((theta - 0.4) ** 2) / 0.04)
    q /= q.sum()
    a = ELEMENTS.angle_manifold().steering(theta)[0]  # (F, M, n)
    np.testing.assert_allclose(response.chart.responses(mu, s)[0, :, 0, 0], a @ q, atol=1e-8)
    norms = response.chart.norms(mu, s)
    assert norms is not None
    np.testing.assert_allclose(norms[0, :, 0, 0], (np.abs(a) ** 2).sum(axis=1) @ q, rtol=1e-8)


@every_model
def test_removal_changes_the_criterion_by_its_gain(model: ArraySnapshot) -> None:
    response, state = scene(model, tempering=2.0)
    gains = removal_gains(response, state, 0.5)[0]
    for k in range(3):
        components = state.components.without(np.array([k])).first(2)
        rest = again(response, state, components)
        change = rest.criterion(0.5) - state.criterion(0.5)
        assert change[0] == pytest.approx(gains[k], rel=1e-7, abs=1e-7)


@every_model
def test_addition_changes_the_evidence_by_its_gain(model: ArraySnapshot) -> None:
    response, state = scene(model)
    grid = AngleCandidates(response, 4, merge=0.0)
    gain = grid_evidence(grid, state)[0][0]
    for g in (2, len(grid.theta) // 2 + 1):
        new = Components.zeros(1, 1)
        new.mu[0], new.variance[0] = grid.theta[g], 1e-14  # a point
        both = np.concatenate([state.components.packed, new.packed], axis=2)
        more = again(response, state, Components(both))
        change = more.criterion(0.0)[0] - state.criterion(0.0)[0]
        assert change == pytest.approx(gain[g], rel=1e-6, abs=1e-6)


def test_reestimation_gains_are_not_negative() -> None:
    for seed in range(4):
        response, state = scene(SEVERAL, seed)
        assert (reestimation_gains(response, state) >= 0).all()


@pytest.mark.parametrize(
    ("model", "doa", "nearest"),
    [
        (CIRCLE, [3.13, 0.4, -3.14], 2),
        (CIRCLE, [3.10, 0.4, -3.14], -1),
        (SPARSE, [1.56, 0.4, np.pi - 1.56], 2),  # two angles of a line for one direction
        (SPARSE, [1.40, 0.4, -1.40], -1),
    ],
)
def test_first_duplicate_across_pi_and_of_ambiguous_angles(
    model: ArraySnapshot, doa: list[float], nearest: int
) -> None:
    response, state = scene(model)
    components = state.components.copy()
    components.mu[0] = doa
    state = again(response, state, components)
    grid = AngleCandidates(response, 4, merge=np.deg2rad(1.5))
    assert grid.first_duplicate(state).tolist() == [nearest]


# -- the objective ------------------------------------------------------------------------------


@settings(deadline=None, max_examples=25)
@given(st.sampled_from(MODELS), st.integers(0, 10**6), st.booleans())
def test_newton_step_never_decreases_the_objective(
    model: ArraySnapshot, seed: int, estimate_nu: bool
) -> None:
    response, state = scene(model, seed)
    components = state.components.copy()
    components.mu[0] += 0.2 * np.random.default_rng(seed).standard_normal(3)  # far from the top
    state = again(response, state, components)
    F = [state.F[0]]
    for _ in range(10):
        state = newton_step(response, state, np.array([estimate_nu]))
        F.append(state.F[0])
    assert np.diff(F).min() > -1e-6
    assert F[-1] > F[0]


def test_backtracking_shortens_the_step_of_the_variances() -> None:
    """Far from the maximum, the fixed point of the variances alone would decrease F."""
    rng, response = np.random.default_rng(70147), ExpectedResponse(MODEL.angle_manifold())
    state = of_a_line(70147)
    components = state.components.copy()
    components.mu[0] += 0.3 * rng.standard_normal(5)
    state = evaluation_of(response, state.Y, components, 0.003)
    assert newton_step(response, state, np.zeros(1, dtype=np.bool_)).F[0] > state.F[0] + 1


def wrapped_normal_bound(
    manifold: Any, Y: Complex, known: ComponentPrior, fit: ComponentPosterior, kl_weight: float
) -> float:
    """The criterion of a fit's angles as wrapped normals, amplitudes refreshed."""
    on = np.flatnonzero(fit.active)
    components = active_components(known, fit)
    problem = StepInput(Y, None, 8)
    assert fit.bin_noise is not None
    response = support_search(NewtonSolver(), manifold, Y.shape[2], with_prior=True).response
    nu, tau = fit.bin_noise / problem.power, np.full(len(Y), 0.3)
    K = np.array([len(on)])
    state = evaluate(response, problem.Y[None], components, K, nu[None], tau[None], np.zeros(1))
    for _ in range(30):  # the variances of the amplitudes and of the noise at their best
        state = update_variances(response, state)
    return float(state.criterion(kl_weight)[0])


@pytest.mark.parametrize("numbers", [{"n_bins": 5}, {"n_snapshots": 5}], ids=["bins", "snapshots"])
def test_elbo_is_at_least_that_of_coordinate_ascent(numbers: dict[str, int]) -> None:
    """From the same tracked components, in at least nine of ten steps; half KL charged."""
    gain: list[float] = []
    for seed in range(2):
        trial = create("circle", snr_db=15.0, n_steps=16, **numbers).sample(
            np.random.default_rng(seed)
        )
        tracker = trial.tracker("svalse")
        assert isinstance(tracker, SVALSE)
        model = tracker.measurement
        assert isinstance(model, ArraySnapshot)
        manifold = model.angle_manifold()
        for t, z in enumerate(trial.measurements):
            tracker.predict()
            if t % 3 == 1:
                known, Y = prior_of(tracker, z), model.snapshots(z)
                ours = NewtonSolver().solve(Y, manifold, known)
                other = CoordinateSolver(tolerance=1e-6).solve(Y, manifold, known)
                bounds = [wrapped_normal_bound(manifold, Y, known, f, 0.5) for f in (ours, other)]
                gain.append(bounds[0] - bounds[1])
            tracker.update(z)
    assert np.mean(np.array(gain) > -0.05) >= 0.9
