"""Kalman filter of one interval, and the statistics for the regressions.

All arrays have leading batch axes, as in `belief`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from arrivals.trackers.autoregressive.belief import SourceBelief, select_beliefs
from arrivals.trackers.autoregressive.settings import NoiseSettings, RegressionSettings
from arrivals.trackers.autoregressive.steady_state import StateSpace, exact_filter, steady_filter
from arrivals.trackers.gaussian.linalg import transposed
from arrivals.typing import Bool, Float


@dataclass(frozen=True, eq=False)
class FilteredInterval:
    """Filtered states of an interval, and weighted sums for the regressions.

    Attributes
    ----------
    X : ndarray, shape (..., n_samples * n_parts, n)
        States after each sample.
    P : ndarray, shape (..., n, n)
        Covariance after the last sample.
    y : ndarray, shape (..., n_samples * n_parts, n_sensors)
        Measurements; expected values where they are missing.
    weights, ar_weights : ndarray, shape (..., n_samples)
        √λ^age and √λ_a^age; 0 for samples without valid data.
    decay, ar_decay : ndarray, shape (...)
        λ and λ_a to the power of the number of snapshots with valid data.
    covariance, ar_covariance : ndarray, shape (..., n, n)
        Covariances of the states, summed with the squares of these weights.
    missing_covariance : ndarray, shape (..., n, n_sensors)
        Covariance with the sources, the same sum over the samples that a sensor misses, times its
        response.
    precision : ndarray, shape (..., n_sensors, n_sensors)
        r S⁻¹ = I - A P_ss Aᵀ / r of the innovations, mean with the squares of `weights`; zero where
        a sensor misses a sample.
    has_pairs : ndarray of bool, shape (...)
        True with data of a pair of sensors.
    noise : ndarray, shape (...)
        Mean of E|y - A s|² given the measurements; NaN without measurements.
    """

    X: Float
    P: Float
    y: Float
    weights: Float
    decay: Float
    ar_weights: Float
    ar_decay: Float
    covariance: Float
    ar_covariance: Float
    missing_covariance: Float
    precision: Float
    has_pairs: Bool
    noise: Float


def filter_interval(
    belief: SourceBelief, y: Float, model: StateSpace, regression: RegressionSettings
) -> FilteredInterval:
    """Filter an interval, (..., n_samples * n_parts, n_sensors), from the state of `belief`."""
    complete: Bool = np.asarray(np.isfinite(y).all(axis=(-2, -1)))
    if complete.all():
        return filter_complete(belief, y, model, regression)
    if not complete.any():
        return filter_with_gaps(belief, y, model, regression)
    first, second = (
        filter_interval(
            select_beliefs(belief, mask), y[mask], StateSpace(*(v[mask] for v in model)), regression
        )
        for mask in (complete, ~complete)
    )
    return merge_batches(complete, first, second)


def merge_batches(
    mask: Bool, first: FilteredInterval, second: FilteredInterval
) -> FilteredInterval:
    """Return the results of the members in `mask` and of the others as those of the batch."""
    fields = {}
    for name, value in vars(first).items():
        merged = np.empty((len(mask), *value.shape[1:]), value.dtype)
        merged[mask], merged[~mask] = value, getattr(second, name)
        fields[name] = merged
    return FilteredInterval(**fields)


def filter_complete(
    belief: SourceBelief, y: Float, model: StateSpace, regression: RegressionSettings
) -> FilteredInterval:
    """Filter an interval without missing data at the steady gain."""
    X, P = steady_filter(belief.x, belief.P, y, model)
    A, n_parts, k = model.A, belief.x.shape[-2], model.A.shape[-1]
    lead, n = y.shape[:-2], y.shape[-2] // n_parts
    w, decay, sum_w = complete_weights(lead, n, regression.forgetting)
    v, ar_decay, sum_v = complete_weights(lead, n, regression.ar_forgetting)
    errors = y - X[..., :k] @ transposed(A)
    APA = A @ P[..., :k, :k] @ transposed(A)
    variance = np.einsum("...ii->...", APA) / A.shape[-2]
    noise = n_parts * (errors * errors).mean(axis=(-2, -1)) + variance
    return FilteredInterval(
        X, P, y, w, decay, v, ar_decay,
        sum_w * P,
        sum_v * P,
        np.zeros((*P.shape[:-1], A.shape[-2])),
        np.eye(A.shape[-2]) - APA / model.r,
        np.ones(lead, dtype=np.bool_),
        noise * (2 / n_parts),
    )  # fmt: skip


@lru_cache(maxsize=64)
def complete_weights(
    lead: tuple[int, ...], n: int, forgetting: float
) -> tuple[Float, Float, Float]:
    """Return `forgetting_weights` of n valid samples, and the sum of their squares (..., 1, 1)."""
    w, decay = forgetting_weights(np.ones((*lead, n)), forgetting)
    w.setflags(write=False)
    return w, decay, (w * w).sum(axis=-1)[..., None, None]


def filter_with_gaps(
    belief: SourceBelief, y: Float, model: StateSpace, regression: RegressionSettings
) -> FilteredInterval:
    """Filter an interval sample by sample, each with its valid measurements."""
    X, Ps = exact_filter(belief.x, belief.P, y, model)
    A, n_parts, k = model.A, belief.x.shape[-2], model.A.shape[-1]
    samples = y.reshape(*y.shape[:-2], -1, n_parts, y.shape[-1])
    valid: Bool = np.asarray(np.isfinite(samples).all(axis=-2))
    any_valid = np.asarray(valid.any(axis=-1), dtype=np.float64)
    w, decay = forgetting_weights(any_valid, regression.forgetting)
    v, ar_decay = forgetting_weights(any_valid, regression.ar_forgetting)
    expected = X[..., :k] @ transposed(A)
    y = np.where(np.repeat(valid, n_parts, axis=-2), y, expected)
    P_s = Ps[..., :k, :k]
    errors = ((y - expected) ** 2).reshape(samples.shape).sum(axis=-2)
    variance = np.einsum("...mk,...jkl,...ml->...jm", A, P_s, A)
    n = valid.sum(axis=(-2, -1))
    noise = ((errors + variance) * valid).sum(axis=(-2, -1)) / np.where(n > 0, n, np.nan)
    # V - V A P_ss Aᵀ V / r, V the valid sensors
    H = valid[..., None] * A[..., None, :, :]
    precision = (
        valid[..., None] * np.eye(A.shape[-2]) - H @ P_s @ transposed(H) / model.r[..., None]
    )
    share = w * w / np.maximum((w * w).sum(axis=-1, keepdims=True), np.finfo(np.float64).tiny)
    missing = (w * w)[..., None] * ~valid
    return FilteredInterval(
        X, Ps[..., -1, :, :], y, w, decay, v, ar_decay,
        np.einsum("...j,...jkl->...kl", w * w, Ps),
        np.einsum("...j,...jkl->...kl", v * v, Ps),
        np.einsum("...jm,...jkl,...ml->...km", missing, Ps[..., :k], A),
        np.einsum("...j,...jkl->...kl", share, precision),
        np.asarray(valid[..., : A.shape[-2] // 2].any(axis=(-2, -1))),
        noise * (2 / n_parts),
    )  # fmt: skip


def assumed_noise(belief: SourceBelief, settings: NoiseSettings) -> Float:
    """Return r of one real part, (..., 1, 1), at least r_start exp(-n/τ) during acquisition."""
    r = belief.r
    if settings.r_start > 0:
        minimum = settings.r_start * belief.power.mean(axis=-1)
        r = np.maximum(r, minimum * np.exp(-belief.n / settings.tau))
    half = belief.x.shape[-2] / 2  # of real sources, half of the noise is in the other part
    return np.asarray(half * r[..., None, None])


def forgetting_weights(valid: Float, forgetting: float) -> tuple[Float, Float]:
    """Return √λ^age of samples (..., n) and λ^n, counting only valid samples (1, not 0).

    Examples
    --------
    >>> forgetting_weights(np.array([1.0, 0.0, 1.0]), 0.25)
    (array([0.5, 0. , 1. ]), array(0.0625))
    """
    until = np.cumsum(valid, axis=-1)
    n = until[..., -1:]
    return valid * forgetting ** ((n - until) / 2), np.asarray(forgetting ** n[..., 0])
