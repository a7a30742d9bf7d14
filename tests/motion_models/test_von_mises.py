"""Von Mises kernels against scipy and exact fractions, and the von Mises walk."""

import subprocess
import sys
from decimal import Decimal, localcontext

import numpy as np
import pytest
import scipy.special
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from arrivals.motion_models.bessel import (
    bessel_ratio,
    bessel_ratios,
    inverse_bessel_ratio,
    log_bessel_ratio,
    log_i0,
)
from arrivals.motion_models.von_mises import (
    VonMisesWalk,
    log_density,
    mfold_concentration,
    mfold_modes,
    product,
    wrap,
)
from arrivals.typing import Float

angles = st.floats(-np.pi, np.pi)
concentrations = st.floats(1e-3, 1e6)

KAPPAS = [1e-9, 0.01, 0.7, 1.3, 8.0, 90.0, 249.0, 251.0, 499.9, 500.1, 3e3, 1e6, 1e8]


def exact_ratios(kappa: float, n: int) -> list[Decimal]:
    """Return I_m/I_{m-1}, m = 1..n, to 40 digits by the continued fraction."""
    with localcontext(prec=45):
        k, order = Decimal(kappa), n + int(11 * kappa**0.5) + 60
        ratio, result = Decimal(1), []
        for m in range(order, 0, -1):
            ratio = k / (2 * m + k * ratio)
            result.append(ratio)
        return result[: -n - 1 : -1]


EXACT = {kappa: exact_ratios(kappa, 1)[0] for kappa in KAPPAS}


def test_scipy_is_not_imported_with_the_models() -> None:
    code = "import sys, arrivals.motion_models; sys.exit('scipy.special' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


# angles


@given(st.floats(-1e6, 1e6))
def test_wrap_keeps_the_direction(angle: float) -> None:
    assert -np.pi <= wrap(angle) < np.pi
    assert np.exp(1j * wrap(angle)) == pytest.approx(np.exp(1j * angle), abs=1e-9)


@given(angles.filter(lambda angle: angle < np.pi))
def test_wrap_of_wrapped_angles_is_exact(angle: float) -> None:
    assert wrap(angle) == angle


def test_wrap_at_the_seam() -> None:
    below, above = np.nextafter(np.pi, 0), np.nextafter(-np.pi, -4)
    assert wrap([np.pi, -np.pi, below, 3 * np.pi]).tolist() == [-np.pi, -np.pi, below, -np.pi]
    assert 3.14 < wrap(above) < np.pi
    assert np.isnan(wrap([np.inf, -np.inf, np.nan])).all()


# Bessel functions


@given(st.floats(0, 600))
def test_log_i0_equals_the_logarithm_of_i0(kappa: float) -> None:
    expected = np.log(scipy.special.i0(kappa))
    assert log_i0(kappa) == pytest.approx(expected, rel=1e-13, abs=1e-14)


def test_log_i0_is_finite_where_i0_overflows() -> None:
    assert log_i0(1e8) == pytest.approx(1e8 - np.log(2 * np.pi * 1e8) / 2, rel=1e-15)
    assert log_i0([1e308, np.inf]).tolist() == [1e308, np.inf]


@pytest.mark.parametrize("kappa", KAPPAS)
def test_bessel_ratio_is_exact_to_a_few_bits(kappa: float) -> None:
    with localcontext(prec=45):
        error = float(Decimal(float(bessel_ratio(kappa))) - EXACT[kappa])
    assert abs(error) < (1.5e-15 * float(EXACT[kappa]) if kappa < 500 else 1.2e-16)


@pytest.mark.parametrize("kappa", KAPPAS)
def test_log_bessel_ratio_keeps_its_digits_near_zero(kappa: float) -> None:
    expected = float(EXACT[kappa].ln())
    assert log_bessel_ratio(kappa) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("kappa", KAPPAS)
def test_inverse_bessel_ratio_has_the_error_of_rounding_only(kappa: float) -> None:
    # Half a unit in the last place of R moves κ by 1.1e-16 κ, relative.
    result = inverse_bessel_ratio(float(EXACT[kappa]))
    assert result == pytest.approx(kappa, rel=1e-12 + 1.2e-16 * kappa)


@given(st.floats(0, 1))
def test_inverse_bessel_ratio_inverts(ratio: float) -> None:
    assert bessel_ratio(inverse_bessel_ratio(ratio)) == pytest.approx(ratio, rel=2e-15, abs=1e-300)


def test_bessel_ratio_and_its_inverse_at_zero_and_infinity() -> None:
    assert bessel_ratio([0.0, 1e300, np.inf]).tolist() == [0.0, 1.0, 1.0]
    assert log_bessel_ratio([0.0, np.inf]).tolist() == [-np.inf, 0.0]
    assert inverse_bessel_ratio([0.0, 1.0]).tolist() == [0.0, np.inf]
    assert np.isnan(bessel_ratio(np.nan))


def test_bessel_ratio_is_continuous_at_the_change_of_expansion() -> None:
    ratio = 0.998 + np.linspace(-1e-9, 1e-9, 41)
    assert np.ptp(np.diff(inverse_bessel_ratio(ratio))) < 1e-8 * 250
    kappa = 500 + np.linspace(-1e-4, 1e-4, 41)
    assert np.ptp(np.diff(log_bessel_ratio(kappa))) < 2e-15


@pytest.mark.parametrize("ratio", [-0.1, 1.1, np.nan, [0.5, 1 + 1e-15]])
def test_resultant_above_one_is_refused(ratio: float) -> None:
    with pytest.raises(ValueError, match=r"a mean resultant length must lie in \[0, 1\]; got"):
        inverse_bessel_ratio(ratio)


@given(st.floats(1e-2, 1e5), st.integers(0, 40))
def test_bessel_ratios_equal_scipy(kappa: float, n: int) -> None:
    scaled = scipy.special.ive(np.arange(n + 1), kappa)
    np.testing.assert_allclose(bessel_ratios(n, kappa), scaled / scaled[0], rtol=2e-12)


@pytest.mark.parametrize("kappa", [1e-9, 30.0, 1e4, 1e8])
def test_bessel_ratios_are_exact_at_any_concentration(kappa: float) -> None:
    expected = np.cumprod([float(ratio) for ratio in exact_ratios(kappa, 14)])
    np.testing.assert_allclose(bessel_ratios(14, kappa)[1:], expected, rtol=1e-12)


def test_bessel_ratios_at_zero_and_infinity() -> None:
    assert bessel_ratios(2, [0.0, 1e-200, 1e308, np.inf]).tolist() == [
        [1, 0, 0],
        [1, 5e-201, 0],
        [1, 1, 1],
        [1, 1, 1],
    ]
    assert bessel_ratios(0, 3.0).tolist() == [1.0]
    with pytest.raises(ValueError, match="n must be at least 0; got -1"):
        bessel_ratios(-1, 3.0)


def test_kernels_are_elementwise() -> None:
    kappa = np.array([[0.0, 3.0, 600.0], [40.0, 1e6, 2.0]])
    ratio = bessel_ratio(kappa)
    assert bessel_ratios(7, kappa).shape == (2, 3, 8)
    for i in np.ndindex(kappa.shape):
        assert bessel_ratio(kappa[i]) == ratio[i]
        assert log_bessel_ratio(kappa[i]) == log_bessel_ratio(kappa)[i]
        assert inverse_bessel_ratio(ratio[i]) == inverse_bessel_ratio(ratio)[i]
        np.testing.assert_array_equal(bessel_ratios(7, kappa[i]), bessel_ratios(7, kappa)[i])


# densities


@given(angles, angles, concentrations)
def test_log_density_equals_scipy(theta: float, mu: float, kappa: float) -> None:
    expected = scipy.stats.vonmises(kappa, loc=mu).logpdf(theta)
    assert log_density(theta, mu, kappa) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(angles, concentrations, angles, concentrations)
def test_product_adds_the_log_densities(mu1: float, k1: float, mu2: float, k2: float) -> None:
    theta = np.linspace(-3, 3, 7)
    mu, kappa = product(mu1, k1, mu2, k2)
    both = log_density(theta, mu1, k1) + log_density(theta, mu2, k2)
    assert np.ptp(both - log_density(theta, mu, kappa)) < 1e-14 * (k1 + k2) + 1e-13
    assert -np.pi <= mu < np.pi


@pytest.mark.parametrize("kernel", [lambda k: log_density(0, 0, k), log_bessel_ratio])
def test_negative_concentrations_are_refused(kernel) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match="kappa must not be negative; got"):
        kernel([1.0, -2.0])


@given(st.floats(1e-2, 1e8), st.integers(1, 30))
def test_mfold_concentration_is_the_root_of_the_resultant(kappa: float, m: int) -> None:
    narrow = mfold_concentration(kappa, m)
    assert m**2 * log_bessel_ratio(narrow) == pytest.approx(log_bessel_ratio(kappa), rel=1e-11)


def test_mfold_concentration_at_zero_and_infinity() -> None:
    assert mfold_concentration([0.0, 1e8, np.inf], 14)[[0, 2]].tolist() == [0.0, np.inf]
    # ln A = -1/2κ - 1/4κ² - ..., so m²κ is approached from below by (m² - 1)/2.
    assert mfold_concentration(1e8, 14) - 196e8 == pytest.approx(-195 / 2, rel=1e-2)
    with pytest.raises(ValueError, match="m must be at least 1; got 0"):
        mfold_concentration(1.0, 0)


@given(st.floats(0.5, 1e4), angles, st.integers(1, 12))
def test_mixture_of_modes_has_only_harmonics_of_m(kappa: float, mu: float, m: int) -> None:
    modes = mfold_modes([kappa * np.exp(1j * mu)], m)[0]
    assert modes.shape == (m,)
    np.testing.assert_allclose(np.exp(1j * m * np.angle(modes)), np.exp(1j * mu), atol=1e-12)
    orders = np.arange(1, m)
    moments = bessel_ratios(m, np.abs(modes[0]))[orders] * np.exp(
        1j * np.outer(np.angle(modes), orders)
    )
    np.testing.assert_allclose(moments.mean(axis=0), 0, atol=1e-12)


def test_mixture_of_modes_approximates_the_mfold_density() -> None:
    theta = np.linspace(-np.pi, np.pi, 2000, endpoint=False)
    eta = 60.0 * np.exp(0.8j)
    modes = mfold_modes(eta, 3)
    expected = np.exp(log_density(3 * theta, 0.8, 60.0))
    mixture = np.exp(log_density(theta[:, None], np.angle(modes), np.abs(modes))).mean(axis=1)
    assert abs(mixture - expected).max() < 0.01 * expected.max()
    assert (mfold_modes(0.0, 3) == 0).all()


# the walk


def test_variance_of_the_walk_is_that_of_the_wrapped_normal_step() -> None:
    assert VonMisesWalk(kappa=100.0).Q().round(4) == 0.0101
    assert VonMisesWalk(kappa=1e12).Q(dt=3.0)[0, 0] == pytest.approx(3e-12, rel=1e-11)
    variance = VonMisesWalk(kappa=2.0).Q(dt=0.5)[0, 0]
    assert np.exp(-variance) == pytest.approx(scipy.special.iv(1, 2) / scipy.special.iv(0, 2))


@given(st.floats(1e-2, 1e3), st.floats(1e-2, 1e3))
def test_blur_is_symmetric_and_loses_concentration(a: float, b: float) -> None:
    assert VonMisesWalk(a).blur(b) == pytest.approx(VonMisesWalk(b).blur(a), rel=1e-6)
    assert VonMisesWalk(a).blur(b) < min(a, b)


@given(concentrations, concentrations, st.floats(0.01, 10), st.floats(0.01, 10))
def test_blur_of_two_steps_equals_that_of_one(
    step: float, kappa: float, a: float, b: float
) -> None:
    walk = VonMisesWalk(step)
    assert walk.blur(walk.blur(kappa, a), b) == pytest.approx(walk.blur(kappa, a + b), rel=1e-9)


def test_blur_keeps_the_first_moment_of_the_convolution() -> None:
    n = 512
    theta = 2 * np.pi * np.arange(n) / n
    density, step = (scipy.stats.vonmises(kappa).pdf(theta) for kappa in (7.0, 3.0))
    convolved = np.fft.irfft(np.fft.rfft(density) * np.fft.rfft(step), n) * 2 * np.pi / n
    resultant = (convolved * np.cos(theta)).mean() * 2 * np.pi
    blurred = VonMisesWalk(3.0).blur(7.0)
    assert scipy.special.i1e(blurred) / scipy.special.i0e(blurred) == pytest.approx(resultant)


def test_blur_at_zero_and_infinity() -> None:
    walk = VonMisesWalk(5.0)
    np.testing.assert_allclose(walk.blur([0.0, np.inf]), [0.0, 5.0], rtol=1e-13)
    np.testing.assert_allclose(walk.blur([0.0, 3.0, np.inf], dt=0), [0.0, 3.0, np.inf], rtol=1e-13)
    assert walk.blur(np.ones((4, 3))).shape == (4, 3)
    with pytest.raises(ValueError, match="kappa must not be negative"):
        walk.blur([-1.0])


@pytest.mark.parametrize("method", ["Q", "blur", "sample"])
def test_negative_duration_is_refused(method: str) -> None:
    rng = np.random.default_rng(0)
    call = {"Q": (), "blur": (1.0,), "sample": ([0.0], rng)}[method]
    with pytest.raises(ValueError, match=r"dt must be finite and not negative; got -0\.5"):
        getattr(VonMisesWalk(5.0), method)(*call, dt=-0.5)


def drawn(kappa: float, dt: float, n: int = 20_000) -> Float:
    return VonMisesWalk(kappa).sample(np.full((n, 1), 3.0), np.random.default_rng(1), dt)


def test_steps_are_von_mises_and_wrapped() -> None:
    x = drawn(4.0, dt=1.0)
    assert x.shape == (20_000, 1)
    assert -np.pi <= x.min() < -3.0
    assert 3.0 < x.max() < np.pi
    test = scipy.stats.kstest(wrap(x - 3.0).ravel(), scipy.stats.vonmises(4.0).cdf)
    assert test.pvalue > 1e-3


@pytest.mark.parametrize("dt", [0.3, 2.0])
def test_resultant_of_the_steps_is_a_power_of_the_duration(dt: float) -> None:
    resultant = np.cos(drawn(4.0, dt) - 3.0).mean()
    assert resultant == pytest.approx(bessel_ratio(4.0) ** dt, abs=0.02)  # 5 standard errors


def test_sample_of_zero_duration_is_the_identity() -> None:
    assert (drawn(4.0, dt=0.0, n=5) == 3.0).all()


@pytest.mark.parametrize("kappa", [0.0, -3, np.nan, np.inf])
def test_concentration_of_a_walk_is_positive(kappa: float) -> None:
    with pytest.raises(ValueError, match="kappa must be finite and positive; got"):
        VonMisesWalk(kappa)


def test_walk_wraps_its_states() -> None:
    np.testing.assert_allclose(VonMisesWalk(1.0).f([[4.0], [1.0]]), [[4.0 - 2 * np.pi], [1.0]])


# a walk in direction


def test_sigma_doa_has_equal_width_at_all_directions() -> None:
    """σ_θ = σ_β dθ/dβ: the concentration of the step is of each component."""
    walk, slope = VonMisesWalk(sigma_doa=0.02), np.array([3.0, 1.0, 0.3])
    np.testing.assert_allclose(walk.step_concentration(slope), (0.02 * slope) ** -2.0)
    widened = walk.blur([np.inf] * 3, slope=slope)
    np.testing.assert_allclose(1 / np.sqrt(widened) / slope, 0.02, rtol=1e-3)
    twice = walk.blur(walk.blur([50.0, 500.0, 5000.0], slope=slope), slope=slope)
    once = walk.blur([50.0, 500.0, 5000.0], dt=2.0, slope=slope)
    np.testing.assert_allclose(once, twice, rtol=1e-9)


def test_kappa_of_the_walk_does_not_depend_on_the_slope() -> None:
    walk = VonMisesWalk(50.0)
    np.testing.assert_array_equal(walk.blur([1.0, 100.0], slope=7.0), walk.blur([1.0, 100.0]))
    np.testing.assert_allclose(VonMisesWalk(sigma_doa=0.1).Q(), VonMisesWalk(100.0).Q())


@pytest.mark.parametrize("params", [{}, {"kappa": 3.0, "sigma_doa": 0.1}])
def test_walk_requires_one_of_kappa_and_sigma_doa(params: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="exactly one of kappa and sigma_doa must be given"):
        VonMisesWalk(**params)


@pytest.mark.parametrize("params", [{"sigma_doa": 0.0}, {"sigma_doa": -1.0}, {"kappa": np.inf}])
def test_walk_width_must_be_positive(params: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be finite and positive"):
        VonMisesWalk(**params)
