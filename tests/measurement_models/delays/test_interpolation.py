"""Interpolation at a delay: golden values of the specification, and laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arrivals.measurement_models import (
    ArraySamples,
    Autoregressive,
    DelayInterpolator,
    DelayLine,
    FlatBand,
    InterpolationDelay,
    Phasor,
    SensorArray,
    Tones,
)
from arrivals.measurement_models.delays.delay_line import SourceAtCentre
from arrivals.measurement_models.delays.interpolation import window
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation
from arrivals.motion_models import (
    CombinedMotion,
    ConstantVelocity,
    DelayDrift,
    DelayWalk,
    LinearMotion,
)
from arrivals.scenarios.bounds.delay import band_bound, exact_bound, tone_bound
from arrivals.scenarios.reproduce.interpolation.trials import SOURCES

BAND = FlatBand(0.15, 0.35)
EPS = 10**-0.5
CORRELATIONS: list[SourceCorrelation] = [
    BAND,
    FlatBand(0.0, 0.5),
    Tones(0.2),
    Tones((0.1, 0.15, 0.25), (1.0, 2.0, 3.0)),
    Autoregressive([1.2, -0.8]),
]
every_source = pytest.mark.parametrize(
    "source", CORRELATIONS, ids=lambda source: type(source).__name__
)
delays = st.floats(-3, 3)


# -- section 9.5 of the specification ----------------------------------------------------------


def test_golden_correlation_of_the_band() -> None:
    assert float(BAND.rho(0.4)) == pytest.approx(0.8005268634, abs=5e-11)
    assert float(BAND.drho(0.4)) == pytest.approx(-0.9559181144, abs=5e-11)
    assert float(BAND.rho(1.0)) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("tau", "c"),
    [
        (0.4, (0.8005268634, 0.5739609569)),
        (-0.7, (0.4394944464, -0.7309845816)),
        (1.3, (-0.4051654294, 0.8857395607)),
    ],
)
def test_golden_coefficients_of_two_taps(tau: float, c: tuple[float, float]) -> None:
    np.testing.assert_allclose(DelayInterpolator(BAND).coefficients(tau), c, atol=5e-11)


def test_golden_slopes_and_errors_of_two_taps() -> None:
    taps = DelayInterpolator(BAND)
    np.testing.assert_allclose(taps.jacobian(0.4), (-0.9559181144, 1.2866659975), atol=5e-11)
    assert float(taps.error_variance(0.4)) == pytest.approx(0.0297255609, abs=5e-11)
    residual = InterpolationDelay(taps, n_sensors=10, noise_ratio=EPS)
    assert float(residual.variance([0.4])) == pytest.approx(0.6527810452, abs=5e-11)


def test_golden_loaded_taps() -> None:
    taps = DelayInterpolator(BAND, loading=EPS)
    np.testing.assert_allclose(taps.coefficients(0.4), (0.6081978242, 0.4360650730), atol=5e-11)
    residual = InterpolationDelay(taps, n_sensors=10, noise_ratio=EPS)
    assert float(residual.variance([0.4])) == pytest.approx(0.5790647429, abs=5e-11)


def test_golden_four_taps_a_tone_and_the_full_band() -> None:
    four = DelayInterpolator(BAND, range(-1, 3)).coefficients(0.4)
    expected = (-0.1883674137, 0.6701275223, 0.4313994634, -0.1722974839)
    np.testing.assert_allclose(four, expected, atol=5e-11)
    tone = DelayInterpolator(Tones(0.2)).coefficients(0.7)
    np.testing.assert_allclose(tone, (0.3870690610, 0.8101655681), atol=5e-11)
    full = DelayInterpolator(FlatBand(0, 0.5)).coefficients(0.5)
    np.testing.assert_allclose(full, (0.6366197724, 0.6366197724), atol=5e-11)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("tone", (0.11690, 0.13038, 0.15968, 0.22583, 0.43626)),
        ("qpc", (0.16423, 0.18317, 0.22434, 0.31726, 0.61290)),
        ("band", (0.16046, 0.17897, 0.21919, 0.30998, 0.59884)),
    ],
)
def test_golden_bounds(name: str, expected: tuple[float, ...]) -> None:
    """The specification's figures for the band stem from a quadrature, 4e-5 off the integral."""
    model = SOURCES[name].measurement
    bound = band_bound if name == "band" else tone_bound
    ours = [np.rad2deg(bound(model, np.deg2rad(doa), 100)) for doa in (15, 30, 45, 60, 75)]
    np.testing.assert_allclose(ours, expected, rtol=4e-5 if name == "band" else 0, atol=5.1e-6)


def test_exact_bound_is_above_the_formula_and_converges_to_it() -> None:
    model = SOURCES["band"].measurement
    ours = [np.rad2deg(exact_bound(model, np.deg2rad(60), n)) for n in (25, 50)]
    np.testing.assert_allclose(ours, (0.710, 0.467), atol=5e-4)
    assert ours[1] / np.rad2deg(band_bound(model, np.deg2rad(60), 50)) < 1.07


# -- laws --------------------------------------------------------------------------------------


@every_source
@given(tau=delays)
def test_correlation_derivative_equals_numerical_slope(
    source: SourceCorrelation, tau: float
) -> None:
    step = 1e-5
    slope = (source.rho(tau + step) - source.rho(tau - step)) / (2 * step)
    assert float(source.drho(tau)) == pytest.approx(float(slope), abs=1e-7)
    assert float(source.rho(-tau)) == pytest.approx(float(source.rho(tau)), abs=1e-12)
    assert float(source.rho(0.0)) == pytest.approx(1.0, abs=1e-12)


@every_source
@given(tau=delays)
def test_taps_jacobian_equals_numerical_slope(source: SourceCorrelation, tau: float) -> None:
    taps, step = DelayInterpolator(source, range(-1, 3), loading=0.1), 1e-5
    slope = (taps.coefficients(tau + step) - taps.coefficients(tau - step)) / (2 * step)
    np.testing.assert_allclose(taps.jacobian(tau), slope, atol=1e-6)


@pytest.mark.parametrize("tap", [-1, 0, 1, 2])
def test_coefficients_at_a_tap_select_that_tap(tap: int) -> None:
    c = DelayInterpolator(BAND, range(-1, 3)).coefficients(float(tap))
    np.testing.assert_allclose(c, np.arange(-1, 3) == tap, atol=1e-12)


@given(tau=delays, frequency=st.floats(0.05, 0.45))
def test_two_taps_reproduce_a_tone_at_any_delay(tau: float, frequency: float) -> None:
    omega = 2 * np.pi * frequency
    expected = np.sin(omega * np.array([1 - tau, tau])) / np.sin(omega)
    np.testing.assert_allclose(DelayInterpolator(Tones(frequency)).coefficients(tau), expected,
                               atol=1e-9)  # fmt: skip


@given(tau=delays, ratio=st.floats(0.01, 10))
def test_taps_with_true_loading_are_orthogonal_to_the_error(tau: float, ratio: float) -> None:
    """Section 5: with ε_c = ε the noise does not shift a stationary point."""
    taps = DelayInterpolator(BAND, (0, 1), loading=ratio)
    c, dc = taps.coefficients(tau), taps.jacobian(tau)
    p = BAND.rho(tau - np.array([0, 1]))
    assert dc @ (p - (taps.r0 + ratio * np.eye(2)) @ c) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "line",
    [DelayLine(5, 0.1, BAND, 1.4), DelayLine(5, 0.1, Tones(0.2), 2.5), Phasor(5, 0.1, 0.25)],
    ids=["band", "tone", "phasor"],
)
@given(seed=st.integers(0, 1000))
def test_delay_line_jacobian_equals_numerical_slope(line: SourceAtCentre, seed: int) -> None:
    x = np.random.default_rng(seed).standard_normal(2 + line.dim_source)
    numeric = np.array(
        [(line.h(x + step) - line.h(x - step)) / 2e-5 for step in 1e-5 * np.eye(x.size)]
    ).T
    np.testing.assert_allclose(line.H(x), numeric, rtol=1e-5, atol=1e-5)
    assert (line.H(x)[:, 1] == 0).all()


def test_delay_line_of_a_tone_and_phasor_predict_equal_samples() -> None:
    line, phasor = DelayLine(5, 0.1, Tones(0.2), 2.0), Phasor(5, 0.1, 0.2)
    omega = 2 * np.pi * 0.2
    u, v, delay = 0.7, -0.4, 1.3
    s = [u * np.cos(omega * o) + v * np.sin(omega * o) for o in line.offsets]
    np.testing.assert_allclose(line.h([delay, *s]), phasor.h([delay, u, v]), atol=1e-8)


def test_measurement_depends_on_the_delay_only() -> None:
    X = np.random.default_rng(0).standard_normal((3, 2))
    model = InterpolationDelay(DelayInterpolator(BAND), 4, 0.1, regressors=X)
    np.testing.assert_array_equal(model.h([0.3]), model.h([0.3, 7.0]))
    np.testing.assert_array_equal(model.H([0.3, 7.0])[:, :1], model.H([0.3]))
    assert model.sample([0.3], np.random.default_rng(0)).shape == (3,)


def test_delay_motions_equal_linear_motions() -> None:
    x = np.array([1.0, 0.1])
    np.testing.assert_array_equal(DelayDrift(0.3).f(x), ConstantVelocity(0.3, 1).f(x))
    assert DelayWalk(0.3).dim_x == 1
    both = CombinedMotion(DelayDrift(0.3), LinearMotion([[0.5]], [[1.0]]))
    np.testing.assert_allclose(both.f([1.0, 0.1, 4.0]), [1.1, 0.1, 2.0])
    np.testing.assert_allclose(both.F(np.zeros(3)) @ [1.0, 0.1, 4.0], both.f([1.0, 0.1, 4.0]))


def test_asymmetric_scene_has_the_steering_sign() -> None:
    """Three sensors, one on the left missing, a source on the right: it arrives there first."""
    array = SensorArray.ula(5, spacing=0.4, missing=[1], speed=1.0)
    model = ArraySamples(array, 1.0, BAND)
    doa = np.deg2rad(35.0)
    arrival = -array.positions[:, 0] * np.sin(doa)  # s after the origin
    assert arrival.argmin() == 3
    lag = model.grid_index * model.delay(doa)
    np.testing.assert_allclose(lag - lag.min(), arrival - arrival.min(), atol=1e-12)
    assert model.grid_index.tolist() == [4, 2, 1, 0]
    frame = model.frame(np.array([1.0, 2.0, 3.0, 4.0]))
    np.testing.assert_array_equal(frame, [4.0, 3.0, 2.0, np.nan, 1.0])


def test_autoregressive_correlation_satisfies_yule_walker() -> None:
    source = Autoregressive([1.2, -0.8])
    rho = source.rho(np.arange(4))
    np.testing.assert_allclose(rho[2:], 1.2 * rho[1:-1] - 0.8 * rho[:-2], atol=1e-10)
    assert 0 < source.highest < 0.5


# -- bad input ---------------------------------------------------------------------------------


def test_invalid_parameters_raise_with_message() -> None:
    with pytest.raises(ValueError, match=r"half the sampling rate.*singular"):
        Tones(0.5)
    with pytest.raises(ValueError, match="powers must be 2"):
        Tones((0.1, 0.2), (1.0,))
    with pytest.raises(ValueError, match=r"0 <= low < high <= 0\.5"):
        FlatBand(0.3, 0.2)
    with pytest.raises(ValueError, match="stable"):
        Autoregressive([1.1])
    with pytest.raises(ValueError, match=r"loading must be at least 1e-9"):
        DelayInterpolator(Tones(0.25), window(2.0))
    with pytest.raises(ValueError, match="different whole numbers"):
        DelayInterpolator(BAND, (0, 0))
    with pytest.raises(ValueError, match="baseline"):
        InterpolationDelay(DelayInterpolator(BAND), 4, 0.1, baseline=4)
    with pytest.raises(ValueError, match="below half the sampling rate"):
        Phasor(4, 0.1, 0.5)


def test_measurements_of_wrong_shape_are_refused() -> None:
    model = InterpolationDelay(DelayInterpolator(BAND), 4, 0.1)
    with pytest.raises(
        ValueError, match="regressors must be set, samples of the neighbours; got None"
    ):
        model.h([0.3])
    with pytest.raises(ValueError, match=r"\(\.\.\., 3, 2\)"):
        model.h([0.3], np.zeros((2, 2)))
    with pytest.raises(ValueError, match="k must have all taps within the"):
        model.split(np.zeros((5, 4)), 0)
    with pytest.raises(ValueError, match="the delay, then the source"):
        Phasor(4, 0.1, 0.25).h([0.3, 1.0])


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (
            SensorArray.uca(5, 1.0, speed=1.0),
            "array must be a line of two or more sensors on a uniform grid",
        ),
        (SensorArray.ula(5, 1.0), "array must have a wave speed"),
        (SensorArray.ula(5, 2.0, speed=1.0), "alias limit, 0.25 Hz"),
    ],
)
def test_array_without_common_neighbour_delay_is_refused(array: SensorArray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ArraySamples(array, 1.0, BAND)


def test_places_of_sensors_are_their_grid_points() -> None:
    samples = ArraySamples(
        SensorArray.ula(4, spacing=0.5, speed=1000.0), 4000.0, correlation=Tones(0.25), snr_db=20.0
    )
    assert samples.places.tolist() == samples.grid_index.tolist() == [3, 2, 1, 0]
