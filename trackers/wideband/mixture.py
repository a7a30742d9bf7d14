"""Variational mixture of tracked sources and diffuse sound over time-frequency bins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.trackers.wideband.bin_evidence import Single
from arrivals.trackers.wideband.density_grid import DensityGrid
from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.tracked_sources import TrackedSources
from arrivals.typing import Float

MIN_SHARE = 1e-4  # of the background and of each source while a mixture is fitted
MIN_DENSITY = 1e-12
MAX_BIRTH_SHARE = 1 - 1e-6
MAX_LOG_RATIO = 30.0  # of one bin over the mixture, for a new source


@dataclass(frozen=True, eq=False)
class Mixture:
    """Fitted mixture: component 0 is diffuse sound, with ℓ = 0 in every bin.

    Parameters
    ----------
    share : ndarray, shape (K + 1,)
        π, shares of the bins.
    density : ndarray, shape (K, n_points)
        q, posterior densities of the sources.
    level : ndarray, shape (n, K + 1)
        E_q ℓ of each counted bin.

    Examples
    --------
    >>> Mixture(np.array([0.5, 0.5]), np.ones((1, 1)), np.array([[0.0, 2.0]])).log_evidence.round(3)
    array([1.434])
    """

    share: Float
    density: Float
    level: Float

    @property
    def log_evidence(self) -> Float:
        """Log evidence m = ln Σ π exp E_q ℓ of each counted bin, (n,)."""
        return np.asarray(np.logaddexp.reduce(np.log(self.share) + self.level, axis=1))


def fit(evidence: Single, prior: Float, start: Float, settings: MixtureSettings) -> Mixture:
    """Fit shares, responsibilities and densities to the counted bins.

    Parameters
    ----------
    evidence : ndarray, shape (n, n_points)
        ℓ of the counted bins.
    prior, start : ndarray, shape (K, n_points)
        Prior densities p, and densities at the start.
    settings : MixtureSettings
        Settings.

    Returns
    -------
    Mixture
    """
    n, K, q = len(evidence), len(prior), start
    share = np.full(K + 1, (1 - settings.background) / max(K, 1))
    share[0] = settings.background if K else 1.0
    share = np.maximum(share, MIN_SHARE)
    level = np.zeros((n, K + 1))
    log_prior = np.log(prior + MIN_DENSITY)
    for _ in range(settings.iterations if K else 0):
        level[:, 1:] = evidence @ q.T.astype(np.float32)
        # r_ik ∝ π_k exp E_q ℓ_i
        w = np.log(share) + level
        r = np.exp(w - w.max(axis=1, keepdims=True))
        r /= r.sum(axis=1, keepdims=True)
        # π_k = mean_i r_ik
        share = np.maximum(r.mean(axis=0), MIN_SHARE)
        share /= share.sum()
        # q_k ∝ p_k exp(Σ_i r_ik ℓ_i / T)
        log_q = log_prior + (r[:, 1:].T.astype(np.float32) @ evidence) / settings.tempering
        q = np.exp(log_q - log_q.max(axis=1, keepdims=True))
        q /= q.sum(axis=1, keepdims=True)
    return Mixture(share, q, level)


def fit_with_births(
    evidence: Single, sources: TrackedSources, grid: DensityGrid, settings: MixtureSettings
) -> tuple[TrackedSources, Mixture]:
    """Fit the mixture, and add new sources while one explains the bins much better.

    Parameters
    ----------
    evidence : ndarray, shape (n, n_points)
        ℓ of the counted bins.
    sources : TrackedSources
        Predicted sources.
    grid : DensityGrid
        Directions of the points.
    settings : MixtureSettings
        Settings.

    Returns
    -------
    sources : TrackedSources
        With the new ones at the end; densities are still the prior ones.
    mixture : Mixture
        Its fit.
    """
    mixture = fit(evidence, sources.density, sources.density, settings)
    for _ in range(settings.max_births):
        if sources.n >= settings.max_sources + settings.max_births:
            break
        start = _birth_density(evidence, mixture, grid, settings)
        if start is None:
            break
        candidates = sources.with_new(settings.birth_existence)
        starts = np.concatenate([mixture.density, start[None]])
        fitted = fit(evidence, candidates.density, starts, settings)
        if fitted.share[-1] < settings.min_share:
            break
        sources, mixture = candidates, fitted
    return sources, mixture


def _birth_density(
    evidence: Single, mixture: Mixture, grid: DensityGrid, settings: MixtureSettings
) -> Float | None:
    """Return the density at which a new source starts; None if it explains too little."""
    # B(θ) = Σ_i ln(1 - c + c exp(ℓ_i(θ) - m_i)) / T
    c = np.float32(min(settings.birth_share, MAX_BIRTH_SHARE))
    over = evidence - mixture.log_evidence[:, None].astype(np.float32)
    over = np.exp(np.clip(over, -MAX_LOG_RATIO, MAX_LOG_RATIO))
    gain = np.log1p(c * (over - 1)).sum(axis=0, dtype=np.float64) / settings.tempering
    G = len(grid.doa)
    near = (grid.distance[mixture.density.argmax(axis=1) % G] < settings.merge).any(axis=0)
    gain.reshape(-1, G)[:, near] = -np.inf
    if gain.max() < settings.birth_evidence * np.log(len(gain)):
        return None
    peak = int(gain.argmax())  # of several new sources one at a time
    around = np.tile(grid.distance[peak % G] < max(settings.merge, grid.step), len(gain) // G)
    density = np.where(around, np.exp(gain - gain[peak]), 0.0)
    return np.asarray(density / density.sum())


def log_odds_gain(mixture: Mixture, prior: Float, tempering: float) -> Float:
    """Return by how much the step raises the log odds of each source's existence, (K,).

    The tempered evidence of the mixture over that of the mixture without the source, minus the
    divergence of its density.
    """
    w = np.log(mixture.share) + mixture.level
    total = np.logaddexp.reduce(w, axis=1)
    # ln Σ_{j != k} π_j exp E ℓ_j / (1 - π_k)
    with np.errstate(divide="ignore"):
        others = np.log1p(-np.minimum(np.exp(w[:, 1:] - total[:, None]), 1 - 1e-12))
    rest = total[:, None] + others - np.log1p(-mixture.share[1:])
    q = mixture.density
    divergence = (q * np.log((q + MIN_DENSITY) / (prior + MIN_DENSITY))).sum(axis=1)
    gain = (total[:, None] - rest).sum(axis=0) / tempering - divergence
    return np.asarray(gain)
