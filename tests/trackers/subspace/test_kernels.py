"""Kernels of the subspace methods against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from subspace_scenes import LINE, NAMES, incoherent, subspaces_of

from arrivals.trackers import MUSIC, PAST, RootMUSIC, create
from arrivals.trackers.beamforming import spatial_smoothing
from arrivals.trackers.subspace.amplitudes import least_squares_amplitudes
from arrivals.trackers.subspace.base import Subspaces
from arrivals.trackers.subspace.esprit import esprit_angles, shifted_pairs
from arrivals.trackers.subspace.music_spectrum import SpectrumSearch, music_spectrum
from arrivals.trackers.subspace.past_steps import past_step
from arrivals.trackers.subspace.root_music import null_polynomial, root_music_angles
from arrivals.typing import Complex


@given(st.lists(st.floats(-3.1, 3.1), min_size=1, max_size=3))
def test_music_spectrum_is_a_ratio_of_norms_and_one_in_the_noise(
    theta: list[float],
) -> None:
    subspaces = subspaces_of([0.3, -1.0], np.arange(5))
    A = np.exp(1j * np.outer(theta, np.arange(5)))
    inside = [np.linalg.norm(subspaces.noise.conj().T @ a) ** 2 for a in A]
    expected = 5 / np.maximum(inside, 5e-10)
    np.testing.assert_allclose(music_spectrum(A, subspaces.noise), expected, rtol=1e-6)
    np.testing.assert_allclose(music_spectrum(subspaces.noise.T, subspaces.noise), 1.0)


def test_spectrum_search_by_the_smaller_subspace_equals_music_spectrum() -> None:
    A = LINE.array.steering_vector(np.linspace(-1.5, 1.5, 91), 1.0)
    rng = np.random.default_rng(0)
    Q = np.linalg.qr(rng.standard_normal((8, 8, 2)) @ np.array([1, 1j]))[0]
    for K in (1, 3, 4, 5, 7):
        scan, subspaces = SpectrumSearch(LINE.array, 1.0, 91), Subspaces(Q[:, :K], Q[:, K:])
        grid, power = scan.spectrum(subspaces)
        A = LINE.array.steering_vector(grid, 1.0)
        np.testing.assert_allclose(power, music_spectrum(A, subspaces.noise), rtol=1e-9)


@given(st.floats(-3.1, 3.1))
def test_null_polynomial_equals_the_null_spectrum_on_the_unit_circle(theta: float) -> None:
    grid_index = np.array([3, 0, 1, 6])  # in any order, with gaps
    rng = np.random.default_rng(4)
    Q = np.linalg.qr(rng.standard_normal((4, 4, 2)) @ np.array([1, 1j]))[0]
    a, E, z = np.exp(1j * theta * grid_index), Q[:, 1:], np.exp(1j * theta)
    expected = np.linalg.norm(E.conj().T @ a) ** 2
    value = np.polyval(null_polynomial(E, grid_index), z) / z**6
    assert value == pytest.approx(expected, abs=1e-9)


@settings(max_examples=50)
@given(st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=3, unique=True))
def test_root_music_and_esprit_without_noise_are_exact(theta: list[float]) -> None:
    gaps = np.diff(sorted([*theta, min(theta) + 2 * np.pi]))
    if gaps.min() < 0.2:
        return
    grid_index = np.arange(6)
    subspaces = subspaces_of(theta, grid_index)
    roots = np.sort(root_music_angles(subspaces.noise, grid_index, len(theta)))
    turns = np.sort(esprit_angles(subspaces.signal, *shifted_pairs(grid_index, 1)))
    np.testing.assert_allclose(roots, sorted(theta), atol=1e-6)
    np.testing.assert_allclose(turns, sorted(theta), atol=1e-9)


def test_kernels_of_a_batch_equal_single_cases() -> None:
    angles = [[0.3, -1.0], [2.0, 0.5]]
    subspaces = [subspaces_of(theta, np.arange(5)) for theta in angles]
    noise, signal = np.stack([f.noise for f in subspaces]), np.stack([f.signal for f in subspaces])
    A = np.exp(1j * np.outer([0.1, 0.2, 0.3], np.arange(5)))
    first, second = shifted_pairs(np.arange(5), 1)
    for k in range(2):
        one = root_music_angles(noise[k], range(5), 2)
        np.testing.assert_allclose(root_music_angles(noise, range(5), 2)[k], one)
        np.testing.assert_allclose(
            esprit_angles(signal, first, second)[k], esprit_angles(signal[k], first, second)
        )
        np.testing.assert_allclose(music_spectrum(A, noise)[k], music_spectrum(A, noise[k]))


def test_root_music_equals_music_on_a_fine_grid() -> None:
    z, _ = incoherent(LINE, [0.2, 0.5], n=80)
    doa = RootMUSIC(LINE, 2).run(z).doa[-1]
    fine = MUSIC(LINE, 2, n_directions=20001).run(z).doa[-1]
    np.testing.assert_allclose(doa, fine, atol=2e-3)  # with noise the zeros are not on the circle


def test_root_music_angles_with_too_few_visible_roots_are_nan() -> None:
    subspaces = subspaces_of([0.2, 2.5], np.arange(3))
    roots = root_music_angles(subspaces.noise, range(3), 2, max_angle=np.pi / 2)
    assert roots[0] == pytest.approx(0.2)
    assert np.isnan(roots[1])


def printed_past(y: Complex, K: int, beta: float) -> Complex:
    """Return W by the printed algorithm, in plain loops."""
    W, P = np.eye(y.shape[1], K, dtype=complex), np.eye(K, dtype=complex)
    for sample in y:
        z = W.conj().T @ sample
        h = P @ z
        g = h / (beta + np.vdot(z, h))
        P = (P - np.outer(g, h.conj())) / beta
        P = (P + P.conj().T) / 2
        W = W + np.outer(sample - W @ z, g.conj())
    return W


def test_past_step_equals_the_printed_algorithm_for_a_batch() -> None:
    ys = np.stack([incoherent(LINE, [0.3, -0.5], seed=seed)[0] for seed in (0, 1)])
    W = np.broadcast_to(np.eye(8, 2, dtype=complex), (2, 8, 2))
    P = np.broadcast_to(np.eye(2, dtype=complex), (2, 2, 2))
    for k in range(ys.shape[1]):
        W, P = past_step(W, P, ys[:, k], 0.95)
    for run in range(2):
        np.testing.assert_allclose(W[run], printed_past(ys[run], 2, 0.95), atol=1e-10)


def test_past_converges_to_the_eigenvectors() -> None:
    z, _ = incoherent(LINE, [0.3, -0.5], n=400)
    tracker = PAST(LINE, 2, forgetting=0.99)
    tracker.run(z)
    w = 0.99 ** np.arange(len(z))[::-1]
    U = np.linalg.eigh((w[:, None] * z).T @ z.conj())[1][:, -2:]
    Q = np.linalg.qr(tracker.W)[0]
    cosines = np.linalg.svd(U.conj().T @ Q)[1]
    assert cosines.min() > 1 - 1e-5


def test_past_stays_finite_after_zeros_and_without_excitation() -> None:
    one = LINE.wave([0.3], [1.0])
    tracker = PAST(LINE, 2, interval=100)
    tracker.run([one] * 100)
    tracker.predict(dt=1e6)
    tracker.run([np.zeros(8)] * 100)
    tracker.run([one] * 30000)
    assert np.isfinite(tracker.inverse).all()
    assert np.abs(tracker.estimate.doa - 0.3).min() < 1e-6


@pytest.mark.parametrize("unit", [1e-120, 1e-5, 1e100])
@pytest.mark.parametrize("name", NAMES)
def test_directions_do_not_depend_on_the_unit_of_the_samples(name: str, unit: float) -> None:
    z, _ = incoherent(LINE, [0.2, 0.5])
    plain, scaled = (create(name, measurement=LINE).run(y) for y in (z, unit * z))
    np.testing.assert_array_equal(scaled.n_found, plain.n_found)
    np.testing.assert_allclose(scaled.doa, plain.doa, atol=1e-8)


def test_least_squares_amplitudes_of_equal_waves_are_equal() -> None:
    z, _ = incoherent(LINE, [0.3], n=1)
    A = LINE.array.steering_vector([0.3, -0.2], 1.0)
    expected = np.linalg.lstsq(A.T, z[0], rcond=None)[0]
    np.testing.assert_allclose(least_squares_amplitudes(A, z[0]), expected, atol=1e-10)
    one, other = least_squares_amplitudes(A[[0, 0]], z[0])
    assert abs(one - other) < 1e-3


def test_spatial_smoothing_is_the_mean_over_subarrays_and_keeps_white_noise_white() -> None:
    rng = np.random.default_rng(0)
    y = rng.standard_normal((2, 30, 5, 2)) @ np.array([1, 1j])
    R = np.swapaxes(y, -1, -2) @ y.conj()
    expected = sum(
        np.swapaxes(y[..., s : s + 3], -1, -2) @ y[..., s : s + 3].conj() for s in range(3)
    )
    np.testing.assert_allclose(spatial_smoothing(R, 3), expected / 3)
    white = spatial_smoothing(np.eye(5, dtype=complex), 3, backward=True)
    np.testing.assert_allclose(white, np.eye(3, dtype=complex))
    both = spatial_smoothing(R, 4, backward=True)
    np.testing.assert_allclose(both, both.conj()[..., ::-1, ::-1])
    with pytest.raises(ValueError, match="length must be at most n_sensors, 5; got 6"):
        spatial_smoothing(R, 6)
