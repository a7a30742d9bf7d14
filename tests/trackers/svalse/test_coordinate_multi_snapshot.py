"""Exact laws of the ascent over several looks, and of the posteriors on the circle."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arrivals.measurement_models import ArraySnapshot, ElementResponse, SensorArray
from arrivals.measurement_models.observed import ObservedSnapshots
from arrivals.scenarios import create
from arrivals.trackers.svalse.components import MERGE_DISTANCE, ComponentPrior
from arrivals.trackers.svalse.coordinate.circle_posterior import (
    CirclePrior,
    SeriesPrior,
    VonMisesPrior,
    grid_moments,
)
from arrivals.trackers.svalse.coordinate.multi_amplitudes import MultiSnapshotAmplitudes
from arrivals.trackers.svalse.coordinate.multi_snapshot import MultiSnapshotAscent
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.typing import Complex, Float

CIRCLE = SensorArray.uca(7, radius=0.55)
MIXED = ElementResponse.first_order(2 * np.pi * np.arange(7) / 7, [0.5, 1, 0.5, 1, 0.7, 1, 0.5])
MODEL = ArraySnapshot(CIRCLE, [1.0, 1.2, 1.5], n_snapshots=4, response=MIXED, noise=0.05)
KNOWN = ComponentPrior(np.array([0.5, -2.0]), np.array([100.0, 20.0]), np.array([0.75, 0.1]), 0.1)


def looks(seed: int, model: ArraySnapshot = MODEL) -> Complex:
    rng = np.random.default_rng(seed)
    w = rng.standard_normal((*model.shape[:-1], 3, 2)) @ np.array([1, 1j])
    return model.looks(model.simulate(rng.uniform(-3, 3, 3), w, rng))


def started(seed: int, sequential: bool = False, **changes: Any) -> MultiSnapshotAscent:
    model = MODEL.replace(**changes)
    known = KNOWN if sequential else None
    ascent = MultiSnapshotAscent(CoordinateSolver(), looks(seed, model), model.manifold(), known)
    ascent.start()
    return ascent


# support and amplitudes


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.booleans(), st.sampled_from([1.0, 4.0]))
def test_each_flip_changes_the_elbo_by_exactly_its_delta(
    seed: int, sequential: bool, temper: float
) -> None:
    step = started(seed, sequential)
    step.temper = temper
    step.choose_support()
    for k in np.random.default_rng(seed).permutation(len(step.rho)):
        before, delta = step.elbo(), step.deltas()[k]
        if np.isfinite(delta):
            step.flip(int(k))
            assert step.elbo() - before == pytest.approx(delta, abs=1e-6 * max(1, abs(before)))


@pytest.mark.parametrize("seed", range(10))
def test_the_search_ends_where_no_single_flip_gains_and_solves_the_normal_equations(
    seed: int,
) -> None:
    """Specification, section 11: three bins, four snapshots, unequal norms."""
    step = started(seed)
    step.choose_support()
    assert step.active.any()
    assert (step.deltas() <= 1e-9).all()
    C, W = step.C.copy(), step.W.copy()
    step.solve()
    np.testing.assert_allclose(step.C, C, atol=1e-12)
    np.testing.assert_allclose(step.W, W, atol=1e-10)


def test_variances_are_where_the_elbo_is_highest() -> None:
    """For given amplitudes: the misfit and the size that the ELBO sees, over the looks of a bin."""
    step = started(3)
    step.choose_support()
    W, C = step.W.copy(), step.C.copy()
    MultiSnapshotAmplitudes.learn_variances(step)
    on = np.flatnonzero(step.active)
    for f in range(3):
        A, w, c = step.A[f, on].T, W[f, on], C[f][np.ix_(on, on)]
        spread = np.diag(step.J[f]).real[on] - (np.abs(A) ** 2).sum(axis=0)
        misfit = (np.abs(step.Y[f] - A @ w) ** 2).sum()
        misfit += (spread * (np.abs(w) ** 2).sum(axis=1)).sum()
        misfit += 4 * np.trace(step.J[f][np.ix_(on, on)] @ c).real
        assert step.nu[f] == pytest.approx(misfit / (7 * 4), rel=1e-9)
        size = (np.abs(w) ** 2).sum() + 4 * c.trace().real
        assert step.tau[f] == pytest.approx(size / (4 * len(on)), rel=1e-9)


def test_without_a_component_all_is_noise_and_floors_hold() -> None:
    step = started(4)
    step.active[:] = False
    MultiSnapshotAmplitudes.learn_variances(step)
    np.testing.assert_allclose(step.nu, (np.abs(step.Y) ** 2).mean(axis=(1, 2)))
    step.choose_support()
    step.power_floor, step.noise_floor = 1e6, 0.5
    MultiSnapshotAmplitudes.learn_variances(step)
    np.testing.assert_allclose(step.tau, 1e6 * step.nu / step.mean_norm)
    assert (step.nu >= 0.5 * (np.abs(step.Y) ** 2).mean(axis=(1, 2)) - 1e-12).all()


# angles


def dense(step: MultiSnapshotAscent, k: int, n: int = 4096) -> tuple[Float, Float]:
    """ln q(θ) of section 3 by steering vectors on a dense grid, and the grid."""
    theta = 2 * np.pi * np.arange(n) / n
    a = step.manifold.steering(theta)[0]  # (F, M, n)
    log_q = step.priors[k].at(theta)
    N = step.Y.shape[2]
    on = [i for i in np.flatnonzero(step.active) if i != k]
    for f in range(len(step.Y)):
        w = step.W[f]
        rest = step.Y[f] - step.A[f, on].T @ w[on]
        eta = rest @ w[k].conj() - N * step.A[f, on].T @ step.C[f, on, k]
        log_q = log_q + 2 / step.nu[f] * (eta.conj() @ a[f]).real
        power = (np.abs(w[k]) ** 2).sum() + N * step.C[f, k, k].real
        log_q = log_q - power / step.nu[f] * (np.abs(a[f]) ** 2).sum(axis=0)
    q = np.exp(log_q - log_q.max())
    return q / q.sum(), theta


@pytest.mark.parametrize("seed", range(4))
def test_the_posterior_of_an_angle_is_that_of_the_model(seed: int) -> None:
    step = started(seed, sequential=True)
    step.choose_support()
    k = int(np.flatnonzero(step.active)[0])
    step.active[np.flatnonzero(step.active)[2:]] = False
    step.solve()
    q, theta = dense(step, k)
    step.refine_angles()
    mean = (q * np.exp(1j * theta)).sum()
    assert abs(step.mean[k] - mean) < 1e-7
    a = step.manifold.steering(theta)[0] @ q
    np.testing.assert_allclose(step.A[:, k], a, atol=1e-6)
    norm = (np.abs(step.manifold.steering(theta)[0]) ** 2).sum(axis=1) @ q
    np.testing.assert_allclose(step.norm[:, k], norm, rtol=1e-6)


def test_a_fresh_component_starts_from_the_exact_marginal_of_the_looks() -> None:
    step = started(1)
    theta = np.linspace(-3, 3, 60)
    c = step.spectrum(step.Y)[0]
    found = (np.exp(1j * np.multiply.outer(theta, np.arange(len(c)))) @ c).real
    a = step.manifold.steering(theta)[0]
    log_q = np.zeros(60)
    for f in range(3):
        total = (np.abs(a[f]) ** 2).sum(axis=0) + step.nu[f] / step.tau[f]
        energy = (np.abs(a[f].conj().T @ step.Y[f]) ** 2).sum(axis=1)
        log_q += energy / (step.nu[f] * total) - 4 * np.log(total)
    np.testing.assert_allclose(found, log_q, atol=1e-3 * np.ptp(log_q))


@pytest.mark.parametrize("reference", ["middle", "first"])
def test_on_a_line_it_is_the_ascent_of_the_paper(reference: Any) -> None:
    """Specification, section 11: equal K and iterations, angles to 1e-14; tolerance 100 times."""
    trial = create("svalse_fig4", n_steps=6).sample(np.random.default_rng(1))
    settings = CoordinateSolver(merge=MERGE_DISTANCE, snr_db=20.0)
    manifold = trial.measurement.manifold(reference)  # type: ignore[union-attr]
    known = None
    for z in trial.measurements:
        Y = trial.measurement.looks(z)  # type: ignore[union-attr]
        short = settings.solve(Y, manifold, known)
        fit = settings.iterate(MultiSnapshotAscent(settings, Y, manifold, known), MERGE_DISTANCE)
        assert fit.iterations == short.iterations
        assert fit.active.tolist() == short.active.tolist()
        on = fit.active
        np.testing.assert_allclose(fit.theta[on], short.theta[on], atol=1e-10)
        np.testing.assert_allclose(fit.amplitude, short.amplitude, atol=1e-9)
        assert fit.noise == pytest.approx(short.noise, rel=1e-9)
        known = ComponentPrior(fit.theta[on], 0.5 * fit.kappa[on], 0.75 * np.ones(on.sum()), 0.1)


# posteriors on the circle


def brute(c: Complex, prior: CirclePrior, weights: Float, n_moments: int) -> Complex:
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
    "mirrored": VonMisesPrior(30 * np.exp(1j), True),
}


@pytest.mark.parametrize("prior", PRIORS.values(), ids=PRIORS.keys())
@pytest.mark.parametrize("scale", [1.0, 30.0, 1000.0, 1e5])
@pytest.mark.parametrize("seed", [0, 1])
def test_moments_are_those_of_a_dense_sum(prior: CirclePrior, scale: float, seed: int) -> None:
    """Specification, section 3: grid and windows agree with it to 1e-13."""
    rng = np.random.default_rng(seed)
    c = scale * (rng.normal(size=(3, 12, 2)) @ np.array([1, 1j])) / np.arange(1, 13) + 0j
    weights = np.array([0.5, 0.3, 0.2])
    found, mean = grid_moments(c, prior, weights, 15)
    expected = brute(c, prior, weights, 15)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert abs(mean - expected[:, 1].sum()) < 1e-9


@pytest.mark.parametrize("scale", [1e3, 1e7])
def test_the_mean_of_a_mirrored_angle_is_that_of_its_front(scale: float) -> None:
    """ln q = -scale (sin θ - sin β)², by its harmonics."""
    beta = np.deg2rad(40.0)
    c = np.array([[0, -2j * scale * np.sin(beta), scale / 2]])
    E, mean = grid_moments(c, VonMisesPrior(0j, True), np.ones(1), 20, mirror=True)
    assert np.angle(mean) == pytest.approx(beta, abs=2e-3)
    assert abs(E[0, 1].real) < 1e-9  # both halves alike
    assert abs(mean) == pytest.approx(1 - 1 / (4 * scale * np.cos(beta) ** 2), abs=0.1 / scale)


def test_a_series_prior_is_the_density_of_its_moments() -> None:
    from arrivals.motion_models.bessel import bessel_ratios

    kappa, mu = 40.0, 1.3
    moments = bessel_ratios(80, kappa) * np.exp(1j * np.arange(81) * mu)
    series, exact = SeriesPrior(moments, kappa), VonMisesPrior(kappa * np.exp(1j * mu), False)
    theta = np.linspace(mu - 0.4, mu + 0.4, 9)
    offset = series.at(theta) - exact.at(theta)
    np.testing.assert_allclose(offset, offset[4], atol=1e-2)
    offset = series.on_grid(1024)[180:240] - exact.on_grid(1024)[180:240]
    np.testing.assert_allclose(offset, offset[30], atol=1e-2)
    assert series.at(np.array([mu + np.pi]))[0] == pytest.approx(np.log(1e-5), abs=0.1)


# what was heard


def test_gaps_leave_out_bins_then_snapshots_then_sensors() -> None:
    Y = np.ones((3, 4, 5), dtype=complex)
    Y[0] = np.nan
    Y[:, :, 2] = np.nan
    Y[1, 3, 0] = np.nan
    Y[2] *= 0
    observed = ObservedSnapshots.of(Y)
    assert observed.bins.tolist() == [False, True, False]  # the last one is silent
    assert observed.sensors.tolist() == [True, True, True, False]
    assert observed.times.tolist() == [True, True, False, True, True]
    assert observed.snapshots.shape == (1, 3, 4)
    assert ObservedSnapshots.of(np.zeros((2, 3, 1), dtype=complex)).bins.all()


def test_sensors_that_take_turns_in_being_silent_are_refused() -> None:
    Y = np.ones((1, 3, 3), dtype=complex)
    Y[0, [0, 1, 2], [0, 1, 2]] = np.nan
    with pytest.raises(
        ValueError, match="at most 2 of 3 sensors at once, each with a NaN elsewhere"
    ):
        ObservedSnapshots.of(Y)
