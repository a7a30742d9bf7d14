"""Recursive least squares by QR decomposition: equality with batch least squares."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.trackers import QRDRLS
from arrivals.typing import Float

RNG = np.random.default_rng(0)
X, W = RNG.standard_normal((40, 3)), RNG.standard_normal((3, 2))
Y = X @ W + 0.1 * RNG.standard_normal((40, 2))
GOAL = RNG.standard_normal((3, 2))


def ridge(X: Float, Y: Float, weights: Float, mu: float, goal: Float) -> Float:
    """Solve the normal equations."""
    Xw = X * weights[:, None]
    return np.asarray(np.linalg.solve(Xw.T @ X + mu * np.eye(X.shape[1]), Xw.T @ Y + mu * goal))


def scale(factor: Float) -> float:
    return float(np.abs(factor.T @ factor).max())


@given(st.floats(0.5, 1.0), st.floats(1e-3, 10.0), st.sampled_from([None, GOAL]))
def test_block_update_equals_ridge_least_squares_with_weights(
    forgetting: float, mu: float, goal: Float | None
) -> None:
    rls = QRDRLS(3, 2, forgetting=forgetting, ridge=mu, target=goal)
    rls.update(X[:10], Y[:10])
    rls.update(X[10:], Y[10:])
    age = forgetting ** np.arange(39, -1, -1.0)
    goal = np.zeros((3, 2)) if goal is None else goal
    np.testing.assert_allclose(rls.solve(), ridge(X, Y, age, mu, goal), rtol=1e-9, atol=1e-11)


def test_block_update_equals_sequential_updates() -> None:
    block, sequential = (QRDRLS(3, 2, forgetting=0.97, target=GOAL) for _ in range(2))
    block.update(X, Y)
    for x, y in zip(X, Y, strict=True):
        sequential.update(x[None], y[None])
    gram = [rls.factor.T @ rls.factor for rls in (block, sequential)]
    assert np.abs(gram[0] - gram[1]).max() <= 5e-15 * scale(block.factor)
    assert np.abs(block.solve() - sequential.solve()).max() <= 5e-15 * np.abs(block.solve()).max()
    assert block.weight == pytest.approx(sequential.weight)


def test_several_right_hand_sides_equal_separate_problems() -> None:
    both = QRDRLS(3, 2)
    both.update(X, Y)
    for m in range(2):
        alone = QRDRLS(3)
        alone.update(X, Y[:, m : m + 1])
        np.testing.assert_allclose(both.solve()[:, m], alone.solve()[:, 0], atol=1e-14)
        np.testing.assert_allclose(both.residual_power()[m], alone.residual_power()[0])


def test_residual_power_equals_mean_square_of_errors() -> None:
    rls = QRDRLS(3, 2, forgetting=1.0, ridge=1e-9)
    assert np.isnan(rls.residual_power()).all()
    rls.update(X, Y)
    left = Y - X @ np.linalg.lstsq(X, Y, rcond=None)[0]
    np.testing.assert_allclose(rls.residual_power(), (left**2).mean(axis=0), rtol=1e-6)


def test_covariance_rows_remove_the_bias_of_estimated_regressors() -> None:
    rng, n = np.random.default_rng(1), 100_000
    y = 2 * rng.standard_normal((n, 1)) + rng.standard_normal((n, 1))  # a = 2, s and e of power 1
    estimated, variance = 0.4 * y, 0.2  # E s given y
    plain, right = QRDRLS(1, forgetting=1.0), QRDRLS(1, forgetting=1.0)
    plain.update(estimated, y)
    right.update(estimated, y, extra_rows=[[np.sqrt(n * variance), 0.0]])
    assert plain.solve()[0, 0] == pytest.approx(2.5, abs=1e-3)
    assert right.solve()[0, 0] == pytest.approx(2.0, abs=0.02)  # five standard errors


def test_weights_and_huber_reduce_the_effect_of_outliers() -> None:
    wild = Y.copy()
    wild[5] += 100.0
    kept = np.ones(40)
    kept[5] = 0.0
    weighted, robust, plain = QRDRLS(3, 2), QRDRLS(3, 2, huber=0.5), QRDRLS(3, 2)
    for rls in (robust, plain):
        rls.update(X[20:], Y[20:])
        rls.update(X[:20], wild[:20])
    weighted.update(X, wild, weights=kept)
    age = np.where(kept, 0.99 ** np.arange(39, -1, -1.0), 0.0)
    np.testing.assert_allclose(
        weighted.solve(), ridge(X, wild, age, 0.01, np.zeros((3, 2))), atol=1e-12
    )
    assert np.abs(robust.solve() - W).max() < 0.2 < np.abs(plain.solve() - W).max()


def test_leading_axes_are_independent_problems() -> None:
    batch = QRDRLS(3, 2)
    batch.update(np.stack([X, 2 * X]), np.stack([Y, Y]))
    for n, factor in enumerate((1, 2)):
        alone = QRDRLS(3, 2)
        alone.update(factor * X, Y)
        np.testing.assert_allclose(batch.solve()[n], alone.solve(), atol=1e-14)


def test_complex_samples_are_two_equations_of_one_age() -> None:
    rls = QRDRLS(3, 2, forgetting=0.9)
    rls.update(X[:20] + 1j * X[20:], Y[:20] + 1j * Y[20:])
    age = np.repeat(0.9 ** np.arange(19, -1, -1.0), 2)
    both = (
        np.stack([X[:20], X[20:]], 1).reshape(40, 3),
        np.stack([Y[:20], Y[20:]], 1).reshape(40, 2),
    )
    np.testing.assert_allclose(rls.solve(), ridge(*both, age, 0.01, np.zeros((3, 2))), atol=1e-12)
    assert rls.weight == pytest.approx(age.sum() / 2)


WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: QRDRLS(0), "n_coef"),
    (lambda: QRDRLS(1, forgetting=1.5), r"\(0, 1\]"),
    (lambda: QRDRLS(1, ridge=0.0), "ridge"),
    (lambda: QRDRLS(1, huber=-1.0), "huber"),
    (lambda: QRDRLS(2, target=[[1.0]]), r"target must have shape \(\.\.\., 2, 1\)"),
    (lambda: QRDRLS(2).update([[1.0]], [[1.0]]), r"X must have shape \(\.\.\., n_samples, 2\)"),
    (lambda: QRDRLS(1).update([[1.0]], [[1.0], [2.0]]), "as many samples"),
    (lambda: QRDRLS(1).update([[1.0]], [[1.0]], weights=[-1.0]), "weights"),
    (lambda: QRDRLS(1).update([[1.0]], [[1.0]], extra_rows=[[1.0]]), "extra_rows"),
]


@pytest.mark.parametrize(("call", "message"), WRONG, ids=[w[1][:20] for w in WRONG])
def test_invalid_input_raises_with_message(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    "hidden",
    [np.nan, np.inf, -1e200, None, np.ma.masked],
    ids=["nan", "infinite", "huge", "None", "masked"],
)
def test_sample_with_a_missing_number_has_weight_zero(hidden: object) -> None:
    weights = np.ones(40)
    weights[[3, 20]] = 0
    expected, found = QRDRLS(3, 2, target=GOAL), QRDRLS(3, 2, target=GOAL)
    expected.update(X, Y, weights)
    rows, sides = (np.ma.array(a).astype(object) for a in (X, Y))
    rows[3, 1], sides[20, 0] = hidden, hidden
    found.update(rows, sides)
    np.testing.assert_allclose(found.solve(), expected.solve(), rtol=1e-12)
    assert found.weight == pytest.approx(expected.weight)


def test_complex_sample_with_a_missing_number_has_weight_zero() -> None:
    Z = Y + 1j * Y[::-1]
    part, whole = QRDRLS(3, 2), QRDRLS(3, 2)
    part.update(X, Z, np.arange(40) != 39)
    Z[39, 1] = np.nan
    whole.update(X, Z)
    np.testing.assert_allclose(whole.solve(), part.solve(), rtol=1e-12)


def test_zeros_are_samples() -> None:
    rls = QRDRLS(2, forgetting=0.9)
    for _ in range(20):
        rls.update(np.zeros((100, 2)), np.zeros((100, 1)))
    rls.update(X[:30, :2], X[:30, :2] @ W[:2, :1])
    np.testing.assert_allclose(rls.solve(), W[:2, :1], atol=0.01)


@given(st.floats(0.0, 6.0), st.sampled_from([None, GOAL]))
def test_l1_shrinks_each_row_of_orthogonal_problems_by_half_the_weight(
    gamma: float, goal: Float | None
) -> None:
    Q, _ = np.linalg.qr(X)
    rls = QRDRLS(3, 2, forgetting=1.0, ridge=1e-9, target=goal, l1=gamma)
    rls.update(Q, Q @ W)
    v = W if goal is None else W - goal
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    expected = W - v * np.minimum(gamma / 2 / size, 1.0)
    np.testing.assert_allclose(rls.solve(), expected, atol=1e-8)


def test_weighted_l1_meets_the_conditions_of_its_minimum() -> None:
    weights = np.array([0.0, 2.0, 90.0])
    rls = QRDRLS(3, forgetting=0.98, ridge=0.1, l1=weights)
    rls.update(X[:15], Y[:15, :1])
    rls.update(X[15:], Y[15:, :1])
    found, age = rls.solve()[:, 0], 0.98 ** np.arange(39, -1, -1.0)
    slope = 2 * (X.T @ (age * (X @ found - Y[:, 0])) + 0.1 * found)
    np.testing.assert_allclose(slope[:2], -weights[:2] * np.sign(found[:2]), atol=1e-8)
    assert found[1] != 0.0 == found[2]
    assert abs(slope[2]) < weights[2]
    with pytest.raises(ValueError, match="l1 must be finite, not negative"):
        QRDRLS(3, l1=-1.0)


def test_l1_before_data_is_its_target_and_names_its_shape() -> None:
    with np.errstate(all="raise"):
        np.testing.assert_array_equal(QRDRLS(2, l1=10.0).solve(), np.zeros((2, 1)))
    with pytest.raises(ValueError, match=r"l1 must be one number or have shape \(2,\); got \(3,\)"):
        QRDRLS(2, l1=[1.0, 2.0, 3.0])
