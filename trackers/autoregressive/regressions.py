"""The regressions of an interval: rows of the manifold (sec. 3) and AR models (sec. 4).

Everything has leading batch axes; see `source_states`.
"""

from __future__ import annotations

import numpy as np

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.companion_form import CompanionLayout, stabilised
from arrivals.trackers.autoregressive.belief import Settings, SourceBelief
from arrivals.trackers.autoregressive.interval_filter import FilteredInterval
from arrivals.trackers.autoregressive.qrd_rls import folded, ridge_rows, solution
from arrivals.trackers.autoregressive.steady_state import transposed
from arrivals.typing import Float

FLOOR = 1e-4  # of a source's power: the least driving noise
TINY = np.finfo(np.float64).tiny


def directions(
    s: SourceBelief, heard: FilteredInterval, A: Float, manifold: ArrayManifold, o: Settings
) -> tuple[Float, Float]:
    """Return the factor of the manifold's rows, and the directions that they tell."""
    k, parts, centre = A.shape[-1], s.x.shape[-2], manifold.centre
    target = np.delete(transposed(A), centre, axis=-1)  # the row of ones stays what it is
    w = np.repeat(heard.weights, parts, axis=-1)[..., None]
    data = w * np.concatenate([heard.X[..., :k], np.delete(heard.y, centre, axis=-1)], axis=-1)
    parts_of_stack = [np.sqrt(heard.kept)[..., None, None] * s.rows, data]
    if o.correction:
        parts_of_stack.append(covariance_rows(heard, k, centre))
    ridge = o.ridge * (1 - heard.kept)[..., None] * s.power
    factor = folded(*parts_of_stack, ridge_rows(ridge, target))[..., :k, :]
    W = solution(factor, k)
    M = manifold.n_pairs
    doa = manifold.doa(np.arctan2(W[..., M:], W[..., :M]))
    return factor, cautious(s.doa, doa, float(manifold.distances[-1]))


def cautious(before: Float, after: Float, widest: float) -> Float:
    """Keep sin β from moving by more than half a turn of the outermost pair's phase.

    More is a leap to where the outer pairs are ambiguous, as a poor start may suggest.
    """
    if widest <= 0.25:
        return after
    u, most = np.sin(before), 0.5 / widest
    return np.asarray(np.arcsin(np.clip(np.sin(after), u - most, u + most)))


def covariance_rows(heard: FilteredInterval, k: int, centre: int) -> Float:
    """Return the rows [Lᵀ | 0], L Lᵀ the samples' summed error covariance.

    They make the true directions a fixed point: the estimated samples are regressors with errors.
    Where a sensor misses samples, the same errors are in what stands for its measurement.
    """
    L = root(heard.cov[..., :k, :k])
    rest = np.linalg.solve(L, np.delete(heard.unheard, centre, axis=-1))
    return np.concatenate([transposed(L), rest], axis=-1)


def root(C: Float) -> Float:
    """Return a matrix L with L Lᵀ = C, made a little more than positive semidefinite."""
    eye = np.eye(C.shape[-1])
    return np.asarray(np.linalg.cholesky(C * (1 + 1e-12 * eye) + TINY * eye))


def autoregression(
    s: SourceBelief,
    now: SourceBelief,
    heard: FilteredInterval,
    blocks: CompanionLayout,
    o: Settings,
) -> tuple[Float, Float, Float, Float]:
    """Return factors and weight of the AR regressions, coefficients, and driving variances."""
    p = blocks.used.shape[-1]
    parts = s.x.shape[-2]
    w = np.repeat(heard.ar_weights, parts, axis=-1)[..., None, None]
    samples = lagged(s, heard.X, blocks, o.correction)
    if not blocks.used.all():
        samples = samples * present(blocks)
    data = np.swapaxes(w * samples, -3, -2)
    stack = [np.sqrt(heard.ar_kept)[..., None, None, None] * s.models, data]
    if o.correction:
        stack.append(transposed(root(lag_covariance(heard.ar_cov, blocks))))
    ridge = o.ar_ridge * (1 - heard.ar_kept)[..., None, None] * s.power[..., None]
    ridge = np.broadcast_to(ridge, now.a.shape)
    models = folded(*stack, ridge_rows(ridge, now.a[..., None]))
    weight = heard.ar_kept * s.weight + (heard.ar_weights**2).sum(axis=-1)
    a = stabilised(solution(models, p)[..., 0])
    if not o.adapt_drive:
        return models, weight, a, now.q
    q = models[..., -1, -1] ** 2 / np.maximum(weight, TINY)[..., None]
    return models, weight, a, np.maximum(q, FLOOR * s.power)


def lagged(s: SourceBelief, X: Float, blocks: CompanionLayout, same: bool) -> Float:
    """Return [s(j-1) ... s(j-p) | s(j)] of all sources, (..., rows, n_sources, p + 1).

    All as believed after sample j; or, without the correction, the lags as before it.
    """
    if same:
        return X[..., blocks.columns]
    before = np.concatenate([s.x, X[..., : -s.x.shape[-2], :]], axis=-2)
    lags, now = before[..., blocks.lags[:, :-1]], X[..., blocks.lags[:, :1]]
    return np.concatenate([lags, now], axis=-1)


def lag_covariance(P: Float, blocks: CompanionLayout) -> Float:
    """Return the covariances of the columns of `lagged`, (..., n_sources, p + 1, p + 1).

    A lag that a source does not have is 1 by itself.
    """
    C = P[..., blocks.columns[:, :, None], blocks.columns[:, None, :]]
    if blocks.used.all():
        return C
    there = present(blocks)
    both = there[:, :, None] * there[:, None, :]
    return np.asarray(C * both + np.eye(there.shape[-1]) * (1 - both))


def present(blocks: CompanionLayout) -> Float:
    """Return 1 for the columns of `lagged` that a source has, 0 for others."""
    return np.concatenate([blocks.used, np.ones((len(blocks.used), 1))], axis=-1)
