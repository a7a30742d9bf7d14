"""Exact laws of the ascent: what every flip, every update and every iteration does to the ELBO."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, Manifold, SensorArray
from arrivals.trackers.svalse.components import ComponentPrior
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver, SingleSnapshotAscent
from arrivals.trackers.svalse.noise_initialization import autocorrelation
from arrivals.typing import Complex, Float

ARRAY = SensorArray.ula(11, spacing=0.5)
MODEL = ArraySnapshot(ARRAY, wavelength=1.0, noise=0.05)
KNOWN = ComponentPrior(np.array([0.5, -1.0]), np.array([100.0, 20.0]), np.array([0.75, 0.1]), 0.1)


def snapshot(seed: int, array: SensorArray = ARRAY) -> Complex:
    rng = np.random.default_rng(seed)
    model = ArraySnapshot(array, wavelength=1.0, noise=0.05)
    amplitude = rng.standard_normal((4, 2)) @ np.array([1, 1j])
    return model.simulate(rng.uniform(-1.2, 1.2, 4), amplitude, rng)


class Watched(SingleSnapshotAscent):
    """An ascent that remembers the exponents of its angles' densities."""

    def __init__(
        self,
        settings: CoordinateSolver,
        y: Complex,
        manifold: Manifold,
        known: ComponentPrior | None,
    ) -> None:
        super().__init__(settings, y, manifold, known)
        self.exponents: list[Complex] = []
        integrate = self.integrate

        def remember(c: Complex) -> tuple[Complex, complex]:
            self.exponents.append(c.copy())
            return integrate(c)

        self.integrate = remember


def divergence(c: Complex, prior: complex) -> float:
    """KL divergence of exp(Re Σ c exp(jiθ)) from the von Mises density of parameter `prior`."""
    n = 1 << 14
    theta = 2 * np.pi * np.arange(n) / n
    log_q = (np.exp(1j * np.multiply.outer(theta, np.arange(1, len(c)))) @ c[1:]).real
    log_p = (np.conj(prior) * np.exp(1j * theta)).real
    log_q -= log_q.max() + np.log(np.exp(log_q - log_q.max()).mean() * 2 * np.pi)
    log_p -= log_p.max() + np.log(np.exp(log_p - log_p.max()).mean() * 2 * np.pi)
    return float((np.exp(log_q) * (log_q - log_p)).mean() * 2 * np.pi)


def full_elbo(step: Watched, divergences: Float) -> float:
    """The whole bound for any w and C, written out from the model, sections 2 and 5."""
    on = np.flatnonzero(step.active)
    K, M = len(on), len(step.y)
    A, w, C = step.A[on], step.w[on], step.C[np.ix_(on, on)]
    J = A.conj() @ A.T
    np.fill_diagonal(J, M)
    misfit = np.linalg.norm(step.y) ** 2 - 2 * np.vdot(A.conj() @ step.y, w).real
    misfit += np.vdot(w, J @ w).real + np.trace(J @ C).real
    size = np.vdot(w, w).real + C.trace().real
    likelihood = -M * np.log(np.pi * step.nu) - misfit / step.nu
    amplitudes = -K * np.log(np.pi * step.tau) - size / step.tau
    entropy = K * np.log(np.pi * np.e) + np.linalg.slogdet(C)[1]
    return float(likelihood + amplitudes + entropy - divergences.sum())


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.booleans())
def test_each_flip_changes_the_elbo_by_exactly_its_delta(seed: int, sequential: bool) -> None:
    step = CoordinateSolver().step(snapshot(seed), MODEL.manifold(), KNOWN if sequential else None)
    step.start()
    step.choose_support()
    rng = np.random.default_rng(seed)
    for k in rng.permutation(len(step.w)):
        before, delta = step.elbo(), step.deltas()[k]
        if np.isfinite(delta):
            step.flip(int(k))
            assert step.elbo() - before == pytest.approx(delta, abs=1e-6 * max(1, abs(before)))


def test_the_search_ends_where_no_single_flip_gains_and_solves_the_normal_equations() -> None:
    for seed in range(20):
        step = CoordinateSolver().step(snapshot(seed), MODEL.manifold(), None)
        step.start()
        step.choose_support()
        assert (step.deltas() <= 1e-9).all()
        C, w = step.C.copy(), step.w.copy()
        step.solve()
        np.testing.assert_allclose(step.C, C, atol=1e-12)
        np.testing.assert_allclose(step.w, w, atol=1e-10)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6), st.booleans(), st.sampled_from(["middle", "first"]))
def test_with_the_support_held_the_elbo_never_falls(
    seed: int, sequential: bool, reference: str
) -> None:
    known = KNOWN if sequential else None
    manifold = MODEL.manifold("first" if reference == "first" else "middle")
    step = Watched(CoordinateSolver(), snapshot(seed), manifold, known)
    step.start()
    step.choose_support()
    on = np.flatnonzero(step.active)
    bounds = []
    for _ in range(12):
        step.exponents.clear()
        step.refine_angles()
        cost = np.array(
            [divergence(c, step.prior[k]) for c, k in zip(step.exponents, on, strict=True)]
        )
        bounds.append(full_elbo(step, cost))
        step.solve()
        bounds.append(full_elbo(step, cost))
        step.learn_variances()
        bounds.append(full_elbo(step, cost))
    assert np.diff(bounds).min() > -1e-6


def test_noise_and_power_are_stationary_points_of_the_elbo() -> None:
    step = Watched(CoordinateSolver(), snapshot(3), MODEL.manifold(), KNOWN)
    step.start()
    step.choose_support()
    step.learn_variances()
    top, none = full_elbo(step, np.zeros(0)), np.zeros(0)
    for name in ("nu", "tau"):
        best = getattr(step, name)
        for factor in (0.97, 1.03):
            setattr(step, name, best * factor)
            assert full_elbo(step, none) < top
        setattr(step, name, best)


def test_lags_of_a_line_with_gaps_are_those_of_its_grid() -> None:
    places = np.array([3, 0, 7, 4])
    z = np.array([1 + 1j, 2, -1j, 0.5])
    grid = np.zeros(8, dtype=complex)
    grid[places] = z
    lags = [np.vdot(grid[: 8 - i], grid[i:]) for i in range(8)]
    np.testing.assert_allclose(autocorrelation(z, places), lags, atol=1e-12)


def test_silent_start_of_the_noise_is_the_mean_of_the_small_eigenvalues() -> None:
    y = snapshot(5)
    lags = np.array([np.vdot(y[: 11 - i], y[i:]) for i in range(11)]) / 11
    from scipy.linalg import toeplitz

    smallest = np.linalg.eigvalsh(toeplitz(lags))[:2]
    step = CoordinateSolver(snr_db=None).step(y, MODEL.manifold(), None)
    assert step.nu == pytest.approx(smallest.mean())
