"""Evidence of bins and fits of the mixture, against sums written out."""

import numpy as np
import pytest

from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers.wideband.bin_evidence import (
    bin_evidence,
    mean_powers,
    scan_response,
    unit_snapshots,
)
from arrivals.trackers.wideband.direction_grid import DirectionGrid
from arrivals.trackers.wideband.mixture import Mixture, fit, fit_with_births, log_odds_gain
from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.support import updated
from arrivals.trackers.wideband.tracked_sources import TrackedSources
from arrivals.typing import Complex, Float

GRID = DirectionGrid(False, np.deg2rad(10.0))
MODEL = ArraySnapshot(
    SensorArray.uca(5, 0.3), [1.0, 1.3, 2.0], n_snapshots=4, noise_coherence="diffuse", white=0.2
)
SETTINGS = MixtureSettings(tempering=3.0)
ALL_BINS = np.ones(3, dtype=np.bool_)


def draw(seed: int = 0) -> Complex:
    rng = np.random.default_rng(seed)
    return MODEL.simulate([GRID.doa[7]], rng.exponential(size=(3, 4, 1)) * 3, rng)


def log_angular_gaussian(z: Complex, covariance: Complex) -> float:
    """Return the log density of the direction of z ~ CN(0, covariance), but for a constant."""
    log_det = np.linalg.slogdet(covariance)[1]
    return float(-log_det - len(z) * np.log((z.conj() @ np.linalg.solve(covariance, z)).real))


def test_evidence_is_the_ratio_of_two_angular_gaussians() -> None:
    z = draw()
    observed = MODEL.observe(z)
    assert observed is not None
    response = scan_response(observed.manifold, GRID, 3.0)
    unit, _ = unit_snapshots(observed.snapshots, observed.bins)
    found = bin_evidence(response, unit, np.ones((3, 4), dtype=bool)).reshape(3, 4, -1)
    a = MODEL.steering_vector(GRID.doa)  # (G, F, M)
    positions = MODEL.array.positions
    distance = np.linalg.norm(positions[:, None] - positions, axis=2)
    for f, wavelength in enumerate(MODEL.wavelengths):
        noise = 0.8 * np.sinc(2 * distance / wavelength) + 0.2 * np.eye(5)
        for g in (0, 7, 20):
            source = noise + 3.0 * np.outer(a[g, f], a[g, f].conj())
            expected = [
                log_angular_gaussian(y, source) - log_angular_gaussian(y, noise) for y in z[f]
            ]
            np.testing.assert_allclose(found[f, :, g], expected, rtol=2e-4, atol=2e-4)


def test_evidence_does_not_depend_on_the_level_of_a_bin() -> None:
    z, manifold = draw(), MODEL.angle_manifold()
    level = np.random.default_rng(1).exponential(size=(3, 4, 1)) * 1e50
    response, counted = scan_response(manifold, GRID, 3.0), np.ones((3, 4), dtype=bool)
    one, other = (
        bin_evidence(response, unit_snapshots(MODEL.observe(y).snapshots, ALL_BINS)[0], counted)  # type: ignore[union-attr]
        for y in (z, z * level)
    )
    np.testing.assert_allclose(one, other, atol=1e-4)


def random_evidence(seed: int, n: int = 30, K: int = 2) -> tuple[Float, Float]:
    rng = np.random.default_rng(seed)
    evidence = rng.normal(-1, 2, (n, len(GRID.doa)))
    return evidence.astype(np.float32), rng.dirichlet(np.ones(len(GRID.doa)), K)


def test_fit_is_the_three_updates_written_out() -> None:
    evidence, prior = random_evidence(0)
    found = fit(evidence, prior, prior, SETTINGS)  # type: ignore[arg-type]
    pi, q = np.array([0.3, 0.35, 0.35]), prior
    for _ in range(SETTINGS.iterations):
        level = np.array([[0.0, *(q @ row)] for row in evidence])
        r = np.array([pi * np.exp(row) / (pi @ np.exp(row)) for row in level])
        pi = r.mean(axis=0)
        q = np.array([p * np.exp((r[:, k + 1] @ evidence) / 3.0) for k, p in enumerate(prior)])
        q /= q.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(found.share, pi, rtol=1e-4)
    np.testing.assert_allclose(found.density, q, rtol=1e-3, atol=1e-6)


def test_gain_of_existence_is_the_loss_without_the_source() -> None:
    evidence, prior = random_evidence(1, K=3)
    mixture = fit(evidence, prior, prior, SETTINGS)  # type: ignore[arg-type]
    gain = log_odds_gain(mixture, prior, SETTINGS.tempering)
    for k in range(3):
        others = np.delete(np.arange(4), k + 1)
        share = mixture.share[others] / mixture.share[others].sum()
        less = np.log(np.exp(mixture.level[:, others]) @ share)
        q = mixture.density[k]
        expected = (mixture.log_evidence - less).sum() / 3.0 - (q * np.log(q / prior[k])).sum()
        assert gain[k] == pytest.approx(expected, rel=1e-4)


def strong(direction: int, n: int) -> Float:
    """Return bins that one direction explains, with a peak of some width."""
    distance = GRID.distance[direction] / np.deg2rad(10.0)
    return np.tile(4.0 - distance**2, (n, 1)).astype(np.float32)


def test_new_sources_are_found_where_bins_support_them_and_no_others() -> None:
    bins = np.concatenate([strong(5, 40), strong(25, 40), np.full((40, 36), -3.0)])
    none = TrackedSources.none(36)
    sources, mixture = fit_with_births(bins.astype(np.float32), none, GRID, SETTINGS)
    assert sorted(mixture.density.argmax(axis=1)) == [5, 25]
    np.testing.assert_allclose(mixture.share, 1 / 3, atol=0.03)
    kept, index = updated(sources, mixture, GRID, SETTINGS, 0.128)
    assert (kept.existence > 0.9).all()
    assert sorted(index) == [0, 1]
    quiet, _ = fit_with_births(np.full((40, 36), -3.0, np.float32), none, GRID, SETTINGS)
    assert quiet.n == 0


def test_of_two_sources_in_one_direction_the_one_with_a_label_is_kept() -> None:
    density = np.eye(36)[[5, 6]] * 0.9 + 0.1 / 36
    sources = TrackedSources(density, np.full(2, 0.9), np.array([-1, 4]), np.zeros(2))
    level = np.concatenate([np.zeros((30, 1)), np.full((30, 2), 3.0)], axis=1)
    mixture = Mixture(np.array([0.1, 0.6, 0.3]), density, level)
    kept, _ = updated(sources, mixture, GRID, SETTINGS, 0.128)
    assert kept.label.tolist() == [4]


def test_power_of_a_source_is_the_mean_over_its_bins_those_of_others_included() -> None:
    w = np.array([[3.0, 0, 0, 0], [0, 2.0, 0, 1.0], [0, 0, 0, 0]])
    z = MODEL.wave([GRID.doa[7]], w[..., None])
    Y = MODEL.angle_manifold().steering(GRID.doa[[7]])[0, :, :, 0][:, :, None] * w[:, None]
    unit, energy = unit_snapshots(Y, ALL_BINS)
    response = scan_response(MODEL.angle_manifold(), GRID, 3.0).at(np.array([7]))
    power = mean_powers(response, unit, energy, energy > 0, np.array([1e-6, 1 - 1e-6]))
    assert z.shape == MODEL.shape
    assert power[0] == pytest.approx((9 + 4 + 1) / 12, rel=1e-3)
