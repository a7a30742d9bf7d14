"""Snapshots: their likelihood, their slope, and the manifold of gridless methods."""

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.stats import multivariate_normal

from arrivals.measurement_models import ArraySnapshot, SensorArray, composite
from arrivals.measurement_models.manifolds.manifold import Reference
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.typing import Complex, Float

LINE = SensorArray.ula(6, 0.5, missing=[1])
ARRAYS = [LINE, SensorArray.uca(5, 0.4), SensorArray(np.random.default_rng(2).normal(size=(5, 3)))]
MODELS = [ArraySnapshot(array, wavelength=1.3, noise=0.4, power=2.0) for array in ARRAYS]
every_model = pytest.mark.parametrize("model", MODELS, ids=["line", "circle", "space"])
both_references = pytest.mark.parametrize("reference", ["middle", "first"])


def snapshot(model: ArraySnapshot, seed: int = 0) -> Complex:
    n = model.array.n_sensors
    re, im = np.random.default_rng(seed).normal(size=(2, n))
    return np.asarray(re + 1j * im)


# the marginal likelihood


def covariance(model: ArraySnapshot, doa: ArrayLike) -> Complex:
    A = model.array.steering_vector(doa, model.wavelength)
    return np.asarray(model.power * A.T @ A.conj() + model.noise * np.eye(A.shape[-1]))


def dense_log_likelihood(model: ArraySnapshot, z: Complex, doa: ArrayLike) -> float:
    """scipy's real Gaussian of [Re z; Im z], of the sensors that gave a number."""
    valid = ~np.isnan(z)
    S = covariance(model, doa)[np.ix_(valid, valid)] / 2
    stacked = np.block([[S.real, -S.imag], [S.imag, S.real]])
    return float(multivariate_normal(np.zeros(len(stacked)), stacked).logpdf(composite(z[valid])))


@every_model
@pytest.mark.parametrize("doa", [[0.3], [0.3, -1.1], [-0.9, 0.3, 0.35]])
def test_log_likelihood_equals_the_dense_gaussian(model: ArraySnapshot, doa: list[float]) -> None:
    z = snapshot(model)
    expected = dense_log_likelihood(model, z, doa)
    assert model.log_likelihood(z, doa) == pytest.approx(expected, rel=1e-10)


@every_model
def test_log_likelihood_leaves_missing_sensors_out(model: ArraySnapshot) -> None:
    z = snapshot(model)
    z[[0, 3]] = np.nan, np.inf
    gaps = np.where(np.isfinite(z), z, np.nan)
    expected = dense_log_likelihood(model, gaps, [0.3, -1.1])
    assert model.log_likelihood(z, [0.3, -1.1]) == pytest.approx(expected, rel=1e-10)


@every_model
def test_log_likelihood_accepts_batches_of_directions(model: ArraySnapshot) -> None:
    z = snapshot(model)
    doa = np.random.default_rng(1).uniform(-1.5, 1.5, (3, 4, 2))
    values = model.log_likelihood(z, doa)
    assert values.shape == (3, 4)
    assert values[2, 1] == pytest.approx(dense_log_likelihood(model, z, doa[2, 1]), rel=1e-10)


def test_log_likelihood_without_source_equals_that_of_noise() -> None:
    model, z = MODELS[0], snapshot(MODELS[0])
    expected = multivariate_normal(np.zeros(10), model.R).logpdf(composite(z))
    assert model.log_likelihood(z, []) == pytest.approx(expected, rel=1e-12)


def test_log_likelihood_of_a_large_power_keeps_its_digits() -> None:
    model = MODELS[0].replace(power=1e5, noise=1e-2)
    expected = dense_log_likelihood(model, snapshot(model), [0.3])
    assert model.log_likelihood(snapshot(model), [0.3]) == pytest.approx(expected, rel=1e-7)


# the Gaussian interface


@every_model
def test_jacobian_equals_numerical_slope(model: ArraySnapshot) -> None:
    x = np.array([0.4, 1.2, -0.7])
    steps = 1e-6 * np.eye(3)
    slope = (model.h(x + steps) - model.h(x - steps)).T / 2e-6
    np.testing.assert_allclose(model.H(x), slope, atol=1e-7)


@every_model
def test_gaussian_interface_is_that_of_one_source(model: ArraySnapshot) -> None:
    x = np.array([[0.4, 1.2, -0.7], [-0.2, 0.0, 1.0]])
    quiet = model.replace(noise=1e-30)
    z = quiet.simulate(x[:, :1], x[:, 1:2] + 1j * x[:, 2:], np.random.default_rng(0))
    np.testing.assert_allclose(model.h(x), composite(z), atol=1e-12)
    assert model.h(x).shape == (2, model.dim_z)
    np.testing.assert_array_equal(model.residual([3.0, 1.0], [1.0, 1.0]), [2.0, 0.0])


def test_column_state_is_refused_with_the_cure() -> None:
    with pytest.raises(ValueError, match=r"pass x\.ravel\(\)"):
        MODELS[0].h(np.zeros((3, 1)))


def test_noise_has_covariance_R() -> None:
    model = MODELS[0]
    rng = np.random.default_rng(0)
    drawn = composite(model.simulate(np.zeros((20000, 1)), 0.0, rng))
    # 20000 draws: a variance of 0.2 is known to 0.2 sqrt(2 / 20000) = 0.002
    np.testing.assert_allclose(np.cov(drawn.T), model.R, atol=0.012)
    sampled = model.sample(np.zeros((20000, 3)), rng)
    np.testing.assert_allclose(np.cov(sampled.T), model.R, atol=0.012)


def test_inactive_sources_are_excluded_from_a_simulation() -> None:
    quiet = MODELS[0].replace(noise=1e-30)
    z = quiet.simulate([[0.3, np.nan], [np.nan, np.nan]], [1.0, np.nan], np.random.default_rng(0))
    np.testing.assert_allclose(z[0], LINE.steering_vector(0.3, 1.3), atol=1e-12)
    np.testing.assert_allclose(z[1], 0.0, atol=1e-12)


# what comes in


def test_snapshot_copies_its_argument_and_sets_invalid_numbers_to_nan() -> None:
    given = np.array([1.0, np.inf, np.nan, 2j, 3.0])
    kept = given.copy()
    z = MODELS[0].snapshot(given)
    np.testing.assert_array_equal(np.isnan(z), [False, True, True, False, False])
    np.testing.assert_array_equal(given, kept)
    assert MODELS[0].snapshots([1, 2, 3, 4, 5]).shape == (1, 5, 1)


@pytest.mark.parametrize(
    ("z", "error", "message"),
    [
        (np.ones(4), ValueError, r"shape \(5,\), one number a sensor; got \(4,\)"),
        (np.ones((5, 1)), ValueError, r"got \(5, 1\)"),
        (1.0, ValueError, r"got \(\)"),
        (["a"] * 5, TypeError, "z must hold numbers, NaN for a missing one; got"),
        ([[1.0, 2.0], [3.0]], ValueError, "z must have rows of one length"),
    ],
)
def test_invalid_snapshot_is_refused(z: ArrayLike, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        MODELS[0].snapshot(z)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"array": 3}, TypeError, "array must be a SensorArray; got 3"),
        ({"wavelength": 0.0}, ValueError, "wavelength must be finite and positive"),
        ({"noise": -1.0}, ValueError, "noise must be finite and positive"),
        ({"power": np.nan}, ValueError, "power must be finite and positive"),
        ({"wavelength": None}, TypeError, "wavelength must be a number"),
    ],
)
def test_invalid_parameters_are_refused(
    changes: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        MODELS[0].replace(**changes)


@every_model
def test_model_makes_the_round_trip_of_pickle_and_configuration(model: ArraySnapshot) -> None:
    assert pickle.loads(pickle.dumps(model)) == model
    assert ArraySnapshot.from_dict(model.to_dict()) == model
    assert hash(ArraySnapshot.from_dict(model.to_dict())) == hash(model)


# the manifold of a line on a grid


@both_references
@pytest.mark.parametrize("missing", [[], [0], [2, 3], [6]])
@pytest.mark.parametrize("shift", [0.0, 0.7])
def test_manifold_equals_the_steering_vector_up_to_the_amplitude(
    reference: Reference, missing: list[int], shift: float
) -> None:
    """w a(θ) of the manifold and to_amplitude(w) a(β) of the array are the same snapshot."""
    array = SensorArray(SensorArray.ula(7, 0.5, missing=missing).positions + shift)
    manifold = ArraySnapshot(array, wavelength=1.3).angle_manifold(reference)
    doa, w = np.array([-1.2, -0.1, 0.4, 1.5]), np.array([1.0, 2j, -1.0, 0.5 + 0.1j])
    theta = manifold.from_doa(doa)
    response = manifold.steering(theta)[0, 0] * w
    amplitude = manifold.to_amplitude(w, theta)
    np.testing.assert_allclose(
        response, (amplitude[:, None] * array.steering_vector(doa, 1.3)).T, atol=1e-10
    )
    np.testing.assert_allclose(np.abs(amplitude), np.abs(w), rtol=1e-12)


@both_references
def test_reference_sensor_has_phase_zero(reference: Reference) -> None:
    manifold = MODELS[0].angle_manifold(reference)
    a = manifold.steering([0.3, 1.0])[0, 0]
    where = {"first": 0, "middle": 2}[reference]
    np.testing.assert_allclose(a[where], 1.0, atol=1e-14)
    assert manifold.harmonics[where] == 0


def test_order_of_the_sensors_is_kept() -> None:
    """Sensors need not be listed from one end to the other."""
    array = SensorArray(np.array([1.0, -0.5, 0.5, 2.0]))
    manifold = ArraySnapshot(array, 1.0).angle_manifold("middle")
    assert isinstance(manifold, UniformLineManifold)
    assert np.diff(manifold.harmonics).tolist() == [-3, 2, 3]


@settings(deadline=None)
@given(st.floats(-np.pi / 2, np.pi / 2), st.floats(1.0, 4.0))
def test_to_doa_inverts_from_doa(doa: float, wavelength: float) -> None:
    manifold = ArraySnapshot(LINE, wavelength).angle_manifold()
    # arcsin loses half the digits at endfire
    assert manifold.to_doa(manifold.from_doa(doa)) == pytest.approx(doa, abs=5e-5)
    theta = np.linspace(-0.99, 0.99, 7) * manifold.from_doa(np.pi / 2)
    np.testing.assert_allclose(manifold.from_doa(manifold.to_doa(theta)), theta, atol=1e-12)


def test_angle_without_direction_is_nan_unless_within_its_slack() -> None:
    manifold = ArraySnapshot(SensorArray.ula(5, 0.25), wavelength=1.0).angle_manifold()
    theta = np.array([-3.0, -1.6, 1.5, 1.7])  # endfire is at pi/2
    np.testing.assert_array_equal(np.isnan(manifold.to_doa(theta)), [True, True, False, True])
    near = manifold.to_doa(theta, slack=0.1)
    np.testing.assert_array_equal(np.isnan(near), [True, False, False, True])
    assert near[1] == -np.pi / 2


@settings(deadline=None)
@given(st.floats(-1.2, 1.2))
def test_doa_std_is_the_angle_std_divided_by_the_slope(doa: float) -> None:
    manifold = MODELS[0].angle_manifold()
    slope = 2 * np.pi * 0.5 / 1.3 * np.cos(doa)
    std = manifold.doa_std(manifold.from_doa(doa), 1e-5)
    assert std == pytest.approx(1e-5 / slope, rel=1e-4)


def test_doa_std_is_finite_at_endfire() -> None:
    manifold = MODELS[0].angle_manifold()
    std = manifold.doa_std(manifold.from_doa([np.pi / 2, -np.pi / 2]), [0.01, 10.0])
    assert (std > 0).all()
    assert (std <= np.pi / 2).all()


@both_references
def test_manifold_without_sensors_keeps_the_response_of_the_others(reference: Reference) -> None:
    whole = MODELS[0].angle_manifold(reference)
    part = whole.without([0, 3])
    theta, w = np.array([0.3, -1.0]), np.array([1.0, 1j])
    assert whole.without([]) is whole
    assert (part.n_sensors, part.norm_squared()) == (3, 3.0)

    a_whole = np.delete(whole.steering(theta)[0, 0], [0, 3], axis=0)
    a_part = part.steering(theta)[0, 0]
    ratio = a_part / a_whole  # the reference may have moved; the origin has not
    np.testing.assert_allclose(ratio, np.broadcast_to(ratio[0], ratio.shape), atol=1e-12)
    turned = part.to_amplitude(w, theta) / whole.to_amplitude(w, theta)
    np.testing.assert_allclose(turned, ratio[0], atol=1e-12)
    np.testing.assert_allclose(part.to_doa(theta), whole.to_doa(theta))


def test_electrical_angle_requires_at_most_half_a_wavelength() -> None:
    half: Float = (
        ArraySnapshot(SensorArray.ula(5, 0.5), wavelength=1.0).angle_manifold().from_doa(1.57)
    )
    assert half == pytest.approx(np.pi, abs=1e-5)


def test_manifold_arrays_have_nuisance_and_bin_axes() -> None:
    manifold = MODELS[0].angle_manifold()
    assert manifold.steering(np.zeros(4)).shape == (1, manifold.n_bins, 5, 4)
    assert manifold.coefficients is None
    assert not manifold.front_back_ambiguous
    assert manifold.nuisance_weights.tolist() == [1.0]
    with pytest.raises(ValueError, match="reference must be one of"):
        MODELS[0].angle_manifold("last")  # type: ignore[arg-type]


@pytest.mark.parametrize("spacing", [0.5, 0.3])
def test_slope_is_the_derivative_of_the_angle(spacing: float) -> None:
    """Down to a tenth of the broadside's, where the direction is no longer identifiable."""
    line = ArraySnapshot(SensorArray.ula(7, spacing), wavelength=1.0).angle_manifold()
    doa = np.deg2rad([-80.0, -30.0, 0.0, 12.0, 75.0])
    slope = (line.from_doa(doa + 1e-6) - line.from_doa(doa - 1e-6)) / 2e-6
    np.testing.assert_allclose(line.slope(line.from_doa(doa)), slope, rtol=1e-6)
    broadside = line.slope(0.0)
    np.testing.assert_allclose(line.slope(line.from_doa(np.pi / 2)), 0.1 * broadside)
