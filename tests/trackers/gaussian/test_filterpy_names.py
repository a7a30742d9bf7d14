"""Public names of filterpy's filters: the same numbers, or a sentence with what to use."""

from typing import Any

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter
from filterpy_table import DIFFERENCES, PAGE, pairs, public_names, table
from filterpy_twins import BEARING, P, X, assert_twins, plain, twins

from arrivals.trackers import EKF, UKF

SEEDS = range(6)
ZS = np.random.default_rng(7).normal(size=(5, 2, 1))


def test_table_of_names_is_up_to_date() -> None:
    """If it is not: python tests/helpers/filterpy_table.py."""
    assert table() in PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("pair", pairs(), ids=lambda pair: type(pair[1]).__name__)
def test_every_name_exists_or_raises_with_a_sentence(pair: tuple[Any, Any]) -> None:
    theirs, ours = pair
    for name in public_names(theirs):
        if hasattr(ours, name):
            assert callable(getattr(ours, name)) == callable(getattr(theirs, name)), name
            continue
        for use in (lambda n=name: getattr(ours, n), lambda n=name: setattr(ours, n, 1.0)):
            with pytest.raises(AttributeError, match=f"{name}.* of filterpy: .{{20,}}"):
                use()


def test_differences_are_of_names_that_exist() -> None:
    names = {(type(a).__name__, name) for a, _ in pairs() for name in public_names(a)}
    assert set(DIFFERENCES) <= names


def filtered(seed: int) -> tuple[Any, Any]:
    """Return our filter and filterpy's after some steps, with columns."""
    ours, theirs = twins(seed, n=2 + seed % 3, column=True)
    for z in ZS:
        for f in (ours, theirs):
            f.predict()
            f.update(z)
    return ours, theirs


def assert_same(ours: Any, theirs: Any) -> None:
    for a, b in zip(ours, theirs, strict=True):
        assert np.shape(a) == np.shape(b)
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_questions_have_the_same_answers_and_change_nothing(seed: int) -> None:
    ours, theirs = filtered(seed)
    x, z = ours.x, ZS[0] + 1
    for f in (ours, theirs):
        f.alpha = 1.0 + seed / 10
    assert_same(ours.get_update(z), theirs.get_update(z))
    assert_same(ours.get_update(None), theirs.get_update(None))
    assert_same(ours.get_prediction(), theirs.get_prediction())
    step = {"u": np.array([[1.0]]), "F": 0.5 * theirs.F, "Q": 2.0, "B": 3 * theirs.B}
    assert_same(ours.get_prediction(**step), theirs.get_prediction(**step))
    assert_same([ours.residual_of(z)], [theirs.residual_of(z)])
    assert_same([ours.measurement_of_state(x)], [theirs.measurement_of_state(x)])
    assert_same([ours.log_likelihood_of(z)], [theirs.log_likelihood_of(z)])
    assert ours.log_likelihood_of(None) == 0.0
    assert ours.x is x


@pytest.mark.parametrize("seed", SEEDS)
def test_fading_memory_equals_filterpy(seed: int) -> None:
    ours, theirs = twins(seed)
    for f in (ours, theirs):
        f.alpha = 1.02 + seed / 20
        for z in ZS[..., 0]:
            f.predict()
            f.update(z)
    assert_twins(ours, theirs, names="x P alpha log_likelihood")
    runs = ours.run_batch([ZS[..., 0]])
    np.testing.assert_allclose(runs[0].x, ours.run(ZS[..., 0]).x, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_steady_state_equals_filterpy(seed: int) -> None:
    ours, theirs = filtered(seed)
    for z in [*ZS, None]:
        for f in (ours, theirs):
            f.predict_steadystate(np.array([[0.5]]))
            f.update_steadystate(z)
        assert_twins(ours, theirs, names="x P x_prior P_prior x_post P_post K y S")
        if z is not None:
            assert_twins(ours, theirs, 1e-10, names="log_likelihood mahalanobis")


def test_assigned_gain_is_used_before_any_update() -> None:
    ours, theirs = twins(0, column=True)
    for f in (ours, theirs):
        f.K = 0.1 * np.ones((3, 2))
        f.update_steadystate(ZS[0])
    assert_twins(ours, theirs)
    assert np.isfinite(ours.log_likelihood)


@pytest.mark.parametrize("seed", SEEDS)
def test_correlated_update_equals_filterpy(seed: int) -> None:
    ours, theirs = filtered(seed)
    for f in (ours, theirs):
        f.M = 0.1 * np.linalg.cholesky(theirs.P)[:, :2] @ np.linalg.cholesky(theirs.R).T
        f.update_correlated(ZS[1])
    assert_twins(ours, theirs, 1e-11, names="x P K S SI y log_likelihood")
    ours.update_correlated(None)
    assert_twins(ours, theirs, 1e-11)


def test_correlated_update_leaves_out_missing_entries() -> None:
    ours, other = twins(1)[0], twins(1)[0]
    ours.M = other.M = 0.2 * np.ones((3, 2))
    ours.update_correlated([np.nan, 1.0])
    R, H = other.R, other.H
    other.M = other.M[:, 1:]
    other.update_correlated([1.0], R=R[1:, 1:], H=H[1:])
    assert_twins(ours, other)
    assert ours.log_likelihood == pytest.approx(other.log_likelihood)


def test_impossible_correlation_raises_and_changes_nothing() -> None:
    ours, _ = twins(1)
    ours.M = 1e3 * np.ones((3, 2))
    P0 = ours.P
    with pytest.raises(ValueError, match=r"M must be a correlation|positive semidefinite"):
        ours.update_correlated([1.0, 2.0])
    assert ours.P is P0


@pytest.mark.parametrize("seed", SEEDS)
def test_sequential_update_equals_filterpy_and_the_whole_update(seed: int) -> None:
    ours, theirs = filtered(seed)
    for f in (ours, theirs):
        f.R = np.diag([0.5, 2.0 + seed])
    whole = ours.get_update(ZS[3])
    for f in (ours, theirs):
        f.update_sequential(0, ZS[3][:1])
        f.update_sequential(1, float(ZS[3][1, 0]))
    assert_twins(ours, theirs, 1e-11, names="x P K y z")
    np.testing.assert_allclose(ours.x, whole[0], atol=1e-10)
    np.testing.assert_allclose(ours.P, whole[1], atol=1e-10)


def test_sequential_update_warns_of_correlated_noise_and_refuses_entries_beyond_the_end() -> None:
    ours, _ = twins(2)
    with pytest.warns(UserWarning, match="R couples entries of z"):
        ours.update_sequential(0, 1.0)
    ours.update_sequential(1, [1.0], R_i=2.0, H_i=[[1.0, 0.0, 0.0]])
    x = ours.x
    ours.update_sequential(0, None, R_i=1.0)
    np.testing.assert_array_equal(ours.x, x)
    with pytest.raises(ValueError, match="start must be at most 0 for 2 entries of 2; got 1"):
        ours.update_sequential(1, [1.0, 2.0])


def test_dimensions_are_checked_with_value_errors() -> None:
    ours: Any = plain()
    ours.test_matrix_dimensions()
    ours.test_matrix_dimensions(z=[1.0, 2.0], H=np.eye(2, 4), R=np.eye(2), F=np.eye(4), Q=np.eye(4))
    for bad in ({"z": [1.0]}, {"H": np.eye(3)}, {"R": np.eye(4)}, {"F": np.eye(2)}, {"Q": [1.0]}):
        with pytest.raises(ValueError, match="must have shape"):
            ours.test_matrix_dimensions(**bad)


@pytest.mark.parametrize("bad", [0.99, 1e308, np.inf, np.nan])
def test_fading_factor_is_at_least_one(bad: float) -> None:
    tracker: Any = plain()
    with pytest.raises(ValueError, match="alpha must be from 1 to 1e"):
        tracker.alpha = bad
    with pytest.raises(TypeError, match="alpha must be a number"):
        tracker.alpha = "much"


# The extended filter with functions


def both() -> tuple[EKF, Any]:
    theirs = ExtendedKalmanFilter(4, 3)
    walk = plain().motion
    theirs.x, theirs.P, theirs.F, theirs.Q, theirs.R = X, P, walk.F(X), walk.Q(), BEARING.R
    return EKF(walk, BEARING, X, P), theirs


def stretched_H(x: Any, a: float) -> Any:
    return a * BEARING.H(x)


def stretched_h(x: Any, a: float, b: float) -> Any:
    return BEARING.h(x) * a + b


CALLS: list[Any] = [
    lambda f, z: f.update(z, BEARING.H, BEARING.h, residual=BEARING.residual),
    lambda f, z: f.update(z, BEARING.H, BEARING.h, 0.5),
    lambda f, z: f.update(z, HJacobian=BEARING.H, Hx=BEARING.h, R=2 * BEARING.R),
    lambda f, z: f.update(z, BEARING.H, BEARING.h, R=2 * BEARING.R),
    lambda f, z: f.update(z, stretched_H, stretched_h, None, 1.1, (1.1, 0.2)),
    lambda f, z: f.predict_update(z, BEARING.H, BEARING.h),
    lambda f, z: f.predict_x(),
]


@pytest.mark.parametrize("call", CALLS)
def test_ekf_by_functions_equals_filterpy(call: Any) -> None:
    ours, theirs = both()
    for k in range(4):
        z = BEARING.h(X + 0.1 * k) + 0.01
        for f in (ours, theirs):
            f.predict()
            call(f, z)
        assert_twins(ours, theirs)


def test_ekf_by_functions_takes_missing_entries_and_other_sizes() -> None:
    ours, other = both()[0], both()[0]
    z = BEARING.h(X) + 0.1
    ours.update([z[0], np.nan, z[2]], BEARING.H, BEARING.h, residual=BEARING.residual)
    other.update([z[0], np.nan, z[2]])
    assert_twins(ours, other)
    ours.update(None, BEARING.H, BEARING.h)
    assert_twins(ours, other)
    ours.update([1.0], lambda x: np.eye(1, 4), lambda x: x[:1], R=0.1)
    assert ours.S.shape == (1, 1)
    incomplete: list[Any] = [[BEARING.H], [BEARING.H, np.copy]]
    for functions in incomplete:
        with pytest.raises((TypeError, ValueError), match="Hx"):
            ours.update(z, *functions)


def test_ukf_refuses_positions_that_mean_something_else_in_filterpy() -> None:
    tracker = plain(kind=UKF)
    with pytest.raises(TypeError, match="arguments must be passed by name, batch_filter"):
        tracker.batch_filter(ZS[..., 0], [np.eye(2)] * 5)
    xs, Ps, *_ = tracker.batch_filter(ZS[..., 0], Rs=[np.eye(2)] * 5)
    with pytest.raises(TypeError, match="arguments must be passed by name, rts_smoother"):
        tracker.rts_smoother(xs, Ps, [np.eye(4)] * 5)
