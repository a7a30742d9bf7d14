"""NMSE and SDR of separated signals, and simulated autoregressive signals."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.scenarios import ar_signals, nmse, sdr
from arrivals.scenarios.simulations.ar_signals import stationary_covariance

A, Q = ([0.772, -0.45], [0.96, -0.77]), (0.571, 0.287)


def signals(seed: int = 0) -> Any:
    return ar_signals(A, Q, 400, np.random.default_rng(seed), (3,))


# -- measures ------------------------------------------------------------------------------------


def test_exact_signals_have_no_error_and_zeros_have_unit_error() -> None:
    s = signals()
    np.testing.assert_array_equal(nmse(s, s), np.zeros((3, 2)))
    np.testing.assert_array_equal(nmse(s, 0 * s), np.ones((3, 2)))
    np.testing.assert_array_equal(nmse(s, s, db=True), np.full((3, 2), -np.inf))
    assert (sdr(s, s) > 290).all()
    np.testing.assert_array_equal(sdr(s, 0 * s), np.full((3, 2), -np.inf))


def test_noise_of_known_power_has_its_nmse_and_sdr() -> None:
    s = signals()
    rng = np.random.default_rng(1)
    u = rng.standard_normal((*s.shape, 2)) @ np.array([1, 1j]) * np.sqrt(0.01 / 2)
    np.testing.assert_allclose(nmse(s, s + u, db=True), -20, atol=1.5)
    np.testing.assert_allclose(sdr(s, s + u), 20, atol=1.5)


@given(st.complex_numbers(min_magnitude=1e-3, max_magnitude=1e3, allow_nan=False))
def test_sdr_is_invariant_to_scale_and_phase(factor: complex) -> None:
    s = signals()
    estimate = s + 0.1 * signals(1)
    np.testing.assert_allclose(sdr(s, factor * estimate), sdr(s, estimate), rtol=1e-9)


def test_sdr_is_the_maximum_over_complex_factors() -> None:
    s, estimate = signals()[0, :, :1], (signals() + 0.3 * signals(1))[0, :, :1] * 2j
    turns = np.exp(1j * np.linspace(0, 2 * np.pi, 721))
    alphas = (np.linspace(0.5, 4, 141)[:, None] * turns).ravel()
    errors = [float(np.sum(np.abs(estimate - alpha * s) ** 2)) for alpha in alphas]
    best = alphas[int(np.argmin(errors))]
    direct = 10 * np.log10(np.sum(np.abs(best * s) ** 2) / min(errors))
    assert sdr(s, estimate)[0] == pytest.approx(direct, abs=0.05)


@pytest.mark.parametrize(
    ("truth", "estimate", "error", "message"),
    [
        (np.ones((3, 2)), np.ones((3, 1)), ValueError, "the same shape"),
        (np.ones(3), np.ones(3), ValueError, "n_steps, n_sources"),
        (np.ones((2, 1)), [[np.nan], [1.0]], ValueError, "estimate must be finite"),
        (np.zeros((2, 1)), np.ones((2, 1)), ValueError, "nonzero for every source"),
        ([["a"]], [["a"]], TypeError, "must hold numbers"),
    ],
)
def test_nmse_and_sdr_invalid_signals_are_rejected(
    truth: Any, estimate: Any, error: type[Exception], message: str
) -> None:
    for measure in (nmse, sdr):
        with pytest.raises(error, match=message):
            measure(truth, estimate)


# -- autoregressive signals ----------------------------------------------------------------------


def test_stationary_covariance_is_the_fixed_point_with_unit_power_in_the_paper() -> None:
    for a, q in zip(A, Q, strict=True):
        F, P = np.array([a, [1.0, 0.0]]), stationary_covariance(a, q)
        np.testing.assert_allclose(F @ P @ F.T + np.diag([q, 0.0]), P, atol=1e-12)
        assert P[0, 0] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("complex_valued", [True, False])
def test_ar_signals_are_stationary_from_the_first_step(complex_valued: bool) -> None:
    rng = np.random.default_rng(0)
    s = ar_signals([A[0], [0.9]], [Q[0], 0.19], 4, rng, (40000,), complex_valued=complex_valued)
    assert s.shape == (40000, 4, 2)
    assert np.iscomplexobj(s) == complex_valued
    np.testing.assert_allclose((np.abs(s) ** 2).mean(axis=0), 1.0, atol=0.04)
    lag_one = (s[:, 1:] * s[:, :-1].conj()).mean(axis=0)
    expected = [stationary_covariance(A[0], Q[0])[0, 1], 0.9]
    np.testing.assert_allclose(lag_one, np.tile(expected, (3, 1)), atol=0.04)


def test_ar_signals_obey_their_recursion_and_are_independent() -> None:
    s = ar_signals(A, Q, 30000, np.random.default_rng(2))
    for k, (a, q) in enumerate(zip(A, Q, strict=True)):
        v = s[2:, k] - a[0] * s[1:-1, k] - a[1] * s[:-2, k]
        assert np.mean(np.abs(v) ** 2) == pytest.approx(q, rel=0.04)
        assert abs(np.mean(v[1:] * v[:-1].conj())) < 0.03 * q
        assert abs(np.mean(v**2)) < 0.04 * q  # circular
    assert abs(np.mean(s[:, 0] * s[:, 1].conj())) < 0.04


@pytest.mark.parametrize(
    ("coefficients", "noise", "message"),
    [
        ([[1.2]], [1.0], "modulus 1.2"),
        ([[0.5], [0.5]], [1.0], "for each of 2 sources"),
        ([[0.5]], [-1.0], "not negative"),
        ([[]], [1.0], "finite numbers a_1"),
        ([[np.nan]], [1.0], "finite numbers a_1"),
    ],
)
def test_ar_signals_invalid_process_is_rejected(
    coefficients: Any, noise: Any, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        ar_signals(coefficients, noise, 10, np.random.default_rng(0))
