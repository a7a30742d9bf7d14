"""The Langevin function and its inverse against exact fractions, and the walk on the sphere."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import LinearMeasurement
from arrivals.measurement_models.arrays.sphere import great_circle, unit_vectors
from arrivals.motion_models import VonMisesFisherWalk
from arrivals.motion_models.von_mises_fisher import inverse_langevin, langevin, log_langevin
from arrivals.trackers import EKF, UKF
from arrivals.typing import Float

concentrations = st.floats(1e-6, 1e8)
SLANTED = np.array([0.36, 0.48, 0.8])


def exact(kappa: float) -> tuple[float, float]:
    """Return A₃(κ) and ln A₃(κ) from 80 digits."""
    with localcontext(prec=80):
        k = Decimal(kappa)
        coth = 1 + 2 / ((2 * k).exp() - 1) if kappa < 1000 else Decimal(1)
        return float(coth - 1 / k), float((coth - 1 / k).ln())


def directions(walk: VonMisesFisherWalk, x: Float, dt: float = 1.0, n: int = 40_000) -> Float:
    return walk.sample(np.tile(x, (n, 1)), np.random.default_rng(1), dt)


@given(concentrations)
def test_langevin_function_and_its_inverse_are_exact_to_a_few_bits(kappa: float) -> None:
    ratio, log_ratio = exact(kappa)
    assert langevin(kappa) == pytest.approx(ratio, rel=7e-16)
    assert log_langevin(kappa) == pytest.approx(log_ratio, rel=7e-16)
    assert inverse_langevin(log_ratio) == pytest.approx(kappa, rel=1e-14)


def test_langevin_function_at_zero_and_infinity() -> None:
    assert langevin([0.0, 1e300, np.inf]).tolist() == [0.0, 1.0, 1.0]
    assert inverse_langevin([-np.inf, 0.0]).tolist() == [0.0, np.inf]
    with pytest.raises(ValueError, match="kappa must not be negative; got"):
        log_langevin([1.0, -2.0])


@given(concentrations, concentrations)
def test_blur_multiplies_mean_resultants(a: float, b: float) -> None:
    blurred = VonMisesFisherWalk(a).blur(b)
    assert log_langevin(blurred) == pytest.approx(log_langevin(a) + log_langevin(b), rel=1e-13)
    assert blurred == pytest.approx(VonMisesFisherWalk(b).blur(a), rel=1e-12)


@given(st.floats(1e3, 1e8), st.floats(1e3, 1e8))
def test_blur_of_narrow_densities_adds_variances(a: float, b: float) -> None:
    # A₃ = 1 - 1/κ there: 1/κ' = 1/κ + 1/κ_r - 1/(κ κ_r)
    assert 1 / VonMisesFisherWalk(a).blur(b) == pytest.approx(1 / a + 1 / b, rel=1 / min(a, b))


@given(concentrations, concentrations, st.floats(0.01, 10), st.floats(0.01, 10))
def test_blur_of_two_steps_equals_that_of_one(
    step: float, kappa: float, a: float, b: float
) -> None:
    walk = VonMisesFisherWalk(step)
    assert walk.blur(walk.blur(kappa, a), b) == pytest.approx(walk.blur(kappa, a + b), rel=1e-9)
    np.testing.assert_allclose(walk.Q(a) + walk.Q(b), walk.Q(a + b), rtol=1e-12)


def test_blur_at_zero_and_infinity() -> None:
    walk = VonMisesFisherWalk(5.0)
    np.testing.assert_allclose(walk.blur([0.0, np.inf]), [0.0, 5.0], rtol=1e-13)
    np.testing.assert_allclose(walk.blur([0.0, 3.0, np.inf], dt=0), [0.0, 3.0, np.inf], rtol=1e-13)


@pytest.mark.parametrize(("kappa", "dt"), [(1e-3, 1.0), (2.0, 0.5), (50.0, 1.0), (1e6, 3.0)])
def test_samples_have_the_mean_resultant_of_the_step(kappa: float, dt: float) -> None:
    n = directions(VonMisesFisherWalk(kappa), SLANTED, dt)
    np.testing.assert_allclose(np.linalg.norm(n, axis=1), 1, atol=1e-12)
    length = exact(kappa)[0] ** dt
    spread = np.sqrt((1 - length**2) / len(n))
    np.testing.assert_allclose(n.mean(axis=0), length * SLANTED, atol=5 * spread)


def test_samples_have_the_density_of_the_step() -> None:
    # p(cos θ) ∝ exp(κ cos θ), the turn about the direction uniform
    n = directions(VonMisesFisherWalk(4.0), SLANTED)
    along, kappa = n @ SLANTED, 4.0

    def distribution(w: Float) -> Float:
        return np.asarray(np.expm1(kappa * (w + 1)) / np.expm1(2 * kappa))

    assert scipy.stats.kstest(along, distribution).pvalue > 1e-3
    across = np.cross(SLANTED, [0.0, 0.0, 1.0]) / 0.6
    turn = np.arctan2(n @ across, n @ np.cross(SLANTED, across))
    assert scipy.stats.kstest(turn, scipy.stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > 1e-3


def test_samples_of_three_steps_equal_one_of_three_times_the_duration() -> None:
    walk, rng = VonMisesFisherWalk(8.0), np.random.default_rng(2)
    x = np.tile(SLANTED, (40_000, 1))
    for _ in range(3):
        x = walk.sample(x, rng)
    assert x.mean(axis=0) @ SLANTED == pytest.approx(float(langevin(8.0)) ** 3, abs=0.012)


@given(st.floats(-np.pi, np.pi), st.floats(-np.pi, np.pi), st.floats(1e-3, 1e3))
def test_rotated_states_rotate_the_gaussian_interface(a: float, b: float, size: float) -> None:
    turn = scipy.spatial.transform.Rotation.from_euler("zx", [a, b]).as_matrix()
    walk, x = VonMisesFisherWalk(sigma_doa=0.1), size * SLANTED
    np.testing.assert_allclose(walk.f(turn @ x), turn @ walk.f(x), atol=1e-12)
    np.testing.assert_allclose(walk.F(turn @ x) * size, turn @ walk.F(x) @ turn.T * size, atol=1e-9)
    np.testing.assert_allclose(turn @ walk.Q() @ turn.T, walk.Q(), atol=1e-15)


def test_zero_vector_stays_finite() -> None:
    walk = VonMisesFisherWalk(9.0)
    assert walk.f(np.zeros(3)).tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(ValueError, match=r"x must have shape \(3,\); got \(2, 3\)"):
        walk.F(np.ones((2, 3)))


@pytest.mark.parametrize("params", [{}, {"kappa": 3.0, "sigma_doa": 0.1}])
def test_walk_requires_one_of_kappa_and_sigma_doa(params: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="exactly one of kappa and sigma_doa must be given"):
        VonMisesFisherWalk(**params)


@pytest.mark.parametrize("params", [{"sigma_doa": 0.0}, {"kappa": -1.0}, {"kappa": np.inf}])
def test_walk_width_must_be_positive(params: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be finite and positive"):
        VonMisesFisherWalk(**params)


@pytest.mark.parametrize("kind", [EKF, UKF])
def test_gaussian_filters_follow_a_direction_over_the_zenith(kind: type[EKF | UKF]) -> None:
    """Azimuth and elevation are singular at the zenith; the state is not."""
    sigma = np.deg2rad(1.0)
    truth = unit_vectors(0.4, np.deg2rad(np.arange(60.0, 121.0, 2.0)))
    z = truth + sigma * np.random.default_rng(0).standard_normal(truth.shape)
    walk = VonMisesFisherWalk(sigma_doa=np.deg2rad(3.0))
    probe = LinearMeasurement(np.eye(3), sigma**2 * np.eye(3))
    run = kind(walk, probe, truth[0], 0.01 * np.eye(3)).run(z)
    error = great_circle(run.x, truth)
    assert np.rad2deg(error.max()) < 4
    # two tangent directions, of about the variance that P states
    stated = np.array([np.trace(P) - u @ P @ u for P, u in zip(run.P, truth, strict=True)])
    assert 0.6 < (error**2 / stated).mean() < 1.6
