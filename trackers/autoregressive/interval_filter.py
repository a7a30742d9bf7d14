"""The Kalman filter of an interval (sec. 2): the sources' samples, and what regressions ask for.

Everything has leading batch axes; see `source_states`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.motion_models.companion_form import CompanionLayout
from arrivals.trackers.autoregressive.belief import Settings, SourceBelief
from arrivals.trackers.autoregressive.qrd_rls import ages
from arrivals.trackers.autoregressive.steady_state import exact_filter, steady_filter, transposed
from arrivals.typing import Bool, Float


@dataclass(frozen=True, eq=False)
class FilteredInterval:
    """What the Kalman filter makes of an interval.

    Attributes
    ----------
    X : ndarray, shape (..., n_samples * parts, n)
        States after each sample.
    P : ndarray, shape (..., n, n)
        Covariance after the last.
    y : ndarray, shape (..., n_samples * parts, n_sensors)
        Measurements, by their expectations where they are missing.
    weights, ar_weights : ndarray, shape (..., n_samples)
        √λ^age and √λ_a^age; 0 where nothing was measured.
    kept, ar_kept : ndarray, shape (...)
        λ and λ_a to the number of snapshots.
    cov, ar_cov : ndarray, shape (..., n, n)
        Covariances of the states, summed with the squares of these weights.
    unheard : ndarray, shape (..., n_sources, n_sensors)
        That sum over the samples that a sensor misses, times its response.
    noise : ndarray, shape (...)
        Mean of E|y - A s|² given the measurements; NaN if there is none.
    """

    X: Float
    P: Float
    y: Float
    weights: Float
    kept: Float
    ar_weights: Float
    ar_kept: Float
    cov: Float
    ar_cov: Float
    unheard: Float
    noise: Float


def filtered(
    s: SourceBelief, now: SourceBelief, y: Float, A: Float, blocks: CompanionLayout, o: Settings
) -> FilteredInterval:
    """Filter an interval from the state s, with the models that are believed now."""
    F, Q = blocks.transition(now.a), blocks.drive(now.q)
    whole: Bool = np.asarray(np.isfinite(y).all(axis=(-2, -1)))
    r = noise_now(s, o)
    if whole.all():
        return without_gaps(s, y, F, Q, A, r, o)
    if not whole.any():
        return with_gaps(s, y, F, Q, A, r, o)
    one, other = (
        job(only(s, some), y[some], F[some], Q[some], A[some], r[some], o)
        for some, job in ((whole, without_gaps), (~whole, with_gaps))
    )
    return merged(whole, one, other)


def only(s: SourceBelief, some: Bool) -> SourceBelief:
    """Return the belief of some members of a batch."""
    return SourceBelief(**{name: value[some] for name, value in vars(s).items()})


def merged(first: Bool, one: FilteredInterval, other: FilteredInterval) -> FilteredInterval:
    """Return the results of two parts of a batch as those of the whole."""
    fields = {}
    for name, value in vars(one).items():
        both = np.empty((len(first), *value.shape[1:]))
        both[first], both[~first] = value, getattr(other, name)
        fields[name] = both
    return FilteredInterval(**fields)


def without_gaps(
    s: SourceBelief, y: Float, F: Float, Q: Float, A: Float, r: Float, o: Settings
) -> FilteredInterval:
    """Filter at the steady gain."""
    X, P = steady_filter(s.x, s.P, y, F, Q, A, r)
    parts, k = s.x.shape[-2], A.shape[-1]
    heard = np.ones((*y.shape[:-2], y.shape[-2] // parts))
    w, kept = ages(heard, o.forgetting)
    v, ar_kept = ages(heard, o.ar_forgetting)
    errors = y - X[..., :k] @ transposed(A)
    spread = (A @ P[..., :k, :k] * A).sum(axis=(-2, -1)) / A.shape[-2]
    noise = parts * (errors * errors).mean(axis=(-2, -1)) + spread
    return FilteredInterval(
        X, P, y, w, kept, v, ar_kept,
        (w * w).sum(axis=-1)[..., None, None] * P,
        (v * v).sum(axis=-1)[..., None, None] * P,
        np.zeros((*A.shape[:-2], k, A.shape[-2])),
        noise * (2 / parts),
    )  # fmt: skip


def with_gaps(
    s: SourceBelief, y: Float, F: Float, Q: Float, A: Float, r: Float, o: Settings
) -> FilteredInterval:
    """Filter sample by sample, with what was measured of each."""
    X, Ps = exact_filter(s.x, s.P, y, F, Q, A, r)
    parts, k = s.x.shape[-2], A.shape[-1]
    pairs = y.reshape(*y.shape[:-2], -1, parts, y.shape[-1])
    there = np.isfinite(pairs).all(axis=-2)
    heard = np.asarray(there.any(axis=-1), dtype=np.float64)
    w, kept = ages(heard, o.forgetting)
    v, ar_kept = ages(heard, o.ar_forgetting)
    expected = X[..., :k] @ transposed(A)
    y = np.where(np.repeat(there, parts, axis=-2), y, expected)
    Pss = Ps[..., :k, :k]
    errors = ((y - expected) ** 2).reshape(pairs.shape).sum(axis=-2)
    spread = np.einsum("...mk,...jkl,...ml->...jm", A, Pss, A)
    n = there.sum(axis=(-2, -1))
    noise = ((errors + spread) * there).sum(axis=(-2, -1)) / np.where(n > 0, n, np.nan)
    missing = (w * w)[..., None] * ~there
    unheard = np.einsum("...jm,...jkl,...ml->...km", missing, Pss, A)
    return FilteredInterval(
        X, Ps[..., -1, :, :], y, w, kept, v, ar_kept,
        np.einsum("...j,...jkl->...kl", w * w, Ps),
        np.einsum("...j,...jkl->...kl", v * v, Ps),
        unheard,
        noise * (2 / parts),
    )  # fmt: skip


def noise_now(s: SourceBelief, o: Settings) -> Float:
    """Return the noise that the filter assumes, (..., 1, 1): inflated during acquisition."""
    r = s.r
    if o.r_start > 0:
        r = np.maximum(r, o.r_start * s.power.mean(axis=-1) * np.exp(-s.n / o.tau))
    half = s.x.shape[-2] / 2
    return np.asarray(half * r[..., None, None])  # of real sources, half is in the other part
