"""Motion models: shapes, Jacobians, noise, copies, equality and invalid arguments."""

import copy
import pickle

import numpy as np
import pytest
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from arrivals.motion_models import (
    BernoulliVonMises,
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    MotionModel,
    RandomWalk,
    VonMisesFisherWalk,
    VonMisesWalk,
)
from arrivals.typing import Float

MODELS = [
    RandomWalk(q=0.5),
    RandomWalk(q=0.5, n_dims=3),
    ConstantVelocity(q=0.1),
    ConstantVelocity(q=0.1, n_dims=1),
    CoordinatedTurn(q=0.1, q_turn=0.02),
    LinearMotion([[1.0, 0.5], [-0.2, 0.9]], [[0.2, 0.1], [0.1, 0.3]], control=[[0.0], [1.0]]),
    VonMisesWalk(kappa=50.0),
    BernoulliVonMises(),
    VonMisesWalk(sigma_doa=0.1),
    BernoulliVonMises(sigma_doa=0.1),
    VonMisesFisherWalk(kappa=50.0),
    VonMisesFisherWalk(sigma_doa=0.1),
]
every_model = pytest.mark.parametrize("model", MODELS, ids=lambda m: f"{type(m).__name__}{m.dim_x}")

steps = st.floats(0.01, 10)
turn_rates = st.one_of(st.floats(-3, 3), st.floats(-1e-6, 1e-6), st.just(0.0))


def states(model: MotionModel, *shape: int) -> Float:
    return np.random.default_rng(4).uniform(-1, 1, (*shape, model.dim_x))


def slope(model: MotionModel, x: Float, dt: float, h: float = 1e-5) -> Float:
    steps = h * np.eye(model.dim_x)
    return (model.f(x + steps, dt) - model.f(x - steps, dt)).T / (2 * h)


# what holds for all of them


@every_model
def test_states_may_have_any_leading_axes(model: MotionModel) -> None:
    x, rng = states(model, 2, 3), np.random.default_rng(0)
    assert model.f(x).shape == model.sample(x, rng).shape == x.shape
    np.testing.assert_allclose(model.f(x)[1, 2], model.f(x[1, 2]), rtol=1e-14)
    assert model.F(x[0, 0]).shape == model.Q().shape == (model.dim_x, model.dim_x)


@every_model
def test_jacobian_equals_numerical_slope(model: MotionModel) -> None:
    x = states(model)
    np.testing.assert_allclose(model.F(x), slope(model, x, 1.0), atol=1e-9)


@every_model
def test_noise_is_symmetric_and_semidefinite(model: MotionModel) -> None:
    Q = model.Q()
    np.testing.assert_array_equal(Q, Q.T)
    assert np.linalg.eigvalsh(Q).min() > 0


@every_model
def test_samples_have_covariance_Q(model: MotionModel) -> None:
    x = np.tile(states(model), (20_000, 1))
    drawn = model.sample(x, np.random.default_rng(0)) - model.f(x)
    Q = model.Q()
    if isinstance(model, VonMisesFisherWalk):  # in the tangent plane: unit vectors stay so
        tangent = np.linalg.svd(model.f(x[:1]))[2][1:]
        drawn, Q = drawn @ tangent.T, tangent @ Q @ tangent.T
    scale = np.sqrt(np.diag(Q))
    # Correlations have a standard error of at most sqrt(2/20000) = 0.01; kappa = 50 adds 0.0001.
    assert (abs(np.cov(drawn.T) - Q) < 0.06 * np.outer(scale, scale)).all()
    assert (abs(drawn.mean(axis=0)) < 0.04 * scale).all()


@every_model
def test_samples_repeat_with_the_generator(model: MotionModel) -> None:
    x = states(model, 3)
    first, again = (model.sample(x, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(first, again)


@every_model
def test_column_state_is_refused_with_the_cure(model: MotionModel) -> None:
    column = np.ones((model.dim_x, 1))
    if model.dim_x == 1:
        assert model.f(column).shape == (1, 1)  # also one state of one entry
        return
    with pytest.raises(ValueError, match=r"got the column \(\d, 1\): pass x.ravel\(\)"):
        model.f(column)
    with pytest.raises(ValueError, match=r"states must have shape \(\.\.\., \d\); got \(7,\)"):
        model.f(np.ones(7))


@every_model
def test_arguments_are_not_modified(model: MotionModel) -> None:
    x = states(model, 4)
    kept = x.copy()
    for moved in (model.f(x), model.sample(x, np.random.default_rng(0))):
        moved += 1.0
    F, Q = model.F(x[0]), model.Q()
    expected = F.copy(), Q.copy()
    F += 1.0
    Q += 1.0
    np.testing.assert_array_equal(x, kept)
    np.testing.assert_array_equal(model.F(x[0]), expected[0])
    np.testing.assert_array_equal(model.Q(), expected[1])


@every_model
def test_model_makes_the_round_trip_of_copies_and_configuration(model: MotionModel) -> None:
    for twin in (
        pickle.loads(pickle.dumps(model)),
        copy.deepcopy(model),
        model.replace(),
        type(model).from_dict(model.to_dict()),
    ):
        assert type(twin) is type(model)
        assert twin == model
        assert hash(twin) == hash(model)
        np.testing.assert_array_equal(twin.Q(), model.Q())


@every_model
def test_model_is_frozen(model: MotionModel) -> None:
    name = next(iter(model.get_params()))
    with pytest.raises(AttributeError, match="cannot assign to field"):
        setattr(model, name, 1.0)


@every_model
def test_negative_duration_is_refused(model: MotionModel) -> None:
    with pytest.raises(ValueError, match="dt"):
        model.Q(dt=-1.0)


def test_replace_returns_another_model() -> None:
    model = ConstantVelocity(q=0.1)
    other = model.replace(q=0.2)
    assert (model.q, other.q) == (0.1, 0.2)
    assert other != model
    with pytest.raises(ValueError, match="q must be finite and not negative; got -1"):
        model.replace(q=-1)


# linear motion


@given(steps, st.floats(0, 10), st.integers(1, 4))
def test_constant_velocity_equals_filterpy(dt: float, q: float, n_dims: int) -> None:
    theirs = Q_continuous_white_noise(2, dt, q, block_size=n_dims)
    np.testing.assert_allclose(ConstantVelocity(q, n_dims).Q(dt), theirs, rtol=1e-14)


@pytest.mark.parametrize("model", [RandomWalk(0.3, 3), ConstantVelocity(0.3)])
@given(steps, steps)
def test_noise_of_two_steps_equals_that_of_one(model: MotionModel, a: float, b: float) -> None:
    F = model.F(np.zeros(model.dim_x), b)
    np.testing.assert_allclose(F @ model.Q(a) @ F.T + model.Q(b), model.Q(a + b), rtol=1e-12)
    np.testing.assert_allclose(F @ model.F(states(model), a), model.F(states(model), a + b))
    assert not model.Q(dt=0.0).any()


def test_velocity_follows_its_coordinate() -> None:
    moved = ConstantVelocity(q=1.0, n_dims=3).f([0, 1, 10, 2, 20, 3], dt=2.0)
    assert moved.tolist() == [2, 1, 14, 2, 26, 3]


@pytest.mark.parametrize("kind", [RandomWalk, ConstantVelocity])
def test_linear_models_refuse_invalid_parameters(kind: type[RandomWalk]) -> None:
    with pytest.raises(ValueError, match="q must be finite and not negative; got nan"):
        kind(q=np.nan)
    with pytest.raises(ValueError, match="n_dims must be at least 1; got 0"):
        kind(q=1.0, n_dims=0)
    with pytest.raises(TypeError, match="n_dims must be a whole number"):
        kind(q=1.0, n_dims=1.5)  # type: ignore[arg-type]


def test_linear_motion_copies_matrices_read_only() -> None:
    transition = np.array([[0.5]])
    model = LinearMotion(transition, [[1.0]])
    transition[0, 0] = 9.0
    assert model.f([2.0]).tolist() == [1.0]
    for twin in (model, pickle.loads(pickle.dumps(model))):
        with pytest.raises(ValueError, match="read-only"):
            twin.transition[0, 0] = 9.0


def test_linear_motion_is_compared_by_content() -> None:
    model = LinearMotion([[0.5]], [[1.0]])
    assert model == LinearMotion([[0.5]], [[1]])
    assert model != LinearMotion([[0.5]], [[1.0]], control=[[1.0]])
    assert model != LinearMotion([[0.5]], [[2.0]])
    assert model != RandomWalk(1.0, 1)
    assert len({model, LinearMotion([[0.5]], [[1]]), LinearMotion([[0.0]], [[1]])}) == 2
    assert hash(LinearMotion([[0.0]], [[1]])) == hash(LinearMotion([[-0.0]], [[1]]))


@pytest.mark.parametrize(
    ("transition", "noise", "control", "message"),
    [
        ([[1.0, 0.0]], [[1.0]], None, r"transition must have shape \(1, 1\); got \(1, 2\)"),
        ([1.0], [[1.0]], None, r"transition must be a matrix; got shape \(1,\)"),
        ([[np.nan]], [[1.0]], None, "transition must be finite"),
        ([[1.0]], np.eye(2), None, r"noise must have shape \(1, 1\); got \(2, 2\)"),
        (np.eye(2), [[1.0, 0.5], [0.0, 1.0]], None, "noise must be symmetric"),
        (np.eye(2), [[1.0, 2.0], [2.0, 1.0]], None, "noise must have no negative eigenvalue"),
        (np.eye(2), np.eye(2), [[1.0, 2.0]], r"control must have shape \(2, 2\); got \(1, 2\)"),
    ],
)
def test_linear_motion_refuses_invalid_matrices(
    transition: ArrayLike, noise: ArrayLike, control: ArrayLike, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        LinearMotion(transition, noise, control)


def test_linear_motion_refuses_other_durations() -> None:
    model = LinearMotion([[0.5]], [[1.0]])
    for method, x in (("f", [[1.0]]), ("F", [[1.0]]), ("Q", [])):
        with pytest.raises(
            ValueError, match=r"dt must be 1 for the matrices of LinearMotion; got 0\.5"
        ):
            getattr(model, method)(*x, dt=0.5)


# turning


@given(turn_rates, st.floats(0.1, 2))
def test_coordinated_turn_stays_on_a_circle(omega: float, dt: float) -> None:
    x = np.array([3.0, 2.0, -1.0, 0.5, omega])
    moved = CoordinatedTurn(0.1, 0.1).f(x, dt)
    velocity = (2 + 0.5j) * np.exp(1j * omega * dt)
    assert moved[1] + 1j * moved[3] == pytest.approx(velocity, rel=1e-12)
    # The integral of the velocity, by Gauss-Legendre's rule.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    path = (2 + 0.5j) * np.exp(1j * omega * dt * (nodes + 1) / 2) @ weights * dt / 2
    assert moved[0] + 1j * moved[2] == pytest.approx(3 - 1j + path, rel=1e-12)


@given(turn_rates, st.floats(0.1, 2))
def test_coordinated_turn_jacobian_is_the_slope_of_the_exact_path(omega: float, dt: float) -> None:
    x = np.array([3.0, 2.0, -1.0, 0.5, omega])
    F = CoordinatedTurn(0.1, 0.1).F(x, dt)
    # d/dω of the integral above: another integral, without any division by ω.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    t = dt * (nodes + 1) / 2
    path = (2 + 0.5j) * (1j * t * np.exp(1j * omega * t)) @ weights * dt / 2
    assert F[0, 4] + 1j * F[2, 4] == pytest.approx(path, rel=1e-11, abs=1e-13)
    np.testing.assert_allclose(F, slope(CoordinatedTurn(0.1, 0.1), x, dt), atol=1e-8)


@given(turn_rates, steps, steps)
def test_two_coordinated_turns_equal_one(omega: float, a: float, b: float) -> None:
    model, x = CoordinatedTurn(0.1, 0.1), np.array([3.0, 2.0, -1.0, 0.5, omega])
    np.testing.assert_allclose(model.f(model.f(x, a), b), model.f(x, a + b), rtol=0, atol=1e-11)


def test_coordinated_turn_without_rate_is_constant_velocity() -> None:
    x = np.array([3.0, 2.0, -1.0, 0.5, 0.0])
    turn, straight = CoordinatedTurn(q=0.3, q_turn=0.2), ConstantVelocity(q=0.3)
    np.testing.assert_allclose(turn.f(x, 2.0)[:4], straight.f(x[:4], 2.0), rtol=1e-15)
    np.testing.assert_allclose(turn.F(x, 2.0)[:4, :4], straight.F(x[:4], 2.0), rtol=1e-15)
    np.testing.assert_array_equal(turn.Q(2.0)[:4, :4], straight.Q(2.0))
    assert turn.Q(2.0)[4].tolist() == [0, 0, 0, 0, 0.4]


def test_coordinated_turn_jacobian_requires_one_state() -> None:
    with pytest.raises(ValueError, match=r"x must have shape \(5,\); got \(2, 5\)"):
        CoordinatedTurn(0.1, 0.1).F(np.zeros((2, 5)))
    with pytest.raises(ValueError, match="q_turn must be finite and not negative; got -1"):
        CoordinatedTurn(0.1, -1)


# in filterpy's filters


def test_filterpy_filters_with_our_models_agree() -> None:
    walk, H, R = ConstantVelocity(q=0.2), np.eye(4)[::2], 0.3 * np.eye(2)
    kalman = KalmanFilter(dim_x=4, dim_z=2)
    kalman.x, kalman.F, kalman.Q, kalman.H, kalman.R = np.zeros(4), walk.F(), walk.Q(), H, R
    points = MerweScaledSigmaPoints(4, alpha=0.5, beta=2.0, kappa=-1.0)
    unscented = UnscentedKalmanFilter(4, 2, 1.0, fx=walk.f, hx=lambda x: x[::2], points=points)
    unscented.x, unscented.Q, unscented.R = np.zeros(4), walk.Q(), R
    for z in np.random.default_rng(0).normal(size=(5, 2)):
        for tracker in (kalman, unscented):
            tracker.predict()
            tracker.update(z)
    np.testing.assert_allclose(unscented.x, kalman.x, atol=1e-9)
