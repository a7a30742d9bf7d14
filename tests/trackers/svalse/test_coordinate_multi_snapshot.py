"""Coordinate ascent over several snapshots and bins, and posteriors on the circle."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import AngleManifold, ArraySnapshot, ElementResponse, SensorArray
from arrivals.measurement_models.observed import ObservedSnapshots
from arrivals.motion_models.bessel import bessel_ratios
from arrivals.scenarios import create
from arrivals.trackers.svalse.components import MERGE_DISTANCE, ComponentPrior
from arrivals.trackers.svalse.coordinate.circle_posterior import (
    CirclePrior,
    SeriesPrior,
    VonMisesPrior,
    circle_moments,
)
from arrivals.trackers.svalse.coordinate.multi_snapshot import MultiSnapshotAscent
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.typing import Complex, Float

CIRCLE = SensorArray.uca(7, radius=0.55)
MIXED = ElementResponse.first_order(2 * np.pi * np.arange(7) / 7, [0.5, 1, 0.5, 1, 0.7, 1, 0.5])
MODEL = ArraySnapshot(CIRCLE, [1.0, 1.2, 1.5], n_snapshots=4, response=MIXED, noise=0.05)
PRIOR = ComponentPrior(np.array([0.5, -2.0]), np.array([100.0, 20.0]), np.array([0.75, 0.1]), 0.1)


def simulated(seed: int, model: ArraySnapshot = MODEL) -> Complex:
    rng = np.random.default_rng(seed)
    w = rng.standard_normal((*model.shape[:-1], 3, 2)) @ np.array([1, 1j])
    return model.snapshots(model.simulate(rng.uniform(-3, 3, 3), w, rng))


def initialized(seed: int, sequential: bool = False, **changes: Any) -> MultiSnapshotAscent:
    model = MODEL.replace(**changes)
    prior = PRIOR if sequential else None
    Y = simulated(seed, model)
    state = MultiSnapshotAscent(CoordinateSolver(), Y, model.angle_manifold(), prior)
    state.initialize()
    return state


# support and amplitudes


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.booleans(), st.sampled_from([1.0, 4.0]))
def test_flip_changes_the_elbo_by_its_gain(seed: int, sequential: bool, tempering: float) -> None:
    state = initialized(seed, sequential)
    state.tempering = tempering
    state.choose_support()
    for k in np.random.default_rng(seed).permutation(len(state.rho)):
        before, gain = state.elbo(), state.gains()[k]
        if np.isfinite(gain):
            state.flip(int(k))
            assert state.elbo() - before == pytest.approx(gain, abs=1e-6 * max(1, abs(before)))


@pytest.mark.parametrize("seed", range(10))
def test_choose_support_ends_at_a_local_maximum_with_the_exact_amplitudes(seed: int) -> None:
    """Specification, section 11: three bins, four snapshots, unequal norms."""
    state = initialized(seed)
    state.choose_support()
    assert state.active.any()
    assert (state.gains() <= 1e-9).all()
    C, W = state.C.copy(), state.W.copy()
    state.update_amplitudes()
    np.testing.assert_allclose(state.C, C, atol=1e-12)
    np.testing.assert_allclose(state.W, W, atol=1e-10)


def test_update_variances_gives_the_maximum_of_the_elbo() -> None:
    """For given amplitudes: mean misfit and mean energy over the snapshots of a bin."""
    state = initialized(3)
    state.choose_support()
    W, C = state.W.copy(), state.C.copy()
    state.update_variances()
    on = np.flatnonzero(state.active)
    for f in range(3):
        A, w, c = state.A[f, on].T, W[f, on], C[f][np.ix_(on, on)]
        spread = np.diag(state.J[f]).real[on] - (np.abs(A) ** 2).sum(axis=0)
        misfit = (np.abs(state.Y[f] - A @ w) ** 2).sum()
        misfit += (spread * (np.abs(w) ** 2).sum(axis=1)).sum()
        misfit += 4 * np.trace(state.J[f][np.ix_(on, on)] @ c).real
        assert state.nu[f] == pytest.approx(misfit / (7 * 4), rel=1e-9)
        size = (np.abs(w) ** 2).sum() + 4 * c.trace().real
        assert state.tau[f] == pytest.approx(size / (4 * len(on)), rel=1e-9)


def test_update_variances_without_a_component_gives_the_power_and_respects_floors() -> None:
    state = initialized(4)
    state.active[:] = False
    state.update_variances()
    np.testing.assert_allclose(state.nu, (np.abs(state.Y) ** 2).mean(axis=(1, 2)))
    state.choose_support()
    state.power_floor, state.noise_floor = 1e6, 0.5
    state.update_variances()
    np.testing.assert_allclose(state.tau, 1e6 * state.nu / state.mean_norm)
    assert (state.nu >= 0.5 * (np.abs(state.Y) ** 2).mean(axis=(1, 2)) - 1e-12).all()


# angles


def dense(state: MultiSnapshotAscent, k: int, n: int = 4096) -> tuple[Float, Float]:
    """ln q(θ) of section 3 by steering vectors on a dense grid, and the grid."""
    theta = 2 * np.pi * np.arange(n) / n
    a = state.manifold.steering(theta)[0]  # (F, M, n)
    log_q = state.priors[k].at(theta)
    N = state.Y.shape[2]
    on = [i for i in np.flatnonzero(state.active) if i != k]
    for f in range(len(state.Y)):
        w = state.W[f]
        residual = state.Y[f] - state.A[f, on].T @ w[on]
        eta = residual @ w[k].conj() - N * state.A[f, on].T @ state.C[f, on, k]
        log_q = log_q + 2 / state.nu[f] * (eta.conj() @ a[f]).real
        power = (np.abs(w[k]) ** 2).sum() + N * state.C[f, k, k].real
        log_q = log_q - power / state.nu[f] * (np.abs(a[f]) ** 2).sum(axis=0)
    q = np.exp(log_q - log_q.max())
    return q / q.sum(), theta


@pytest.mark.parametrize("seed", range(4))
def test_update_angles_gives_the_moments_of_the_dense_posterior(seed: int) -> None:
    state = initialized(seed, sequential=True)
    state.choose_support()
    k = int(np.flatnonzero(state.active)[0])
    state.active[np.flatnonzero(state.active)[2:]] = False
    state.update_amplitudes()
    q, theta = dense(state, k)
    state.update_angles()
    mean = (q * np.exp(1j * theta)).sum()
    assert abs(state.mean[k] - mean) < 1e-7
    a = state.manifold.steering(theta)[0] @ q
    np.testing.assert_allclose(state.A[:, k], a, atol=1e-6)
    norm = (np.abs(state.manifold.steering(theta)[0]) ** 2).sum(axis=1) @ q
    np.testing.assert_allclose(state.norm[:, k], norm, rtol=1e-6)


def test_spectrum_is_the_exact_marginal_over_the_amplitudes() -> None:
    state = initialized(1)
    theta = np.linspace(-3, 3, 60)
    c = state.spectrum(state.Y)[0]
    series = (np.exp(1j * np.multiply.outer(theta, np.arange(len(c)))) @ c).real
    a = state.manifold.steering(theta)[0]
    log_q = np.zeros(60)
    for f in range(3):
        total = (np.abs(a[f]) ** 2).sum(axis=0) + state.nu[f] / state.tau[f]
        energy = (np.abs(a[f].conj().T @ state.Y[f]) ** 2).sum(axis=1)
        log_q += energy / (state.nu[f] * total) - 4 * np.log(total)
    np.testing.assert_allclose(series, log_q, atol=1e-3 * np.ptp(log_q))


class GeneralSolver(CoordinateSolver):
    """Coordinate ascent without the fast form for one snapshot."""

    def initial_state(
        self, snapshots: Complex, manifold: AngleManifold, prior: ComponentPrior | None
    ) -> MultiSnapshotAscent:
        """Return the general state."""
        return MultiSnapshotAscent(self, snapshots, manifold, prior)


@pytest.mark.parametrize("reference", ["middle", "first"])
def test_general_form_on_a_line_agrees_with_the_fast_form(reference: Any) -> None:
    """Specification, section 11: equal K and iterations, angles to 1e-14; tolerance 100 times."""
    trial = create("svalse_fig4", n_steps=6).sample(np.random.default_rng(1))
    settings: dict[str, Any] = {"merge": MERGE_DISTANCE, "snr_db": 20.0}
    manifold = trial.measurement.angle_manifold(reference)  # type: ignore[union-attr]
    prior = None
    for z in trial.measurements:
        Y = trial.measurement.snapshots(z)  # type: ignore[union-attr]
        fast = CoordinateSolver(**settings).solve(Y, manifold, prior)
        general = GeneralSolver(**settings).solve(Y, manifold, prior)
        assert general.iterations == fast.iterations
        assert general.active.tolist() == fast.active.tolist()
        on = general.active
        theta, kappa = general.theta[on], general.kappa[on]
        np.testing.assert_allclose(theta, fast.theta[on], atol=1e-10)
        np.testing.assert_allclose(general.amplitude, fast.amplitude, atol=1e-9)
        assert general.noise == pytest.approx(fast.noise, rel=1e-9)
        prior = ComponentPrior(theta, 0.5 * kappa, 0.75 * np.ones(on.sum()), 0.1)


# posteriors on the circle


def dense_moments(c: Complex, prior: CirclePrior, weights: Float, n_moments: int) -> Complex:
    n = 1 << 16
    theta = 2 * np.pi * np.arange(n) / n
    log_q = (c @ np.exp(1j * np.multiply.outer(np.arange(c.shape[1]), theta))).real
    log_q += prior.at(theta) + np.log(weights)[:, None]
    q = np.exp(log_q - log_q.max())
    d = np.exp(1j * np.multiply.outer(theta, np.arange(n_moments)))
    return np.asarray((q @ d) / q.sum())


PRIORS = {
    "uniform": VonMisesPrior(0j, False),
    "von mises": VonMisesPrior(30 * np.exp(2j), False),
    "front-back ambiguous": VonMisesPrior(30 * np.exp(1j), True),
}


@pytest.mark.parametrize("prior", PRIORS.values(), ids=PRIORS.keys())
@pytest.mark.parametrize("scale", [1.0, 30.0, 1000.0, 1e5])
@pytest.mark.parametrize("seed", [0, 1])
def test_circle_moments_agree_with_a_dense_sum(prior: CirclePrior, scale: float, seed: int) -> None:
    """Specification, section 3: grid and windows agree with it to 1e-13."""
    rng = np.random.default_rng(seed)
    c = scale * (rng.normal(size=(3, 12, 2)) @ np.array([1, 1j])) / np.arange(1, 13) + 0j
    weights = np.array([0.5, 0.3, 0.2])
    moments, mean = circle_moments(c, prior, weights, 15)
    expected = dense_moments(c, prior, weights, 15)
    np.testing.assert_allclose(moments, expected, atol=1e-9)
    assert abs(mean - expected[:, 1].sum()) < 1e-9


@pytest.mark.parametrize("scale", [1e3, 1e7])
def test_mean_of_a_front_back_ambiguous_angle_is_that_of_its_front(scale: float) -> None:
    """ln q = -scale (sin θ - sin β)², by its harmonics."""
    beta = np.deg2rad(40.0)
    c = np.array([[0, -2j * scale * np.sin(beta), scale / 2]])
    E, mean = circle_moments(c, VonMisesPrior(0j, True), np.ones(1), 20, front_only=True)
    assert np.angle(mean) == pytest.approx(beta, abs=2e-3)
    assert abs(E[0, 1].real) < 1e-9  # both halves have the same weight
    assert abs(mean) == pytest.approx(1 - 1 / (4 * scale * np.cos(beta) ** 2), abs=0.1 / scale)


def test_series_prior_is_the_density_of_its_moments() -> None:
    kappa, mu = 40.0, 1.3
    moments = bessel_ratios(80, kappa) * np.exp(1j * np.arange(81) * mu)
    series, exact = SeriesPrior(moments, kappa), VonMisesPrior(kappa * np.exp(1j * mu), False)
    theta = np.linspace(mu - 0.4, mu + 0.4, 9)
    offset = series.at(theta) - exact.at(theta)
    np.testing.assert_allclose(offset, offset[4], atol=1e-2)
    offset = series.on_grid(1024)[180:240] - exact.on_grid(1024)[180:240]
    np.testing.assert_allclose(offset, offset[30], atol=1e-2)
    assert series.at(np.array([mu + np.pi]))[0] == pytest.approx(np.log(1e-5), abs=0.1)


# missing data


def test_observed_snapshots_exclude_bins_then_snapshots_then_sensors() -> None:
    Y = np.ones((3, 4, 5), dtype=complex)
    Y[0] = np.nan
    Y[:, :, 2] = np.nan
    Y[1, 3, 0] = np.nan
    Y[2] *= 0
    observed = ObservedSnapshots.from_measurement(Y)
    assert observed.bins.tolist() == [False, True, False]  # the last one has no power
    assert observed.sensors.tolist() == [True, True, True, False]
    assert observed.times.tolist() == [True, True, False, True, True]
    assert observed.snapshots.shape == (1, 3, 4)
    assert ObservedSnapshots.from_measurement(np.zeros((2, 3, 1), dtype=complex)).bins.all()


def test_observed_snapshots_without_a_common_sensor_are_refused() -> None:
    Y = np.ones((1, 3, 3), dtype=complex)
    Y[0, [0, 1, 2], [0, 1, 2]] = np.nan
    with pytest.raises(
        ValueError, match="at most 2 of 3 sensors at once, each with a NaN elsewhere"
    ):
        ObservedSnapshots.from_measurement(Y)
