"""The compiled Newton solver beside the array program, with numba and as plain Python."""

import importlib
import sys
import types
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import SVALSE, VALSE, NewtonSolver, Run, compiler
from arrivals.trackers.svalse.newton import IterationLimits, solver
from arrivals.trackers.svalse.newton.compiled import selection
from arrivals.typing import Complex

LINE, CIRCLE = SensorArray.ula(10, 0.5), SensorArray.uca(7, 0.5)
UNEVEN = SensorArray(np.array([0.0, 0.5, 1.3, 2.2, 3.0, 4.4]))
KERNELS = [
    f"arrivals.trackers.svalse.newton.compiled.{name}"
    for name in ("elbo", "step", "candidates", "search", "marginals", "solve")
]
HAS_NUMBA = compiler.compiler_error() is None
CASES: dict[str, tuple[ArraySnapshot, dict[str, Any]]] = {
    "line": (ArraySnapshot(LINE, 1.0), {}),
    "line with gaps": (ArraySnapshot(SensorArray.ula(13, 0.5, missing=[2, 9]), 1.0), {}),
    "line, many snapshots": (ArraySnapshot(LINE, 1.0, n_snapshots=15), {}),
    "circle": (ArraySnapshot(CIRCLE, 1.0), {"max_components": 4}),
    "circle, bins and snapshots": (ArraySnapshot(CIRCLE, [1.0, 0.9], n_snapshots=3), {}),
    "uneven line, front and back": (ArraySnapshot(UNEVEN, [1.0, 1.2], n_snapshots=2), {}),
    "coherent noise": (ArraySnapshot(CIRCLE, [1.0, 0.9], noise_coherence="diffuse"), {}),
    "correlation": (
        ArraySnapshot(CIRCLE, 1.0, n_snapshots=2),
        {"merge_correlation": 0.9, "tempering": 1.5, "max_snr_db": 25.0},
    ),
}


def measurements(model: ArraySnapshot, n_steps: int) -> Complex:
    """Return snapshots of three moving sources, of which one ends."""
    rng, t = np.random.default_rng(3), np.arange(n_steps)[:, None]
    doa = np.array([-0.6, 0.2, 0.9]) + 0.01 * t
    gain = np.where(t < n_steps // 2, np.ones(3), [1.0, 0.0, 1.0]) + 0j
    axes = len(model.shape) - 1  # of bins and snapshots
    gain = gain.reshape(n_steps, *(1,) * axes, 3) + np.zeros((*model.shape[:-1], 3))
    z: Complex = model.replace(noise=0.05).simulate(doa, gain, rng)
    return z


def assert_same(one: Run, other: Run) -> None:
    np.testing.assert_array_equal(one.iterations, other.iterations)
    np.testing.assert_array_equal(one.label, other.label)
    np.testing.assert_allclose(one.doa, other.doa, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.std, other.std, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.existence, other.existence, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.noise, other.noise, rtol=1e-9)


@pytest.fixture
def plain_python(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Import the compiled functions as they are, and use them."""
    monkeypatch.setattr(compiler, "compiler_error", lambda: "")
    monkeypatch.setattr(solver, "is_compiled", lambda choice, *_: choice == "auto")
    before = {name: sys.modules.pop(name) for name in KERNELS if name in sys.modules}
    yield
    for name in KERNELS:
        sys.modules.pop(name, None)
    sys.modules.update(before)


@pytest.mark.skipif(not HAS_NUMBA, reason="needs numba")
@pytest.mark.parametrize("kind", [SVALSE, VALSE])
@pytest.mark.parametrize("case", CASES)
def test_compiled_solver_equals_arrays(case: str, kind: type[VALSE]) -> None:
    model, settings = CASES[case]
    z = measurements(model, 6)
    one, other = (
        kind(model, solver=NewtonSolver(**settings, compiled=compiled)).run(z)
        for compiled in (True, False)
    )
    assert_same(one, other)


@pytest.mark.skipif(not HAS_NUMBA, reason="needs numba")
def test_compiled_solver_has_one_form_for_all_cases() -> None:
    """A second one, as of arrays that are read-only, would take 20 s to compile."""
    for model, settings in CASES.values():
        SVALSE(model, solver=NewtonSolver(**settings, compiled=True)).run(measurements(model, 2))
    solve = importlib.import_module("arrivals.trackers.svalse.newton.compiled.solve")
    assert len(solve.solve_all.signatures) == 1


@pytest.mark.usefixtures("plain_python")
@pytest.mark.parametrize("case", CASES)
def test_compiled_functions_in_plain_python_equal_arrays(case: str) -> None:
    model, settings = CASES[case]
    z = measurements(model, 2)
    ours = SVALSE(model, solver=NewtonSolver(**settings)).run(z)
    arrays = SVALSE(model, solver=NewtonSolver(**settings, compiled=False)).run(z)
    assert_same(ours, arrays)


@pytest.mark.skipif(not HAS_NUMBA, reason="needs numba")
def test_compiled_batch_equals_single_runs() -> None:
    model = CASES["line"][0]
    z = measurements(model, 8)
    sequences = [z, z[::-1], 2 * z]
    tracker = SVALSE(model, solver=NewtonSolver(compiled=True))
    for sequence, run in zip(sequences, tracker.run_batch(sequences), strict=True):
        alone = SVALSE(model, solver=NewtonSolver(compiled=True)).run(sequence)
        assert_same(alone, run)


@pytest.mark.skipif(not HAS_NUMBA, reason="needs numba")
def test_compiled_solver_with_few_iterations_equals_arrays() -> None:
    model = CASES["line"][0]
    z = measurements(model, 4)
    limits = [IterationLimits(inner=0, max_changes=4), IterationLimits()]
    for given, most in zip(limits, (500, 3), strict=True):
        one, other = (
            SVALSE(
                model, solver=NewtonSolver(limits=given, max_iterations=most, compiled=compiled)
            ).run(z)
            for compiled in (True, False)
        )
        assert_same(one, other)


def test_digest_changes_with_any_source_below(tmp_path: Path) -> None:
    (tmp_path / "part").mkdir()
    (tmp_path / "solve.py").write_text("whole = 1")
    (tmp_path / "part" / "step.py").write_text("STEP = 1")
    before = compiler.digest(tmp_path)
    assert compiler.digest(tmp_path) == before
    (tmp_path / "part" / "step.py").write_text("STEP = 2")
    assert compiler.digest(tmp_path) != before


@pytest.mark.skipif(not HAS_NUMBA, reason="needs numba")
def test_compiled_solver_is_kept_under_the_digest_of_its_sources() -> None:
    from arrivals.trackers.svalse.newton.compiled.solve import SOURCES, solve_all

    assert solve_all.__qualname__ == f"solve_all_{compiler.digest(SOURCES)}"


def test_compiled_required_without_kernel_names_the_case() -> None:
    sphere = ArraySnapshot(CIRCLE, 1.0, unknowns="sphere")
    with pytest.raises(ValueError, match=r'must be "auto" or False for manifolds of points'):
        SVALSE(sphere, solver=NewtonSolver(compiled=True))
    with pytest.raises(ValueError, match=r"for coordinate ascent; got True"):
        SVALSE(CASES["line"][0], solver=NewtonSolver(compiled=True), memory="posterior")


def test_compiled_of_another_value_is_refused() -> None:
    with pytest.raises(ValueError, match="compiled must be one of 'auto', True, False"):
        NewtonSolver(compiled="always")  # type: ignore[arg-type]


def test_broken_numba_warns_once_and_uses_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(selection, "kernel_error", lambda: "no LLVM")
    selection.is_compiled.cache_clear()
    selection.warn_of_compiler.cache_clear()
    manifold = CASES["line"][0].manifold()
    with pytest.warns(RuntimeWarning, match="numba cannot be used.*no LLVM"):
        assert not selection.is_compiled("auto", manifold)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not selection.is_compiled("auto", CASES["circle"][0].manifold())
    with pytest.raises(ValueError, match="without numba; got True: no LLVM"):
        selection.is_compiled(True, manifold)
    selection.is_compiled.cache_clear()
    selection.warn_of_compiler.cache_clear()


@pytest.mark.parametrize(
    ("installed", "error"),
    [
        (None, ""),
        (types.SimpleNamespace(__version__="0.50.1"), "numba must be at least 0.61; got 0.50.1"),
    ],
)
def test_numba_missing_or_too_old_is_an_error_text(
    monkeypatch: pytest.MonkeyPatch, installed: Any, error: str
) -> None:
    monkeypatch.setitem(sys.modules, "numba", installed)
    found = compiler.compiler_error.__wrapped__()
    assert found == error
