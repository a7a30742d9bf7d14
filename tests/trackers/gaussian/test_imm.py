"""IMM: laws of mixtures, angles, and filters that raise."""

import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import CombinedMotion, ConstantVelocity, RandomWalk, VonMisesWalk
from arrivals.trackers import EKF, IMM, UKF, Kalman, Particle, create
from arrivals.trackers.conformance import difference
from arrivals.trackers.gaussian.circular import mixture

POSITION = LinearMeasurement([[1.0]], [[0.04]])
M = np.array([[0.9, 0.1], [0.2, 0.8]])


def member(q: float, x: float = 0.0) -> Kalman:
    return Kalman(RandomWalk(q, 1), POSITION, [x], [[1.0]])


def two(**changes: Any) -> IMM:
    params: dict[str, Any] = {"filters": [member(0.01), member(1.0)], "mu": [0.5, 0.5], "M": M}
    return IMM(**(params | changes))


@given(st.integers(0, 10_000))
def test_mixture_has_the_moments_of_its_components(seed: int) -> None:
    rng = np.random.default_rng(seed)
    means, A = rng.normal(size=(3, 2)), rng.normal(size=(3, 2, 2))
    covariances, weights = A @ A.swapaxes(1, 2), rng.dirichlet(np.ones(3), size=4)
    x, P = mixture(means, covariances, weights)
    second = np.einsum("ki,ijl->kjl", weights, covariances + means[:, :, None] * means[:, None])
    np.testing.assert_allclose(x, weights @ means, atol=1e-12)
    np.testing.assert_allclose(P, second - x[:, :, None] * x[:, None], atol=1e-12)


@given(st.floats(-10, 10), st.floats(0.01, 0.99))
def test_rotated_mixture_rotates_the_mean(turn: float, weight: float) -> None:
    weights, covariances = np.array([weight, 1 - weight]), np.ones((2, 1, 1))
    (x, P), (y, V) = (
        mixture(np.array([[0.4], [-0.7]]) + t, covariances, weights, (0,)) for t in (0.0, turn)
    )
    assert np.cos(y[0] - x[0] - turn) == pytest.approx(1.0)
    np.testing.assert_allclose(P, V, atol=1e-9)


@pytest.mark.parametrize("kind", [EKF, UKF])
@pytest.mark.parametrize("turned", [False, True])
def test_imm_combined_circular_state_averages_on_the_circle(kind: Any, turned: bool) -> None:
    walks = RandomWalk(0.1, 1), VonMisesWalk(50.0)
    motion, angle = CombinedMotion(*walks[::-1] if turned else walks), 0 if turned else 1
    position = LinearMeasurement(np.eye(2), np.eye(2))
    x = np.zeros(2)
    x[angle] = np.pi - 0.05
    members = [kind(motion, position, sign * x, np.eye(2)) for sign in (1, -1)]
    bank = IMM(members, [0.5, 0.5], np.full((2, 2), 0.5))
    assert abs(bank.x[angle]) == pytest.approx(np.pi)
    bank.predict()
    assert abs(bank.x[angle]) == pytest.approx(np.pi)


def test_imm_of_equal_filters_equals_one_filter() -> None:
    bank, alone = two(filters=[member(0.1), member(0.1)]), member(0.1)
    for z in ([0.3], None, [0.1], [np.nan], [-0.2]):
        for f in (bank, alone):
            f.predict()
            f.update(z)
        np.testing.assert_allclose(bank.x, alone.x, atol=1e-14)
        np.testing.assert_allclose(bank.P, alone.P, atol=1e-14)
        assert bank.log_likelihood == pytest.approx(alone.log_likelihood)


def test_imm_probabilities_equal_bayes_over_all_model_histories() -> None:
    """Without switching: p(i | z) ∝ μᵢ Π p(zₜ | i), by independent filters."""
    zs = np.random.default_rng(0).normal(size=(6, 1))
    bank = two(M=np.eye(2), mu=[0.3, 0.7])
    bank.run(zs)
    log = np.log([0.3, 0.7])
    for i, q in enumerate((0.01, 1.0)):
        alone = member(q)
        for z in zs:
            alone.predict()
            alone.update(z)
            log[i] += alone.log_likelihood
    np.testing.assert_allclose(bank.mu, np.exp(log - np.logaddexp(*log)), rtol=1e-10)


def test_imm_missing_measurement_keeps_predicted_probabilities() -> None:
    bank = two()
    bank.predict()
    assert bank.mu == pytest.approx([0.55, 0.45])
    bank.update(None)
    assert bank.mu == pytest.approx([0.55, 0.45])
    np.testing.assert_array_equal(bank.likelihood, 1.0)


def test_imm_second_update_does_not_apply_the_transition_again() -> None:
    apart = two()
    apart.predict()
    log = [np.log(apart.mu)]
    for z in ([0.2], [0.5]):
        apart.update(z)
        log.append(np.log(apart.likelihood))
    odds = np.sum(log, axis=0)
    np.testing.assert_allclose(np.log(apart.mu[0] / apart.mu[1]), odds[0] - odds[1])


def test_imm_accepts_different_trackers() -> None:
    walk = VonMisesWalk(30.0)
    bank = IMM(
        [
            EKF(walk, POSITION, [3.0], [[0.1]]),
            UKF(walk, POSITION, [3.0], [[0.1]]),
            Particle(walk, POSITION, [3.0], [[0.1]], 500, rng=0),
        ],
        np.ones(3) / 3,
        np.full((3, 3), 1 / 3),
    )
    run = bank.run([[3.0], None, [3.1]], dt=0.5)
    assert run.x[-1] == pytest.approx(3.05, abs=0.1)


def test_imm_detects_a_turn() -> None:
    position = LinearMeasurement(np.eye(4)[::2], np.eye(2))
    filters = [
        Kalman(ConstantVelocity(q), position, [0.0, 5.0, 0.0, 0.0], np.eye(4)) for q in (1e-4, 4.0)
    ]
    bank = create("imm", filters=filters, mu=[0.5, 0.5], M=[[0.97, 0.03], [0.03, 0.97]])
    t = np.arange(20)
    straight = np.stack([5.0 + 5.0 * t, 0.0 * t], axis=1)
    turned = straight[-1] + np.stack([0.0 * t[:5], 5.0 * t[:5] + 5], axis=1)
    bank.run(straight)
    assert bank.mu[0] > 0.6  # type: ignore[attr-defined]
    bank.run(turned)
    assert bank.mu[1] > 0.6  # type: ignore[attr-defined]


@pytest.mark.parametrize("call", ["update", "predict"])
def test_imm_filter_that_raises_leaves_all_unchanged(call: str) -> None:
    class Faulty(Kalman):
        def update(self, *args: Any, **kwargs: Any) -> None:
            raise RuntimeError("sensor on fire")

        def predict(self, *args: Any, **kwargs: Any) -> None:
            raise RuntimeError("sensor on fire")

    bank = two(filters=[member(0.1), Faulty(RandomWalk(1.0, 1), POSITION, [0.0], [[1.0]])])
    before = copy.deepcopy(vars(bank))
    with pytest.raises(RuntimeError, match="on fire"):
        getattr(bank, call)(*([[1.0]] if call == "update" else []))
    assert difference(before, vars(bank)) is None


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        (
            {"filters": [member(1.0)], "mu": [1.0], "M": [[1.0]]},
            ValueError,
            "filters must have at least two entries; got 1",
        ),
        (
            {"filters": [member(1.0), "text"]},
            TypeError,
            "got str without x, P, predict, update, likelihood",
        ),
        ({"mu": [0.5]}, ValueError, r"mu must have shape \(2,\); got \(1,\)"),
        ({"mu": [-0.5, 1.5]}, ValueError, "mu must hold probabilities"),
        ({"mu": [0.0, 0.0]}, ValueError, "mu must hold probabilities"),
        ({"M": np.eye(3)}, ValueError, r"M must have shape \(2, 2\)"),
        ({"M": np.ones((2, 2))}, ValueError, r"M must have rows of sum 1; got \[2.0, 2.0\]"),
        (
            {"filters": [member(1.0), Kalman(RandomWalk(1.0, 1), POSITION, [[0.0]], [[1.0]])]},
            ValueError,
            r"filters must have x of one shape; got \[\(1,\), \(1, 1\)\]",
        ),
    ],
)
def test_invalid_parameters_raise(
    changes: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        two(**changes)


def test_imm_probabilities_are_normalized() -> None:
    np.testing.assert_allclose(two(mu=[1, 3]).mu, [0.25, 0.75])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda bank: bank.predict(np.nan), "u must be finite"),
        (lambda bank: bank.predict(dt=np.inf), "dt must be finite and not negative; got inf"),
        (lambda bank: bank.predict(1.0), "u must be None or 0|control matrix"),
        (lambda bank: bank.update([1.0, 2.0]), r"z must have shape \(1,\)"),
    ],
)
@pytest.mark.parametrize("first", [0, 1])
def test_error_leaves_members_and_their_random_numbers_unchanged(
    call: Any, message: str, first: int
) -> None:
    def bank() -> IMM:
        particle = Particle(RandomWalk(0.1, 1), POSITION, [0.0], [[1.0]], n_particles=30, rng=3)
        return two(filters=[particle, member(0.1)] if first else [member(0.1), particle])

    tracker, untouched = bank(), bank()
    with pytest.raises(ValueError, match=message):
        call(tracker)
    for each in (tracker, untouched):
        each.predict()
        each.update([0.3])
    np.testing.assert_array_equal(tracker.x, untouched.x)
    np.testing.assert_array_equal(tracker.P, untouched.P)
    np.testing.assert_array_equal(tracker.mu, untouched.mu)
