"""Change of the ELBO by every flip, update and iteration of coordinate ascent."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import toeplitz

from arrivals.measurement_models import AngleManifold, ArraySnapshot, SensorArray
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.trackers.svalse.coordinate.single_snapshot import SingleSnapshotAscent
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.trackers.svalse.noise_initialization import autocorrelation
from arrivals.typing import Complex, Float

ARRAY = SensorArray.ula(11, spacing=0.5)
MODEL = ArraySnapshot(ARRAY, wavelength=1.0, noise=0.05)
PRIOR = ComponentPrior(np.array([0.5, -1.0]), np.array([100.0, 20.0]), np.array([0.75, 0.1]), 0.1)


def snapshot(seed: int, array: SensorArray = ARRAY) -> Complex:
    rng = np.random.default_rng(seed)
    model = ArraySnapshot(array, wavelength=1.0, noise=0.05)
    amplitude = rng.standard_normal((4, 2)) @ np.array([1, 1j])
    return model.simulate(rng.uniform(-1.2, 1.2, 4), amplitude, rng)[None, :, None]


def initialized(
    seed: int, prior: ComponentPrior | None = None, manifold: AngleManifold | None = None
) -> RecordingAscent:
    """State after initialization and the first selection of the support."""
    manifold = manifold or MODEL.angle_manifold()
    state = RecordingAscent(CoordinateSolver(), snapshot(seed), manifold, prior)
    state.initialize()
    state.choose_support()
    return state


class RecordingAscent(SingleSnapshotAscent):
    """State that records the exponents of its angles' densities."""

    def __init__(
        self,
        settings: CoordinateSolver,
        Y: Complex,
        manifold: AngleManifold,
        prior: ComponentPrior | None,
    ) -> None:
        super().__init__(settings, Y, manifold, prior)
        self.exponents: list[Complex] = []
        posterior = self.posterior

        def record(c: Complex) -> tuple[Complex, complex]:
            self.exponents.append(c.copy())
            return posterior(c)

        self.posterior = record


def divergence(c: Complex, prior: complex) -> float:
    """KL divergence of exp(Re Σ c exp(jiθ)) from the von Mises density of parameter `prior`."""
    n = 1 << 14
    theta = 2 * np.pi * np.arange(n) / n
    log_q = (np.exp(1j * np.multiply.outer(theta, np.arange(1, len(c)))) @ c[1:]).real
    log_p = (np.conj(prior) * np.exp(1j * theta)).real
    log_q -= log_q.max() + np.log(np.exp(log_q - log_q.max()).mean() * 2 * np.pi)
    log_p -= log_p.max() + np.log(np.exp(log_p - log_p.max()).mean() * 2 * np.pi)
    return float((np.exp(log_q) * (log_q - log_p)).mean() * 2 * np.pi)


def full_elbo(state: SingleSnapshotAscent, divergences: Float) -> float:
    """The whole bound for any w and C, written out from the model, sections 2 and 5."""
    on = np.flatnonzero(state.active)
    y, nu, tau = state.Y[0, :, 0], state.nu[0], state.tau[0]
    K, M = len(on), len(y)
    A, w, C = state.A[0, on], state.W[0, on, 0], state.C[0][np.ix_(on, on)]
    J = A.conj() @ A.T
    np.fill_diagonal(J, M)
    misfit = np.linalg.norm(y) ** 2 - 2 * np.vdot(A.conj() @ y, w).real
    misfit += np.vdot(w, J @ w).real + np.trace(J @ C).real
    size = np.vdot(w, w).real + C.trace().real
    likelihood = -M * np.log(np.pi * nu) - misfit / nu
    amplitudes = -K * np.log(np.pi * tau) - size / tau
    entropy = K * np.log(np.pi * np.e) + np.linalg.slogdet(C)[1]
    return float(likelihood + amplitudes + entropy - divergences.sum())


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.booleans())
def test_flip_changes_the_elbo_by_its_gain(seed: int, sequential: bool) -> None:
    state = initialized(seed, PRIOR if sequential else None)
    rng = np.random.default_rng(seed)
    for k in rng.permutation(len(state.rho)):
        before, gain = state.elbo(), state.gains()[k]
        if np.isfinite(gain):
            state.flip(int(k))
            assert state.elbo() - before == pytest.approx(gain, abs=1e-6 * max(1, abs(before)))


@pytest.mark.parametrize("seed", range(20))
def test_choose_support_ends_at_a_local_maximum_with_the_exact_amplitudes(seed: int) -> None:
    state = initialized(seed)
    assert (state.gains() <= 1e-9).all()
    C, W = state.C.copy(), state.W.copy()
    state.update_amplitudes()
    np.testing.assert_allclose(state.C, C, atol=1e-12)
    np.testing.assert_allclose(state.W, W, atol=1e-10)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6), st.booleans(), st.sampled_from(["middle", "first"]))
def test_elbo_of_a_fixed_support_never_decreases(
    seed: int, sequential: bool, reference: Literal["middle", "first"]
) -> None:
    state = initialized(seed, PRIOR if sequential else None, MODEL.angle_manifold(reference))
    on = np.flatnonzero(state.active)
    bounds = []
    for _ in range(12):
        state.exponents.clear()
        state.update_angles()
        cost = np.array(
            [divergence(c, state.eta[k]) for c, k in zip(state.exponents, on, strict=True)]
        )
        bounds.append(full_elbo(state, cost))
        state.update_amplitudes()
        bounds.append(full_elbo(state, cost))
        state.update_variances()
        bounds.append(full_elbo(state, cost))
    assert np.diff(bounds).min() > -1e-6


def test_updated_variances_are_stationary_points_of_the_elbo() -> None:
    state = initialized(3, PRIOR)
    state.update_variances()
    none = np.zeros(0)
    top = full_elbo(state, none)
    for name in ("nu", "tau"):
        best = getattr(state, name)
        for factor in (0.97, 1.03):
            setattr(state, name, best * factor)
            assert full_elbo(state, none) < top
        setattr(state, name, best)


def test_update_variances_without_a_component_keeps_both() -> None:
    """Section 6: skip both when K = 0."""
    state = initialized(3)
    nu, tau = state.nu.copy(), state.tau.copy()
    state.active[:] = False
    state.update_variances()
    assert (state.nu, state.tau) == (nu, tau)


def test_paper_is_the_published_program() -> None:
    solver = CoordinateSolver.paper()
    assert (solver.posterior, solver.tolerance, solver.max_iterations) == ("mixture", 1e-6, 5000)
    prior = ComponentPrior(np.zeros(0), np.zeros(0), np.zeros(0), 0.1, snr_db=20.0)
    assert solver.merge_distance(prior is not None) == np.deg2rad(1.5)
    assert (solver.initial_snr_db(prior), solver.initial_snr_db(None)) == (20.0, None)


def test_first_existence_is_held_and_divides_the_power_where_no_component_is_tracked() -> None:
    """Section VI.B: p = 0.5 at first, τ = (‖y‖²/M - ν)/(p L)."""
    printed = CoordinateSolver.paper(first_existence=0.5)
    state = printed.initial_state(snapshot(1), MODEL.angle_manifold(), None)
    power = float((np.abs(snapshot(1)) ** 2).mean())
    np.testing.assert_allclose(state.rho, 0.5)
    np.testing.assert_allclose(state.tau, (power - state.nu) / (0.5 * len(state.rho)))
    state.active[0] = True
    state.update_rho()
    np.testing.assert_allclose(state.rho, 0.5)
    program = CoordinateSolver.paper().initial_state(snapshot(1), MODEL.angle_manifold(), None)
    assert program.rho[0] == (len(program.rho) // 2) / len(program.rho)
    tracked = printed.initial_state(snapshot(1), MODEL.angle_manifold(), PRIOR)
    np.testing.assert_array_equal(tracked.rho[: len(PRIOR.existence)], PRIOR.existence)


@pytest.mark.parametrize("value", [0.0, 1.0, float("nan")])
def test_first_existence_is_a_probability_that_leaves_both_possible(value: float) -> None:
    with pytest.raises(ValueError, match=r"first_existence must (lie in \(0, 1\)|be)"):
        CoordinateSolver(first_existence=value)


def test_mixture_with_a_noise_floor_is_the_mixture_of_the_fast_form() -> None:
    """A floor far below the noise changes the form of the state, but not the result."""
    fast = CoordinateSolver(posterior="mixture", snr_db=20.0)
    general = fast.replace(max_snr_db=80.0)
    a, b = (each.solve(snapshot(1), MODEL.angle_manifold(), PRIOR) for each in (fast, general))
    assert isinstance(
        fast.initial_state(snapshot(1), MODEL.angle_manifold(), PRIOR), SingleSnapshotAscent
    )
    assert a.active.tolist() == b.active.tolist()
    np.testing.assert_allclose(a.theta[a.active], b.theta[b.active], atol=1e-3)


def test_autocorrelation_of_a_line_with_gaps_is_that_of_its_grid() -> None:
    places = np.array([3, 0, 7, 4])
    z = np.array([1 + 1j, 2, -1j, 0.5])
    grid = np.zeros(8, dtype=complex)
    grid[places] = z
    lags = [np.vdot(grid[: 8 - i], grid[i:]) for i in range(8)]
    np.testing.assert_allclose(autocorrelation(z, places), lags, atol=1e-12)


def test_initial_noise_without_a_prior_is_the_mean_of_the_small_eigenvalues() -> None:
    Y = snapshot(5)
    y = Y[0, :, 0]
    lags = np.array([np.vdot(y[: 11 - i], y[i:]) for i in range(11)]) / 11
    smallest = np.linalg.eigvalsh(toeplitz(lags))[:2]
    state = CoordinateSolver().initial_state(Y, MODEL.angle_manifold(), None)
    assert state.nu[0] == pytest.approx(smallest.mean())
