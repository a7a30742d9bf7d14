"""Regressions of an interval: rows of the manifold (sec. 3) and AR models (sec. 4).

All arrays have leading batch axes, as in `belief`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.autoregressive.companion_form import CompanionLayout, stabilised
from arrivals.trackers.autoregressive.belief import SourceBelief
from arrivals.trackers.autoregressive.interval_filter import FilteredInterval
from arrivals.trackers.autoregressive.qrd_rls import QRDRLS
from arrivals.trackers.autoregressive.settings import RegressionSettings
from arrivals.trackers.autoregressive.steady_state import StateSpace
from arrivals.trackers.gaussian.linalg import ridge_rows, solve_factor, transposed
from arrivals.typing import Float

MIN_INNOVATION = 1e-4  # innovation variance over the power of the source
TINY = np.finfo(np.float64).tiny


def estimate_directions(
    belief: SourceBelief,
    filtered: FilteredInterval,
    model: StateSpace,
    manifold: ArrayManifold,
    regression: RegressionSettings,
) -> tuple[Float, Float]:
    """Return the factor of the regression for the rows of A_T, and the directions: (6), (7)."""
    k, n_parts = model.A.shape[-1], belief.x.shape[-2]
    target = manifold.pairs_of(transposed(model.A))  # the row of ones is never estimated
    rls = QRDRLS.from_factor(belief.manifold_factor, k, regression.forgetting, regression.ridge)
    # [√λ^N [R | U]; w_j [s_j | y_j]; [Lᵀ | 0]; √(μ (1 - λ^N)) [I | A_Tᵀ]]   (3.2)
    w = np.repeat(filtered.weights, n_parts, axis=-1)
    samples, share = beside(filtered.X[..., :k], manifold.pairs_of(filtered.y)), None
    if regression.huber is not None:
        threshold = regression.huber * np.sqrt(model.r[..., 0, 0])
        w, share = with_robust_weights(w, rls.robust_weights(samples, threshold, n_parts))
    rows = [w[..., None] * samples]
    if regression.correction:
        rows.append(scaled(covariance_rows(filtered, k, manifold), share))
    ridge = regression.ridge * (1 - filtered.decay)[..., None] * belief.power
    rls.append(filtered.decay, *rows, ridge_rows(ridge, target))
    rls.factor = rls.factor[..., :k, :]
    return rls.factor, directions_of_rows(rls.solve(), belief.doa, manifold, regression)


def with_robust_weights(w: Float, huber: Float) -> tuple[Float, Float]:
    """Return root weights (..., n_rows) times Huber's, and the share of the weight that is left."""
    robust = w * np.sqrt(huber)
    whole = np.maximum((w * w).sum(axis=-1), TINY)
    return robust, np.asarray((robust * robust).sum(axis=-1) / whole)


def scaled(rows: Float, share: Float | None) -> Float:
    """Return rows (..., n, m) of a covariance of which a share (...) of the weight is left."""
    return rows if share is None else np.sqrt(share)[..., None, None] * rows


def directions_of_rows(
    W: Float, before: Float, manifold: ArrayManifold, regression: RegressionSettings
) -> Float:
    """Return the directions of estimated rows of A_T, (..., n_sources, 2 n_pairs): (7).

    Parameters
    ----------
    W : ndarray, shape (..., n_sources, 2 n_pairs)
        Cosine rows of all pairs, then their sine rows.
    before : ndarray, shape (..., n_sources)
        Directions before the interval.
    manifold : ArrayManifold
    regression : RegressionSettings
    """
    M, d = manifold.n_pairs, manifold.distances
    cosine, sine = W[..., :M], W[..., M:]
    # φ_m = atan2(sin row, cos row), or the arctangent of their quotient   (3.4), (7)
    if is_ratio := regression.angles == "ratio":
        cosine, sine = np.abs(cosine), np.where(cosine < 0, -sine, sine)
    phases = np.arctan2(sine, cosine)
    # θ = arcsin(φ_m / 2π d_m)
    if regression.pairs == "fit":
        doa = manifold.doa(phases)
    else:
        d = d[:1] if regression.pairs == "inner" else d
        u = phases[..., : len(d)] / (2 * np.pi * d)
        doa = np.arcsin(np.minimum(np.maximum(u, -1.0), 1.0)).mean(axis=-1)
    # a quotient has no whole turns, which the limit excludes
    return doa if is_ratio else limit_phase_step(before, doa, float(d[-1]))


def rows_of_factor(factor: Float, manifold: ArrayManifold) -> Float:
    """Return A_T (..., n_sensors, n_sources) with the estimated rows of a regression."""
    W, M = solve_factor(factor, factor.shape[-2]), manifold.n_pairs
    return transposed(manifold.between(W[..., :M], 1.0, W[..., M:]))


def limit_phase_step(before: Float, after: Float, largest_distance: float) -> Float:
    """Limit the change of sin θ to half a turn of the phase of the outermost pair.

    A larger change is a jump to an ambiguity of the outer pairs, which a poor start can cause.
    """
    if largest_distance <= 0.25:
        return after
    u, limit = np.sin(before), 0.5 / largest_distance
    return np.asarray(np.arcsin(np.clip(np.sin(after), u - limit, u + limit)))


def covariance_rows(filtered: FilteredInterval, k: int, manifold: ArrayManifold) -> Float:
    """Return the rows [Lᵀ | 0], L Lᵀ = Σ w² P_ss (3.3).

    They make the true directions a fixed point: the estimated samples are regressors with errors.
    Where a sensor misses samples, the same errors are in the expected values in their place.
    """
    L = cholesky_root(filtered.covariance[..., :k, :k])
    missing = filtered.missing_covariance[..., :k, :]
    if missing.any():
        missing = np.asarray(np.linalg.solve(L, missing), dtype=np.float64)
    return beside(transposed(L), manifold.pairs_of(missing))


def beside(first: Float, second: Float) -> Float:
    """Return the columns of both."""
    return np.concatenate([first, second], axis=-1)


def cholesky_root(C: Float) -> Float:
    """Return a matrix L with L Lᵀ = C, for C made slightly more than positive semidefinite."""
    scale, offset = _loading(C.shape[-1])
    return np.asarray(np.linalg.cholesky(C * scale + offset))


@lru_cache(maxsize=64)
def _loading(n: int) -> tuple[Float, Float]:
    eye = np.eye(n)
    return 1 + 1e-12 * eye, TINY * eye


def estimate_ar_models(
    belief: SourceBelief,
    present: SourceBelief,
    filtered: FilteredInterval,
    layout: CompanionLayout,
    regression: RegressionSettings,
) -> tuple[Float, Float, Float, Float]:
    """Return factors and weights of the AR regressions, coefficients, and innovation variances.

    Parameters
    ----------
    belief : SourceBelief
        Before the interval.
    present : SourceBelief
        Its coefficients are the target of the regularization.
    filtered : FilteredInterval
    layout : CompanionLayout
    regression : RegressionSettings
    """
    # [√λ_a^N [R | U]; w_j [s(j-1) ... s(j-p) | s(j)]; Lᵀ; √(μ_a (1 - λ_a^N)) [I | a]]   (4.1, 4.2)
    n_parts = belief.x.shape[-2]
    w = np.repeat(filtered.ar_weights, n_parts, axis=-1)[..., None, :]
    samples = regression_samples(belief, filtered.X, layout, regression.correction)
    if not layout.used.all():
        samples = samples * regression_mask(layout)
    samples, share = np.swapaxes(samples, -3, -2), None
    p, settings = layout.used.shape[-1], (regression.ar_forgetting, regression.ar_ridge)
    rls = QRDRLS.from_factor(belief.ar_factor, p, *settings)
    if regression.huber is not None:
        threshold = regression.huber * np.sqrt(belief.q)
        w, share = with_robust_weights(w, rls.robust_weights(samples, threshold, n_parts))
    rows = [w[..., None] * samples]
    if regression.correction:
        covariance = regression_covariance(filtered.ar_covariance, layout)
        rows.append(scaled(transposed(cholesky_root(covariance)), share))
    ridge = regression.ar_ridge * (1 - filtered.ar_decay)[..., None, None] * belief.power[..., None]
    ridge = np.broadcast_to(ridge, present.a.shape)
    decay = filtered.ar_decay[..., None]
    rls.append(decay, *rows, ridge_rows(ridge, present.a[..., None]))
    weight = decay * belief.ar_weight + (w * w).sum(axis=-1) / n_parts
    # a = R⁻¹ U, poles inside 0.995   (4.4);  q = ρ² / Σ w²   (4.3)
    a = stabilised(rls.solve()[..., 0])
    q = rls.factor[..., -1, -1] ** 2 / np.maximum(weight, TINY)
    return rls.factor, weight, a, np.maximum(q, MIN_INNOVATION * belief.power)


def regression_samples(
    belief: SourceBelief, X: Float, layout: CompanionLayout, same_posterior: bool
) -> Float:
    """Return [s(j-1) ... s(j-p) | s(j)] of all sources, (..., n_rows, n_sources, p + 1).

    All given sample j; or, without the correction, the lags given sample j - 1.
    """
    if same_posterior:
        return X[..., layout.regression_columns]
    before = np.concatenate([belief.x, X[..., : -belief.x.shape[-2], :]], axis=-2)
    lags, current = before[..., layout.lags[:, :-1]], X[..., layout.lags[:, :1]]
    return np.concatenate([lags, current], axis=-1)


def regression_covariance(P: Float, layout: CompanionLayout) -> Float:
    """Return the covariances of `regression_samples`, (..., n_sources, p + 1, p + 1).

    A lag beyond the order of a source has variance 1 and no correlation.
    """
    columns = layout.regression_columns
    C = P[..., columns[:, :, None], columns[:, None, :]]
    if layout.used.all():
        return C
    mask = regression_mask(layout)
    both = mask[:, :, None] * mask[:, None, :]
    return np.asarray(C * both + np.eye(mask.shape[-1]) * (1 - both))


def regression_mask(layout: CompanionLayout) -> Float:
    """Return 1 for the columns of `regression_samples` that a source has, 0 for others."""
    return np.concatenate([layout.used, np.ones((len(layout.used), 1))], axis=-1)
