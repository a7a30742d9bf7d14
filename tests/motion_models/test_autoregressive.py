"""Autoregressive sources, and AR models of signals."""

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_lyapunov, solve_toeplitz

from arrivals.motion_models import AutoregressiveSources, select_order, yule_walker
from arrivals.motion_models.autoregressive.companion_form import (
    companion_layout,
    pole_radius,
    stabilised,
)
from arrivals.motion_models.autoregressive.estimation import autocovariance, partial_autocorrelation
from arrivals.typing import Float

RAGGED = AutoregressiveSources([[0.7, -0.4, 0.2], [0.9], [0.3, 0.3]], [0.5, 1.0, 2.0])
SPEECH = RAGGED.replace(real_valued=True)


def ar(coefficients: list[float], n: int, seed: int = 0) -> Float:
    from scipy.signal import lfilter

    noise = np.random.default_rng(seed).standard_normal(n + 500)
    return np.asarray(lfilter([1.0], [1.0, *(-a for a in coefficients)], noise)[500:])


@pytest.mark.parametrize("model", [RAGGED, SPEECH], ids=["complex", "real"])
def test_each_source_follows_its_own_recursion(model: AutoregressiveSources) -> None:
    x = np.random.default_rng(1).standard_normal((4, 5, model.dim_x))
    s, new = model.complex_state(x), model.complex_state(model.f(x))
    for k, first in enumerate(model.layout.first):
        a = model.coefficients[k]
        expected = sum(a[i] * s[..., first + i] for i in range(len(a)))
        np.testing.assert_allclose(new[..., first], expected, atol=1e-14)
        np.testing.assert_array_equal(
            new[..., first + 1 : first + 1 + len(a)], s[..., first : first + len(a)]
        )
    np.testing.assert_array_equal(model.signals(x), s[..., model.layout.first])
    np.testing.assert_allclose(model.f(x), x @ model.F().T, atol=1e-14)


@pytest.mark.parametrize("model", [RAGGED, SPEECH], ids=["complex", "real"])
def test_stationary_covariance_solves_lyapunovs_equation(model: AutoregressiveSources) -> None:
    P = model.stationary_covariance()
    np.testing.assert_allclose(P, solve_discrete_lyapunov(model.F(), model.Q()), atol=1e-12)
    assert model.scaled([1.0, 2.0, 3.0]).power == pytest.approx([1.0, 2.0, 3.0])


def test_samples_have_the_stationary_power() -> None:
    model, rng = RAGGED.scaled(2.0), np.random.default_rng(2)
    x = np.zeros((4000, model.dim_x))
    for _ in range(60):
        x = model.sample(x, rng)
    power = (np.abs(model.signals(x)) ** 2).mean(axis=0)
    np.testing.assert_allclose(power, 2.0, rtol=0.1)  # standard error 1.6 %
    real, imaginary = model.signals(x).real, model.signals(x).imag
    assert abs((real * imaginary).mean(axis=0)).max() < 0.1


def test_model_runs_in_filterpy_kalman_filter() -> None:
    kf = KalmanFilter(SPEECH.dim_x, 1)
    kf.F, kf.Q = SPEECH.F(kf.x), SPEECH.Q()
    kf.x, kf.P = np.ones((SPEECH.dim_x, 1)), SPEECH.stationary_covariance()
    kf.predict()
    np.testing.assert_allclose(kf.P, SPEECH.stationary_covariance(), atol=1e-12)


def test_both_layouts_have_equal_models_up_to_permutation() -> None:
    one, other = companion_layout(RAGGED.orders), companion_layout(RAGGED.orders, lag_by_lag=True)
    F = one.transition(RAGGED.coefficient_matrix)
    G = other.transition(RAGGED.coefficient_matrix)
    np.testing.assert_array_equal(G, F[np.ix_(other.permutation, other.permutation)])
    np.testing.assert_array_equal(other.first, range(3))
    np.testing.assert_array_equal(other.permutation[other.inverse_permutation], range(one.dim))


@given(st.lists(st.floats(-2, 2), min_size=1, max_size=5))
def test_stabilised_models_are_stable_and_stable_ones_unchanged(a: list[float]) -> None:
    coefficients = np.array(a)
    result = stabilised(coefficients)
    # the poles of nearly degenerate companions carry eps^(1/p) of rounding
    assert pole_radius(result) <= 0.995 + 2e-3
    if pole_radius(coefficients) < 0.995:
        np.testing.assert_array_equal(result, coefficients)


def test_models_with_equal_numbers_are_equal_after_copies() -> None:
    same = AutoregressiveSources(([0.7, -0.4, 0.2], [0.9], np.array([0.3, 0.3])), (0.5, 1.0, 2.0))
    assert same == RAGGED
    assert hash(same) == hash(RAGGED)
    assert pickle.loads(pickle.dumps(RAGGED)) == copy.deepcopy(RAGGED) == RAGGED
    assert AutoregressiveSources.from_dict(RAGGED.to_dict()) == RAGGED
    assert AutoregressiveSources([[0.5]] * 2, 2.0).noise == (2.0, 2.0)


WRONG: list[tuple[Callable[[], object], type[Exception], str]] = [
    (lambda: AutoregressiveSources([]), ValueError, "at least one number for each source"),
    (lambda: AutoregressiveSources([[0.5], []]), ValueError, "at least one number"),
    (
        lambda: AutoregressiveSources([[0.5], [1.2]]),
        ValueError,
        r"of source 1 must be stable.*got \[1.2\], unstable with a pole at the radius 1.2",
    ),
    (lambda: AutoregressiveSources([[np.nan]]), ValueError, "of source 0 must be finite"),
    (
        lambda: AutoregressiveSources([[0.5j]]),  # type: ignore[list-item]
        TypeError,
        "real numbers",
    ),
    (lambda: AutoregressiveSources([[0.5]], 0.0), ValueError, "noise must be finite and positive"),
    (
        lambda: AutoregressiveSources([[0.5]], [1.0, 1.0]),
        ValueError,
        "noise must be 1 or 1 numbers",
    ),
    (lambda: RAGGED.F(dt=0.5), ValueError, "dt must be 1, one sample, for .* sources; got 0.5"),
    (lambda: RAGGED.f([1.0]), ValueError, r"shape \(\.\.\., 18\)"),
    (
        lambda: yule_walker([1.0, 2.0], 2),
        ValueError,
        "signal must have more than 2 samples for 2 lags; got 2",
    ),
    (lambda: yule_walker(np.ones(9), 2), ValueError, "signal must vary; got a constant"),
    (lambda: yule_walker([1.0, np.nan, 2.0], 1), ValueError, "finite samples"),
    (lambda: yule_walker(["a"], 1), TypeError, "must hold numbers"),
    (lambda: select_order(np.zeros((2, 9)), 1), ValueError, r"shape \(n_samples,\)"),
]


@pytest.mark.parametrize(("call", "error", "message"), WRONG, ids=[w[2][:25] for w in WRONG])
def test_invalid_input_raises_with_message(
    call: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        call()


# AR models of signals


@pytest.mark.parametrize("order", [1, 2, 5])
def test_yule_walker_solves_its_toeplitz_equations(order: int) -> None:
    signal = np.stack([ar([0.77, -0.45], 300), ar([0.96, -0.77], 300, seed=1)])
    a, q = yule_walker(signal, order)
    c = autocovariance(signal, order)
    for one, own, noise in zip(c, a, q, strict=True):
        expected = solve_toeplitz(one[:order], one[1:])
        np.testing.assert_allclose(own, expected, atol=1e-12)
        assert noise == pytest.approx(one[0] - expected @ one[1:])


def test_yule_walker_estimates_complex_sources() -> None:
    signal = ar([0.96, -0.77], 20_000) + 1j * ar([0.96, -0.77], 20_000, seed=1)
    a, q = yule_walker(signal, 2)
    np.testing.assert_allclose(a, [0.96, -0.77], atol=0.02)
    assert q == pytest.approx(2.0, rel=0.05)


def test_partial_autocorrelation_is_the_last_coefficient_of_each_order() -> None:
    signal = ar([0.77, -0.45, 0.2], 500)
    last = [yule_walker(signal, order)[0][-1] for order in range(1, 7)]
    np.testing.assert_allclose(partial_autocorrelation(signal, 6), last, atol=1e-14)


def test_select_order_of_a_long_signal_is_its_order() -> None:
    assert select_order(ar([0.77, -0.45, 0.2], 5000, seed=3), 3) == 3
    assert select_order(ar([0.9], 5000, seed=3), 1) == 1
