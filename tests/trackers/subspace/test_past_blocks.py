"""PAST over a block of snapshots beside its step for one snapshot."""

import importlib.util

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import PAST
from arrivals.trackers.subspace import past_blocks
from arrivals.trackers.subspace.past_blocks import past_steps, unit_steps
from arrivals.trackers.subspace.past_steps import limited_trace, past_step, subspace_eigenvectors
from arrivals.typing import Complex

N, K = 6, 2
HAS_NUMBA = importlib.util.find_spec("numba") is not None


def noise(*shape: int, seed: int = 0) -> Complex:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.standard_normal((*shape, 2)) @ np.array([1, 1j]))


def start() -> tuple[Complex, Complex]:
    A = noise(K, K, seed=1)
    return np.linalg.qr(noise(N, K))[0], A @ A.conj().T


def one_by_one(
    Y: Complex, beta: float, energy: float, max_trace: float
) -> tuple[Complex, Complex, float]:
    W, P = start()
    for y in Y:
        W, P = past_step(W, P, y, beta)
        energy = beta * energy + float(np.vdot(y, y).real)
        P = limited_trace(P, max_trace / energy)
        beta = 1.0
    return W, P, energy


@pytest.mark.parametrize("may_compile", [False, True])
@pytest.mark.parametrize("max_trace", [1e12, 5.0])  # not reached, and reached
def test_past_steps_equal_steps_of_one_snapshot(
    may_compile: bool, max_trace: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not may_compile:
        monkeypatch.setattr(past_blocks, "compiled_steps", lambda: None)
    Y, (W, P) = noise(30, N, seed=2), start()
    given = W.copy(), P.copy(), Y.copy()
    expected = one_by_one(Y, 0.7, 5.0, max_trace)
    new_W, new_P, energy = past_steps(W, P, Y, 0.7, 5.0, max_trace)
    np.testing.assert_allclose(new_W, expected[0], rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(new_P, expected[1], rtol=1e-12, atol=1e-13)
    assert energy == pytest.approx(expected[2], rel=1e-13)
    for array, before in zip((W, P, Y), given, strict=True):
        np.testing.assert_array_equal(array, before)


def test_trace_limit_of_the_test_is_reached_and_the_other_is_not() -> None:
    Y = noise(30, N, seed=2)
    free, limited = (one_by_one(Y, 0.7, 5.0, limit)[1] for limit in (1e12, 5.0))
    assert np.trace(limited).real < 0.99 * np.trace(free).real
    np.testing.assert_array_equal(free, one_by_one(Y, 0.7, 5.0, 1e15)[1])


@pytest.mark.skipif(not HAS_NUMBA, reason="needs numba")
def test_compiled_steps_equal_those_of_python() -> None:
    W, P = start()
    WP = np.concatenate([W.conj().T, P], axis=1)
    Y = np.concatenate([noise(30, N, seed=4), np.zeros((30, K))], axis=1)
    expected = WP.copy()
    compiled_form = past_blocks.compiled_steps()
    assert compiled_form is not None
    compiled_form(WP, Y)
    unit_steps(expected, Y)
    assert abs(expected[:, :N] - W.conj().T).max() > 0.1
    np.testing.assert_allclose(WP, expected, rtol=1e-13, atol=1e-15)


def test_snapshots_of_zeros_change_nothing_but_the_weight_of_the_past() -> None:
    W, P = start()
    new_W, new_P, energy = past_steps(W, P, np.zeros((3, N), complex), 0.5, 8.0, 1e12)
    np.testing.assert_allclose(new_W, W)
    np.testing.assert_allclose(new_P, 2 * P)
    assert energy == 4.0


def test_broken_numba_warns_once_and_missing_numba_never(monkeypatch: pytest.MonkeyPatch) -> None:
    fresh = past_blocks.compiled_steps.__wrapped__
    monkeypatch.setattr(past_blocks, "compiler_error", lambda: "no LLVM")
    with pytest.warns(RuntimeWarning, match="numba cannot be used, so PAST runs on arrays: no LL"):
        assert fresh() is None
    monkeypatch.setattr(past_blocks, "compiler_error", lambda: "")
    assert fresh() is None
    monkeypatch.setattr(past_blocks, "compiler_error", lambda: None)

    def without_cache(function: object) -> object:
        raise RuntimeError("no place for the cache")

    monkeypatch.setattr(past_blocks, "compiled", without_cache)
    with pytest.warns(RuntimeWarning, match="no place for the cache"):
        assert fresh() is None


@pytest.mark.parametrize("n_missing", [0, 1])
def test_block_equals_its_snapshots_of_equal_weight_from_the_first(n_missing: int) -> None:
    line = SensorArray.ula(N, spacing=0.5)
    one = PAST(ArraySnapshot(line, wavelength=1.0), n_sources=K)
    many = PAST(ArraySnapshot(line, wavelength=1.0, n_snapshots=20), n_sources=K)
    for block in noise(3, 20, N, seed=5):
        block[:n_missing, 2] = np.nan
        many.predict()
        many.update(block)
        one.predict()
        for z in block:
            one.update(z)
    np.testing.assert_allclose(many.W, one.W, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(many.inverse, one.inverse, rtol=1e-11, atol=1e-13)
    assert many.energy == pytest.approx(one.energy, rel=1e-12)
    np.testing.assert_allclose(many.x, one.x, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("weakest", [1.0, 1e-5, 1e-9, 0.0])
def test_eigenvectors_of_the_subspace_are_those_of_its_matrix(weakest: float) -> None:
    W = noise(N, 3, seed=6) * np.sqrt([3.0, 1.0, weakest])
    A = noise(3, 3, seed=7)
    P = A @ A.conj().T + np.eye(3)
    values, vectors = subspace_eigenvectors(W, P, complete=False)
    expected = W @ np.linalg.solve(P, W.conj().T)
    np.testing.assert_allclose((vectors * values) @ vectors.conj().T, expected, atol=1e-12)
    np.testing.assert_allclose(vectors.conj().T @ vectors, np.eye(3), atol=1e-9)
    assert (np.diff(values) <= 0).all()
