"""Moments of one angle, against a dense sum over the circle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.motion_models.bessel import bessel_ratios
from arrivals.trackers.svalse.coordinate import angle_posterior as ap
from arrivals.typing import Complex


def dense(c: Complex, n: int = 1 << 17) -> Complex:
    theta = 2 * np.pi * np.arange(n) / n
    log_q = sum(((c[i] * np.exp(1j * i * theta)).real for i in range(1, len(c))), np.zeros(n))
    q = np.exp(log_q - log_q.max())
    moments = np.array([(q * np.exp(1j * i * theta)).sum() for i in range(len(c))])
    return np.asarray(moments / q.sum())


def coefficients(seed: int, degree: int, size: float) -> Complex:
    rng = np.random.default_rng(seed)
    return np.asarray(size * (rng.standard_normal((degree + 1, 2)) @ np.array([1, 1j])))


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6), st.integers(1, 20), st.floats(-3, 4))
def test_quadrature_of_any_sharpness_agrees_with_a_dense_sum(
    seed: int, degree: int, log10: float
) -> None:
    c = coefficients(seed, degree, 10**log10)
    moments, mean = ap.quadrature(c)
    np.testing.assert_allclose(moments, dense(c), rtol=0, atol=1e-9)
    assert mean == moments[1]


def test_window_moments_agree_with_grid_moments() -> None:
    integrated = 0
    for seed in range(200):
        c = coefficients(seed, 12, 30.0)
        moments = ap.window_moments(c)
        if moments is not None:
            integrated += 1
            np.testing.assert_allclose(moments, ap.grid_moments(c, 4096), rtol=0, atol=1e-9)
    assert integrated > 150


def test_quadrature_of_a_density_too_sharp_for_a_grid_uses_windows() -> None:
    c = 1e12 * np.exp(-1j * 0.7 * np.arange(9))
    moments, _ = ap.quadrature(c)
    np.testing.assert_allclose(np.angle(moments[1]), 0.7, rtol=0, atol=1e-9)
    assert 1 - abs(moments[1]) < 1e-12


@given(st.floats(-3.1, 3.1), st.floats(0.0, 1e5))
@settings(deadline=None, max_examples=50)
def test_every_posterior_keeps_the_moments_of_a_von_mises_density(mu: float, kappa: float) -> None:
    c = np.array([0, kappa * np.exp(-1j * mu), 0, 0])
    exact = bessel_ratios(3, kappa) * np.exp(1j * mu * np.arange(4))
    for posterior in (ap.quadrature, ap.mixture, ap.top_mode):
        np.testing.assert_allclose(posterior(c)[0], exact, rtol=0, atol=1e-9)
    if kappa > 100:  # its concentration is that of the Gaussian limit
        np.testing.assert_allclose(ap.nearest_modes(c)[0], exact, rtol=0, atol=1e-2)


def test_mixture_approximates_quadrature() -> None:
    """Each factor is replaced by a mixture: the moments agree to 1e-3."""
    theta = 0.8
    c = 40 * np.exp(-1j * theta * np.arange(15))
    exact, heuristic = ap.quadrature(c)[0], ap.mixture(c)[0]
    assert np.angle(heuristic[1]) == pytest.approx(np.angle(exact[1]), abs=1e-3)
    assert abs(heuristic[1]) == pytest.approx(abs(exact[1]), abs=1e-3)
    np.testing.assert_allclose(ap.mixture(c, descending=True)[0], heuristic, atol=1e-2)


def test_mixture_across_pi_has_the_concentration_of_the_turned_density() -> None:
    """(47) as printed takes linear moments, which are wrong for a density that contains ±π."""
    c = 5 * np.exp(-1j * np.pi * np.arange(6))
    turned = 5 * np.exp(-1j * 0.3 * np.arange(6))
    assert abs(ap.mixture(c)[1]) == pytest.approx(abs(ap.mixture(turned)[1]), rel=1e-9)


@pytest.mark.parametrize("posterior", [ap.top_mode, ap.nearest_modes, ap.mixture, ap.quadrature])
def test_zero_coefficients_give_the_uniform_density(posterior: ap.AnglePosterior) -> None:
    moments, mean = posterior(np.zeros(5, dtype=complex))
    np.testing.assert_allclose(np.abs(moments), [1, 0, 0, 0, 0], atol=1e-12)
    assert abs(mean) < 1e-6


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=30)
def test_fold_keeps_the_exponent_and_unfold_the_moments(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k = rng.permutation(np.arange(-6, 5))[:7]
    eta = coefficients(seed, 6, 1.0)
    c = ap.fold(eta, k, 6)
    theta = 1.234
    exponent = np.vdot(eta, np.exp(1j * k * theta)).real
    assert (c @ np.exp(1j * np.arange(7) * theta)).real == pytest.approx(exponent)
    d = np.exp(1j * np.arange(7) * theta)
    np.testing.assert_allclose(ap.unfold(d, k), np.exp(1j * k * theta))


@pytest.mark.parametrize("degree", [20, 150])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_quadrature_of_one_high_harmonic_agrees_with_a_dense_sum(degree: int, size: float) -> None:
    c = np.zeros(degree + 1, dtype=complex)
    c[degree] = size
    moments, _ = ap.quadrature(c)
    np.testing.assert_allclose(moments, dense(c), atol=1e-9)
