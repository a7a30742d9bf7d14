"""Directions of a single step: golden numbers, likelihood, honest covariance, gaps, energies."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.measurement_models.station import Station
from arrivals.trackers.fusion.stations.single_step_bearings import bearings, fit_directions
from arrivals.trackers.fusion.stations.white_snapshots import StepSnapshots, step_snapshots
from arrivals.typing import Complex, Float

CIRCLE = SensorArray.uca(8, 0.65)
NARROW = ArraySnapshot(CIRCLE, 1.0, n_snapshots=10)
WIDE = ArraySnapshot(SensorArray.uca(8, 0.5), [1.0, 1.2, 1.5])
LINE = ArraySnapshot(SensorArray.ula(6, 0.5), 1.0, n_snapshots=4)
DIFFUSE = ArraySnapshot(
    SensorArray.uca(6, 0.2), [1.0, 1.3], n_snapshots=3, noise_coherence="diffuse"
)
AZIMUTHS = 2 * np.pi * (np.arange(36)[:, None] / 36 - np.arange(8) / 8)
GAINS = np.asarray(1 + 0.5 * np.cos(AZIMUTHS), dtype=np.complex128)
CARDIOID = ArraySnapshot(CIRCLE, 1.0, response=ElementResponse(GAINS), n_snapshots=5)
SPHERE = ArraySnapshot(CIRCLE, 1.0, unknowns="sphere", n_snapshots=4)
MODELS = {
    "narrow": NARROW,
    "wide": WIDE,
    "line": LINE,
    "diffuse": DIFFUSE,
    "cardioid": CARDIOID,
    "sphere": SPHERE,
}


def golden() -> Complex:
    n, m = np.arange(10), np.arange(8)
    w = np.stack([np.exp(0.3j * n**2), 0.5 * np.exp(0.7j * n**2)])
    waves = w.T @ NARROW.steering_vector(np.deg2rad([20.0, 65.0]))
    return np.asarray(waves + 0.1 * np.exp(1j * (m**2 + 0.9 * n[:, None] * (m + 1))))


def amplitudes(model: ArraySnapshot, n_sources: int, rng: np.random.Generator) -> Complex:
    shape = (*model.shape[:-1], n_sources)
    w = rng.standard_normal((*shape, 2)) @ [1, 1j] / np.sqrt(2)
    return np.asarray(w)


def drawn(model: ArraySnapshot, doa: Float, snr: float, seed: int) -> Complex:
    rng = np.random.default_rng(seed)
    w = np.sqrt(snr) * amplitudes(model, len(doa), rng)
    return model.simulate(doa, w, rng)


def measured(model: ArraySnapshot, z: Complex) -> StepSnapshots:
    step = step_snapshots(model, z)
    assert step is not None
    return step


def residual_energy(step: StepSnapshots, doa: Float) -> float:
    """Return the energy that least squares leave, bin by bin."""
    A, _ = step.response(doa)
    W = [np.linalg.lstsq(a, y, rcond=None)[0] for a, y in zip(A, step.Y, strict=True)]
    return sum(float(np.linalg.norm(y - a @ w) ** 2) for a, y, w in zip(A, step.Y, W, strict=True))


def check_equal(found: tuple[Float, Float, float], wanted: tuple[Float, Float, float]) -> None:
    np.testing.assert_allclose(found[0], wanted[0], rtol=1e-6)
    np.testing.assert_allclose(found[1], wanted[1], rtol=1e-5, atol=1e-9)
    assert found[2] == pytest.approx(wanted[2], rel=1e-6)


def test_bearings_of_golden_snapshots() -> None:
    doa, R, noise = bearings(NARROW, golden(), np.deg2rad([22.0, 63.0]))
    np.testing.assert_allclose(np.rad2deg(doa), [20.235033, 65.252928], rtol=1e-7)
    std = np.sqrt(R.diagonal())
    np.testing.assert_allclose(np.rad2deg(std), [0.175541, 0.351067], rtol=3e-6)
    assert R[0, 1] / (std[0] * std[1]) == pytest.approx(0.24335367312837, rel=1e-7)
    assert noise == pytest.approx(0.009857017560586, rel=1e-7)


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_bearings_converge_to_the_least_residual(model: ArraySnapshot) -> None:
    truth = np.array([-0.6, 0.5])
    z = drawn(model, truth, 100.0, 1)
    step = measured(model, z)
    best = minimize(lambda doa: np.log(residual_energy(step, doa)), truth, method="BFGS", tol=1e-10)
    doa, R, noise = bearings(model, z, truth + np.array([0.02, -0.02]), n_steps=12)
    np.testing.assert_allclose(doa, best.x, atol=1e-5)
    n_numbers = z.size * (1 - 2 / z.shape[-1])
    assert noise == pytest.approx(residual_energy(step, best.x) / n_numbers, rel=1e-4)
    assert np.linalg.eigvalsh(R).min() > 0


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_slope_of_the_response_equals_its_differences(model: ArraySnapshot) -> None:
    step = measured(model, drawn(model, np.array([0.3]), 10.0, 0))
    doa, h = np.array([-1.1, 0.2, 1.3]), 1e-4
    _, D = step.response(doa)
    differences = (step.response(doa + h)[0] - step.response(doa - h)[0]) / (2 * h)
    np.testing.assert_allclose(D, differences, atol=1e-5)


@pytest.mark.parametrize("name", ["narrow", "wide", "line", "diffuse", "cardioid"])
def test_covariance_of_bearings_is_that_of_their_errors(name: str) -> None:
    model, truth, n = MODELS[name], np.array([-0.6, 0.5]), 300
    scores = np.empty(n)
    for seed in range(n):
        doa, R, _ = bearings(model, drawn(model, truth, 30.0, seed), truth)
        scores[seed] = (doa - truth) @ np.linalg.solve(R, doa - truth) / 2
    # Student-like tails where ν is of few numbers; standard error about 0.06
    assert 0.8 < scores.mean() < 1.35


def test_bearings_remove_the_pull_of_their_start() -> None:
    z = drawn(NARROW, np.array([-0.6, 0.5]), 100.0, 2)
    one, _, _ = bearings(NARROW, z, [-0.62, 0.53])
    other, _, _ = bearings(NARROW, z, [-0.57, 0.48])
    np.testing.assert_allclose(one, other, atol=1e-5)  # of starts 0.05 rad apart


@given(st.floats(-np.pi, np.pi), st.permutations([0, 1, 2]))
def test_turned_array_and_permuted_sources_change_nothing_else(
    turn: float, order: list[int]
) -> None:
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    turned = ArraySnapshot(SensorArray(CIRCLE.positions @ R.T), 1.0, n_snapshots=10)
    z, start = drawn(NARROW, np.array([-1.0, 0.4, 2.0]), 30.0, 3), np.array([-1.05, 0.45, 2.02])
    doa, covariance, noise = bearings(NARROW, z, start)
    other, same, as_well = bearings(turned, z, start[order] + turn)
    error = (other - doa[order] - turn + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(error, 0, atol=1e-7)
    np.testing.assert_allclose(same, covariance[np.ix_(order, order)], rtol=1e-5, atol=1e-9)
    assert as_well == pytest.approx(noise, rel=1e-6)


def test_scaled_snapshots_scale_the_noise_alone() -> None:
    z = golden()
    doa, R, noise = bearings(NARROW, z, np.deg2rad([22.0, 63.0]))
    same, as_well, scaled = bearings(NARROW, 1e-6j * z, np.deg2rad([22.0, 63.0]))
    np.testing.assert_allclose(same, doa, rtol=1e-9)
    np.testing.assert_allclose(as_well, R, rtol=1e-9)
    assert scaled == pytest.approx(1e-12 * noise, rel=1e-9)


def test_missing_sensors_bins_and_snapshots_are_left_out() -> None:
    model = ArraySnapshot(CIRCLE, [1.0, 1.2], n_snapshots=4)
    truth = np.array([-0.6, 0.5])
    z = drawn(model, truth, 100.0, 4)
    gaps = z.copy()
    gaps[:, :, 3], gaps[:, 2] = np.nan, np.nan
    rest = ArraySnapshot(CIRCLE.without([3]), [1.0, 1.2], n_snapshots=3)
    expected = bearings(rest, np.delete(np.delete(z, 3, axis=2), 2, axis=1), truth)
    check_equal(bearings(model, gaps, truth), expected)
    gaps[1] = np.nan
    single = ArraySnapshot(CIRCLE.without([3]), 1.0, n_snapshots=3)
    expected = bearings(single, np.delete(np.delete(z[0], 3, axis=1), 2, axis=0), truth)
    check_equal(bearings(model, gaps, truth), expected)


def test_many_snapshots_count_as_their_covariance() -> None:
    model = ArraySnapshot(SensorArray.uca(5, 0.4), 1.0, n_snapshots=40)
    z = drawn(model, np.array([-0.6, 0.9]), 10.0, 5)
    step = measured(model, z)
    whole = StepSnapshots(z.T[None], 40, step.response, is_line=False)
    assert step.Y.shape == (1, 5, 5)
    few, all_of_them = fit_directions(step, [-0.6, 0.9]), fit_directions(whole, [-0.6, 0.9])
    check_equal(
        (few.doa, few.covariance, few.noise),
        (all_of_them.doa, all_of_them.covariance, all_of_them.noise),
    )
    np.testing.assert_allclose(few.error_covariance, all_of_them.error_covariance, rtol=1e-5)
    assert few.energy == pytest.approx(all_of_them.energy)
    np.testing.assert_allclose(few.explained, all_of_them.explained)


def test_coherent_noise_is_whitened() -> None:
    """The whitened model is more precise than one that takes the noise for white."""
    truth, white = np.array([0.4, 1.6]), DIFFUSE.replace(noise_coherence="white")
    errors = np.empty((2, 200, 2))
    for seed in range(200):
        z = drawn(DIFFUSE, truth, 10.0, seed)
        for i, model in enumerate((DIFFUSE, white)):
            errors[i, seed] = bearings(model, z, truth)[0] - truth
    rms = np.sqrt((errors**2).mean(axis=(1, 2)))
    assert rms[0] < 0.8 * rms[1]


def test_source_at_a_height_has_the_elevation_of_a_grid() -> None:
    grid = tuple(np.deg2rad([0.0, 20.0, 40.0, 60.0]))
    model = ArraySnapshot(CIRCLE, 1.0, n_snapshots=10, elevation=grid)
    flat = NARROW
    rng = np.random.default_rng(0)
    truth, height = np.array([-0.6, 0.9]), np.deg2rad([40.0, 20.0])
    z = flat.simulate(truth, 10 * amplitudes(flat, 2, rng), rng, elevation=height)
    doa, _, noise = bearings(model, z, truth)
    _, _, horizontal = bearings(flat, z, truth)
    np.testing.assert_allclose(doa, truth, atol=0.02)
    assert 0.7 < noise < 1.3
    assert horizontal > 5


def test_line_beyond_endfire_is_the_mirror_image() -> None:
    doa = np.array([1.5])
    z = drawn(LINE, doa, 1e4, 0)
    found, R, _ = bearings(LINE, z, [1.55])
    beyond, same, _ = bearings(LINE, z, [np.pi - 1.55], n_steps=2)
    assert np.abs([found, beyond]).max() <= np.pi / 2
    np.testing.assert_allclose(beyond, found, atol=1e-9)
    np.testing.assert_allclose(same, R, rtol=1e-6)
    on_map = Station(LINE, [0.0, 0.0]).to_map(found)
    np.testing.assert_allclose(on_map[0, 0], np.pi / 2 - found[0])


def test_mirror_image_of_one_source_changes_the_sign_of_its_covariance() -> None:
    z = drawn(LINE, np.array([1.1, 0.7]), 1e3, 1)
    found, R, _ = bearings(LINE, z, [1.1, 0.7])
    mirrored, same, _ = bearings(LINE, z, [np.pi - 1.1, 0.7])
    np.testing.assert_allclose(mirrored, found, atol=1e-9)
    np.testing.assert_allclose(same, R, rtol=1e-6)
    assert abs(R[0, 1]) > 1e-3 * R[0, 0]


def test_steps_are_at_most_a_tenth_of_a_radian() -> None:
    z, start = drawn(NARROW, np.array([0.5]), 1e3, 0), np.array([0.5 + 0.25])
    for n_steps in range(3):
        doa, _, _ = bearings(NARROW, z, start, n_steps=n_steps)
        assert doa[0] == pytest.approx(start[0] - 0.1 * n_steps)


def test_explained_energy_is_what_a_fit_without_the_source_loses() -> None:
    doa = np.array([-0.6, -0.1, 0.5, 2.0])
    for model in (NARROW, WIDE, DIFFUSE):
        step = measured(model, drawn(model, doa, 3.0, 7))
        fit = fit_directions(step, doa)
        assert fit.energy == pytest.approx(residual_energy(step, fit.doa), rel=1e-4)
        for k in range(4):
            rest = residual_energy(step, np.delete(fit.doa, k))
            assert fit.explained[k] == pytest.approx(rest - fit.energy, rel=1e-3)


def test_absent_source_explains_the_noise_of_one_amplitude_a_snapshot() -> None:
    ratios = []
    for seed in range(200):
        fit = fit_directions(
            measured(NARROW, drawn(NARROW, np.array([0.5]), 10.0, seed)), [0.5, 2.5]
        )
        ratios.append(fit.explained[1] / fit.noise)
    # F N = 10, and about 2 for the fitted direction; standard error 0.27
    assert 10.8 < np.mean(ratios) < 13.6


def test_bearings_without_information_have_the_prior_of_one_radian() -> None:
    for z in (None, np.full((10, 8), np.nan), np.zeros((10, 8))):
        doa, R, noise = bearings(NARROW, z, [0.5, 1.0])
        np.testing.assert_array_equal(doa, [0.5, 1.0])
        np.testing.assert_array_equal(R, np.eye(2))
        assert np.isnan(noise)
    few = golden()
    few[:, 2:] = np.nan
    for start in ([0.5, 1.0], [0.5, 1.0, 2.0]):
        doa, R, noise = bearings(NARROW, few, start)
        np.testing.assert_allclose(doa, start)
        np.testing.assert_array_equal(R, np.eye(len(start)))
        assert np.isnan(noise)


def test_bearings_of_no_source_are_empty_with_the_power_as_noise() -> None:
    z = golden()
    doa, R, noise = bearings(NARROW, z, [])
    assert (doa.shape, R.shape) == ((0,), (0, 0))
    assert noise == pytest.approx(np.mean(np.abs(z) ** 2))


def test_weak_or_repeated_sources_stay_finite() -> None:
    z = golden()
    for start in ([0.35, 0.35], [0.35, 1.1, 1.1 + 1e-9], np.linspace(0.3, 0.5, 7)):
        doa, R, noise = bearings(NARROW, z, start)
        assert np.isfinite(doa).all()
        assert np.linalg.eigvalsh(R).min() > 0
        assert R.diagonal().max() <= 1 + 1e-9
        assert noise > 0


def test_noiseless_snapshots_have_a_finite_covariance() -> None:
    z = NARROW.wave([0.5], np.ones((10, 1)))
    doa, R, _ = bearings(NARROW, z, [0.52], n_steps=6)
    np.testing.assert_allclose(doa, [0.5], atol=1e-6)
    assert 0 < R[0, 0] < 1e-6


@pytest.mark.parametrize(
    ("z", "doa", "message"),
    [
        (golden(), [np.nan], r"doa must be finite, of shape \(n_sources,\); got \[nan\]"),
        (golden(), 0.5, r"doa must be finite, of shape \(n_sources,\); got 0.5"),
        (None, [[0.5]], r"doa must be finite, of shape \(n_sources,\)"),
        (np.ones(8), [0.5], r"z must have shape \(10, 8\)"),
    ],
)
def test_bearings_invalid_argument_raises(z: Any, doa: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        bearings(NARROW, z, doa)


@pytest.mark.parametrize("snr_db", [-6.0, 0.0, 15.0])
def test_error_covariance_counts_noise_in_the_amplitudes(snr_db: float) -> None:
    """Of 400 draws: mean squared error over mean stated variance, of one source."""
    model, rng = (
        ArraySnapshot(SensorArray.uca(8, 0.65), 1.0, n_snapshots=20),
        np.random.default_rng(7),
    )
    squares, inverse, stated = [], [], []
    for _ in range(400):
        w = 10 ** (snr_db / 20) * np.exp(2j * np.pi * rng.random((20, 1)))
        step = step_snapshots(model, model.simulate([0.5], w, rng))
        assert step is not None
        fit = fit_directions(step, [0.5], n_steps=3)
        squares.append((fit.doa[0] - 0.5) ** 2)
        inverse.append(fit.covariance[0, 0])
        stated.append(fit.error_covariance[0, 0])
    assert np.mean(squares) / np.mean(stated) == pytest.approx(1.0, abs=0.25)
    assert (np.mean(squares) > 1.3 * np.mean(inverse)) == (snr_db < 5)
