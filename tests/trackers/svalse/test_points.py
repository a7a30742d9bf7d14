"""The Newton solver on points: derivatives, gains, golden numbers, plane and curved waves."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from newton_states import unit

from arrivals.measurement_models import ArraySnapshot, PointManifold, SensorArray
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sphere import fibonacci_sphere
from arrivals.measurement_models.manifolds.line_phase import fresnel_line
from arrivals.measurement_models.manifolds.manifold import is_point_manifold
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.trackers.svalse.newton.batch import Components
from arrivals.trackers.svalse.newton.candidate_grid import candidate_grid
from arrivals.trackers.svalse.newton.candidates import grid_evidence, removal_gains
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse
from arrivals.trackers.svalse.newton.solver import NewtonSolver
from arrivals.trackers.svalse.newton.step import negative_hessian, newton_step, slopes, weights
from arrivals.trackers.svalse.newton.wave_switch import switch_waves
from arrivals.typing import Complex, Float

NONE = np.zeros(1, dtype=np.bool_)
AXIS = 0.5 * np.arange(4) - 0.75
SQUARE = SensorArray(np.stack(np.meshgrid(AXIS, AXIS, indexing="ij"), axis=-1).reshape(-1, 2))
TWELVE = SensorArray(0.5 * fibonacci_sphere(12))
LINE = SensorArray.ula(16, 0.5)
MODELS = {
    "cosines": ArraySnapshot(SQUARE, 1.0, unknowns="sphere"),
    "cosines, bins": ArraySnapshot(SQUARE, [1.0, 1.3], n_snapshots=3, unknowns="sphere"),
    "sphere": ArraySnapshot(TWELVE, 1.0, unknowns="sphere"),
    "curved": ArraySnapshot(LINE, 1.0, unknowns="range"),
    "spherical": ArraySnapshot(LINE, 1.0, unknowns="range", nearest=4.0),
}
every_model = pytest.mark.parametrize("name", MODELS)


def manifold_of(model: ArraySnapshot) -> PointManifold:
    manifold = model.manifold()
    assert is_point_manifold(manifold)
    return manifold


def scene(name: str, seed: int = 0, spread: float = 0.003) -> tuple[ExpectedResponse, Evaluation]:
    """Components beside two sources at 20 dB, with priors."""
    rng, manifold = np.random.default_rng(seed), manifold_of(MODELS[name])
    grid, response = manifold.candidates(), ExpectedResponse(manifold)
    x = grid.points[:, [grid.points.shape[1] // 4, 3 * grid.points.shape[1] // 4]]
    A = manifold.at(x)[0]
    F, _, M = A.shape
    N = MODELS[name].n_snapshots
    w = np.exp(2j * np.pi * rng.random((F, 2, N)))
    e = (rng.standard_normal((F, M, N)) + 1j * rng.standard_normal((F, M, N))) * 0.1
    Y = A.swapaxes(1, 2) @ w + e
    Y = Y / np.sqrt((np.abs(Y) ** 2).mean(axis=(1, 2), keepdims=True))
    components = Components.zeros(1, 2, response.chart.layout)
    components.point[0] = manifold.move(x, 0.1 * rng.standard_normal((2, 2)))
    components.covariance[0] = spread * np.array([[1.0], [0.2], [1.5]])
    components.prior_mean[0] = x
    components.prior_precision[0] = np.array([[3.0, 40.0], [0.5, 2.0], [4.0, 30.0]])
    components.log_odds[0] = 1.0, -1.0
    nu, tau = np.full((1, F), 0.02), np.full((1, F), 0.6)
    state = evaluate(response, Y[None], components, np.array([2]), nu, tau, np.zeros(1))
    return response, state


def again(response: ExpectedResponse, state: Evaluation, components: Components) -> Evaluation:
    K = np.array([components.packed.shape[2]])
    return evaluate(response, state.Y, components, K, state.nu, state.tau, np.zeros(1))


def slope(function: Callable[[float], float], h: float) -> float:
    return float((function(-2 * h) - 8 * function(-h) + 8 * function(h) - function(2 * h)) / 12 / h)


@every_model
def test_gradients_equal_numerical_slopes(name: str) -> None:
    response, state = scene(name)
    manifold = manifold_of(MODELS[name])
    g, _ = slopes(response, state, *weights(state))

    def moved(i: int, k: int, by: float) -> float:
        components, step = state.components.copy(), np.zeros((1, 2, 2))
        step[0, i, k] = by
        components.point[...] = manifold.move(components.point, step)
        return float(again(response, state, components).F[0])

    for i, k in ((0, 0), (1, 1), (1, 0)):
        numerical = slope(lambda by, i=i, k=k: moved(i, k, by), 1e-4)  # type: ignore[misc]
        assert g[0, i, k] == pytest.approx(numerical, abs=2e-3 * np.abs(g).max())


@pytest.mark.parametrize("name", ["cosines", "cosines, bins", "curved"])
def test_curvature_is_the_slope_in_the_covariance(name: str) -> None:
    """Of linear phases exactly: ∂F/∂S = (S⁻¹ - C)/2."""
    response, state = scene(name)
    _, C = slopes(response, state, *weights(state))
    S = state.components.covariance
    det = S[:, 0] * S[:, 2] - S[:, 1] ** 2
    inverse = np.stack([S[:, 2], -S[:, 1], S[:, 0]], axis=1) / det[:, None]

    def widened(q: int, by: float) -> float:
        components = state.components.copy()
        components.covariance[0, q, 1] += by
        return float(again(response, state, components).F[0])

    for q, factor in ((0, 0.5), (1, 1.0), (2, 0.5)):
        expected = factor * (inverse - C)[0, q, 1]
        numerical = slope(lambda by, q=q: widened(q, by), 2e-5)  # type: ignore[misc]
        assert numerical == pytest.approx(expected, rel=1e-5, abs=1e-4)


@every_model
def test_hessian_equals_the_slope_of_the_gradient_to_a_tenth(name: str) -> None:
    response, state = scene(name)
    manifold = manifold_of(MODELS[name])
    for _ in range(6):
        state = newton_step(response, state, NONE)
    v, P = weights(state)
    N = negative_hessian(response, state, P, slopes(response, state, v, P)[1])[0]
    np.testing.assert_allclose(N, N.T, atol=1e-9 * np.abs(N).max())
    for i, k in ((0, 0), (1, 1)):
        ends = []
        for h in (1e-5, -1e-5):
            components, step = state.components.copy(), np.zeros((1, 2, 2))
            step[0, i, k] = h
            components.point[...] = manifold.move(components.point, step)
            end = again(response, state, components)
            ends.append(slopes(response, end, *weights(end))[0][0])
        column = ((ends[1] - ends[0]) / 2e-5).ravel()
        np.testing.assert_allclose(N[:, 2 * i + k], column, atol=0.1 * np.abs(N).max())


@every_model
def test_removal_and_addition_change_the_criterion_by_their_gains(name: str) -> None:
    response, state = scene(name)
    gains = removal_gains(response, state, 0.5)[0]
    for k in (0, 1):
        rest = again(response, state, state.components.without(np.array([k])).first(1))
        assert (rest.criterion(0.5) - state.criterion(0.5))[0] == pytest.approx(gains[k], abs=1e-6)
    grid = candidate_grid(response, 0.0, None)
    gain = grid_evidence(grid, state).gain[0]
    g = int(gain.argmax())
    new = Components.zeros(1, 1, state.components.layout)
    new.point[0, :, 0] = grid.points[:, g]
    new.covariance[0, :, 0] = 1e-13, 0.0, 1e-13
    new.prior_precision[0, :, 0] = 1.0, 0.0, 1.0
    both = state.components.like(np.concatenate([state.components.packed, new.packed], axis=2))
    more = again(response, state, both)
    assert (more.criterion(0.0) - state.criterion(0.0))[0] == pytest.approx(gain[g], abs=1e-5)


@settings(deadline=None, max_examples=25)
@given(st.sampled_from(list(MODELS)), st.integers(0, 10**6), st.booleans())
def test_newton_step_never_decreases_the_objective(name: str, seed: int, learn: bool) -> None:
    response, state = scene(name, seed, spread=0.05)
    F = [state.F[0]]
    for _ in range(8):
        state = newton_step(response, state, np.array([learn]))
        F.append(state.F[0])
    assert np.diff(F).min() > -1e-6


# -- golden numbers -----------------------------------------------------------------------------

AZIMUTH, ELEVATION = np.deg2rad([30.0, 110.0]), np.deg2rad([40.0, 75.0])


def two_waves(model: ArraySnapshot) -> Complex:
    """Return a snapshot (1, M, 1) of two waves and a fixed residual."""
    M = model.array.n_sensors
    wave = model.wave(AZIMUTH, [1.0, 0.5j], elevation=ELEVATION)
    return np.asarray((wave + 0.1 * np.exp(1j * np.arange(M) ** 2))[None, :, None])


def test_step_of_a_square_equals_the_specification() -> None:
    model = MODELS["cosines"]
    manifold = manifold_of(model)
    response, Y = ExpectedResponse(manifold), two_waves(model)
    x = manifold.from_doa(AZIMUTH, ELEVATION)  # type: ignore[attr-defined]
    components = Components.zeros(1, 2, response.chart.layout)
    components.point[0], components.prior_mean[0] = x + 0.05, x
    components.covariance[0] = [[0.02, 0.01], [0.005, 0.0], [0.03, 0.01]]
    components.prior_precision[0] = np.array([[3.0], [0.0], [3.0]])
    components.log_odds[0] = 1.0, -1.0
    nu, tau = np.array([[0.02]]), np.array([[0.7]])
    state = evaluate(response, Y[None], components, np.array([2]), nu, tau, np.zeros(1))
    g, C = slopes(response, state, *weights(state))
    assert state.F[0] == pytest.approx(189.640741, rel=1e-8)
    np.testing.assert_allclose(state.D[0], [0.975193, 1.804793], rtol=1e-6)
    np.testing.assert_allclose(g[0].T, [[-68.2476, -101.5275], [-31.9089, -12.7219]], rtol=1e-5)
    np.testing.assert_allclose(
        C[0].T, [[1496.739, 30.867, 1512.707], [400.889, -12.834, 396.99]], rtol=2e-5
    )
    after = newton_step(response, state, NONE)
    assert after.F[0] == pytest.approx(232.685108, rel=1e-8)
    np.testing.assert_allclose(
        after.components.point[0].T, [[2.336209, 1.327426], [-0.339051, 0.868876]], rtol=1e-5
    )


@pytest.mark.parametrize(
    ("array", "expected"),
    [(SQUARE, [[29.597, 40.108], [111.416, 74.618]]),
     (TWELVE, [[32.272, 40.741], [111.643, 76.175]])],
    ids=["square", "sphere"],
)  # fmt: skip
def test_fit_equals_the_specification(array: SensorArray, expected: list[list[float]]) -> None:
    model = ArraySnapshot(array, 1.0, unknowns="sphere")
    manifold = manifold_of(model)
    fit = NewtonSolver().solve(two_waves(model), manifold, None)
    assert fit.covariance is not None
    on = fit.active
    found = manifold.located(fit.theta[on].T, fit.covariance[on].T)
    degrees = np.rad2deg(np.stack([found["doa"], found["elevation"]], axis=1))
    np.testing.assert_allclose(degrees[np.argsort(degrees[:, 0])], expected, atol=2e-3)


def curved_wave(curvature: float) -> Complex:
    p = LINE.positions[:, 0] - LINE.positions.mean()
    K = 2 * np.pi * np.stack([p, -(p**2 - (p**2).mean()) / 2], axis=1)
    y = np.exp(1j * K @ [0.3, curvature]) + 0.05 * np.exp(1j * np.arange(16) ** 2)
    return np.asarray(y[None, :, None])


@pytest.mark.parametrize(
    ("curvature", "expected", "curved"),
    [(0.02, (0.299239, 0.019208), True), (0.0, (0.299281, -0.000569), False)],
)
def test_curvature_by_spike_and_slab_equals_the_specification(
    curvature: float, expected: tuple[float, float], curved: bool
) -> None:
    manifold = fresnel_line(PlaneWaves(LINE, (1.0,)), 0.05)
    fit = NewtonSolver().solve(curved_wave(curvature), manifold, None)
    x = fit.theta[fit.active] * np.array(manifold.unit)
    assert fit.curved is not None
    assert fit.curved[fit.active].tolist() == [curved]
    np.testing.assert_allclose(x, [expected], atol=1e-5)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6))
def test_switch_raises_the_criterion_or_changes_nothing(seed: int) -> None:
    response, state = scene("curved", seed)
    components = state.components.copy()
    spike = manifold_of(MODELS["curved"]).spike_precision
    components.prior_precision[0] = np.array([[0.0], [0.0], [spike]])
    state = again(response, state, components)
    after, tried, changed = switch_waves(response, state, NONE, 3, 0.2, 0.5)
    if changed[0]:
        assert tried[0]
        assert after.criterion(0.5)[0] > state.criterion(0.5)[0]
    else:
        assert after is state


# -- batches, settings ----------------------------------------------------------------------------


def observed(model: ArraySnapshot, seed: int) -> Complex:
    rng, manifold = np.random.default_rng(seed), manifold_of(model)
    points = manifold.candidates().points
    x = points[:, rng.integers(points.shape[1], size=1 + seed % 3)]
    A = manifold.at(x)[0]
    shape = (A.shape[0], A.shape[2], model.n_snapshots)
    w = np.exp(2j * np.pi * rng.random((A.shape[0], x.shape[1], model.n_snapshots)))
    noise = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return np.asarray(A.swapaxes(1, 2) @ w + 0.1 * noise)


@every_model
def test_batch_of_snapshots_equals_single_fits(name: str) -> None:
    model = MODELS[name]
    manifold, solver = manifold_of(model), NewtonSolver(snr_db=20.0)
    Ys: list[Complex] = [observed(model, n) for n in range(5)]
    Ys[2] = 0 * Ys[2]
    x = manifold.candidates().points[:, :2].T
    kappa = np.array([[5.0, 0.0, 400.0], [4.0, 0.0, 400.0]])
    prior = ComponentPrior(x, kappa, np.array([0.75, 0.1]), 0.1, np.array([0, 1]), 15.0)
    for priors in ([None] * 5, [prior] * 5):
        together = solver.solve_batch(Ys, manifold, priors)
        for Y, each, fit in zip(Ys, priors, together, strict=True):
            alone = solver.solve(Y, manifold, each)
            np.testing.assert_allclose(fit.theta, alone.theta, atol=1e-7)
            assert fit.age.tolist() == alone.age.tolist()
            assert fit.iterations == alone.iterations


@every_model
def test_distances_of_several_problems_are_those_of_each(name: str) -> None:
    manifold = manifold_of(MODELS[name])
    points = manifold.candidates().points
    x = np.stack([points[:, :3], points[:, 5:8], points[:, -3:]])
    together = manifold.distance(x, x)
    alone = [manifold.distance(each, each) for each in x]
    np.testing.assert_allclose(together, alone, atol=1e-7)
    np.testing.assert_allclose(manifold.distance(x, points)[1], manifold.distance(x[1], points))


def test_fit_does_not_depend_on_scale_and_phase() -> None:
    model = MODELS["sphere"]
    Y, manifold = observed(model, 2), manifold_of(model)
    one, other = (NewtonSolver().solve(factor * Y, manifold, None) for factor in (1.0, 3 - 4j))
    np.testing.assert_allclose(one.theta, other.theta, atol=1e-9)
    assert one.iterations == other.iterations


def test_array_that_turns_turns_the_directions() -> None:
    R = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = ArraySnapshot(SensorArray(TWELVE.positions @ R.T), 1.0, unknowns="sphere")
    Y = observed(MODELS["sphere"], 1)
    directions: list[Float] = []
    for model in (MODELS["sphere"], turned):
        manifold = manifold_of(model)
        fit = NewtonSolver().solve(Y, manifold, None)
        u = manifold.direction(fit.theta[fit.active].T)  # type: ignore[attr-defined]
        directions.append(u[:, np.argsort(u[2])])
    np.testing.assert_allclose(R @ directions[0], directions[1], atol=1e-5)


def test_merging_by_correlation_keeps_one_of_two_equal_responses() -> None:
    model = ArraySnapshot(SensorArray.ula(15, 0.5), 1.0)
    y = unit(model.wave([0.3], [1.0]))[None, :, None]
    mu = model.angle_manifold().from_doa(np.array([0.300, 0.306, 0.6]))
    prior = ComponentPrior(mu, np.full(3, 100.0), np.full(3, 0.9), 0.1, np.zeros(3, int), 20.0)
    fit = NewtonSolver(merge_correlation=0.95).solve(y, model.manifold(), prior)
    assert np.count_nonzero(fit.active) == 1
    with pytest.raises(ValueError, match=r"merge_correlation must lie in \(0, 1\]; got 0"):
        NewtonSolver(merge_correlation=0.0)
    with pytest.raises(ValueError, match="curved_probability must lie between 0 and 1; got 1"):
        NewtonSolver(curved_probability=1.0)
