"""One interval of the AR Kalman filter with QRD-RLS: signals, then manifold, then AR models.

Everything has leading batch axes. Samples of complex sources are two real rows each, real and
imaginary part; states are counted lag by lag, the sources' current samples first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arrivals.measurement_models.array_manifold import ArrayManifold
from arrivals.motion_models.companion import Blocks, stabilised
from arrivals.trackers.qrd_rls import ages, folded, ridge_rows, solution
from arrivals.trackers.source_states import Options, Sources
from arrivals.trackers.steady_kalman import exact_filter, steady_filter, transposed
from arrivals.typing import Bool, Float

FLOOR = 1e-4  # of a source's power: the least driving noise
LEAST_NOISE = 1e-8  # of the largest source's power: the least measurement noise
AUDIBLE = 0.5  # of the noise: a source below the gate's part of that is silent in any case
PRIOR = 20.0
TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class Heard:
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


def interval(
    s: Sources, y: Float, manifold: ArrayManifold, blocks: Blocks, o: Options
) -> tuple[Sources, Float]:
    """Return the belief after an interval, and the states after each of its samples.

    Parameters
    ----------
    s : Sources
    y : ndarray, shape (..., n_samples * parts, n_sensors)
        Transformed snapshots, real; NaN where missing.
    manifold : ArrayManifold
    blocks : Blocks
        Lag by lag.
    o : Options

    References
    ----------
    Gu, Chan, Zhu and Swamy, 2013, algorithm 1, with our corrections: states of one lag more, rows
    for the covariance of the states in both regressions, and targets of the regularisation.
    """
    new = s
    for _ in range(o.inner):
        A = transposed(manifold.real_steering(new.doa))
        heard = filtered(s, new, y, A, blocks, o)
        rows, doa = directions(s, heard, A, manifold, o)
        models, weight, a, q = autoregression(s, new, heard, blocks, o)
        new = replace(new, doa=doa, a=a, q=q, rows=rows, models=models, weight=weight)
    return settled(s, new, heard, o), heard.X


def settled(s: Sources, new: Sources, heard: Heard, o: Options) -> Sources:
    """Take over the state, hold those sources that are silent, and learn noise and powers."""
    loud = sounding(heard.X, s.doa.shape[-1], s.x.shape[-2])
    something = np.asarray(heard.kept < 1)[..., None]
    least = o.gate * np.maximum(s.power, AUDIBLE * s.r[..., None])
    active = np.logical_and((loud > least) | (o.gate == 0), something)
    anyone = np.asarray(active.any(axis=-1))
    power = np.where(something, learned_power(s, loud, o), s.power)
    return replace(
        new,
        x=heard.X[..., -s.x.shape[-2] :, :],
        P=heard.P,
        doa=np.where(active, new.doa, s.doa),
        rows=np.where(anyone[..., None, None], new.rows, s.rows),
        r=learned_noise(s, heard, o),
        power=power,
        q=new.q if o.adapt_drive else s.q * power / s.power,
        active=active,
        n=s.n + 1,
    )


def sounding(X: Float, n_sources: int, parts: int) -> Float:
    """Return the mean power of each source's samples, (..., n_sources)."""
    signals = X[..., :n_sources]
    return np.asarray((signals * signals).sum(axis=-2) * (parts / X.shape[-2]))


def learned_noise(s: Sources, heard: Heard, o: Options) -> Float:
    """Return r <- 0.9 r + 0.1 E|y - A s|², (4.5) of the report's notation."""
    if not o.adapt_noise:
        return s.r
    new: Float = np.where(np.isnan(heard.noise), s.r, heard.noise)
    return np.asarray(np.maximum(0.9 * s.r + 0.1 * new, LEAST_NOISE * s.power.max(axis=-1)))


def learned_power(s: Sources, loud: Float, o: Options) -> Float:
    """Return each source's mean power over the last `memory` intervals, pauses included.

    What is known at the start counts as much as the first `PRIOR` intervals.
    """
    share = 1 / np.minimum(s.n + PRIOR, max(o.memory, PRIOR))[..., None]
    return np.asarray(np.maximum(s.power + share * (loud - s.power), TINY))


def noise_now(s: Sources, o: Options) -> Float:
    """Return the noise that the filter assumes, (..., 1, 1): inflated during acquisition."""
    r = s.r
    if o.r_start > 0:
        r = np.maximum(r, o.r_start * s.power.mean(axis=-1) * np.exp(-s.n / o.tau))
    half = s.x.shape[-2] / 2
    return np.asarray(half * r[..., None, None])  # of real sources, half is in the other part


# -- Kalman filter (sec. 2) ------------------------------------------------------------------------


def filtered(s: Sources, now: Sources, y: Float, A: Float, blocks: Blocks, o: Options) -> Heard:
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


def only(s: Sources, some: Bool) -> Sources:
    """Return the belief of some members of a batch."""
    return Sources(**{name: value[some] for name, value in vars(s).items()})


def merged(first: Bool, one: Heard, other: Heard) -> Heard:
    """Return the results of two parts of a batch as those of the whole."""
    fields = {}
    for name, value in vars(one).items():
        both = np.empty((len(first), *value.shape[1:]))
        both[first], both[~first] = value, getattr(other, name)
        fields[name] = both
    return Heard(**fields)


def without_gaps(s: Sources, y: Float, F: Float, Q: Float, A: Float, r: Float, o: Options) -> Heard:
    """Filter at the steady gain."""
    X, P = steady_filter(s.x, s.P, y, F, Q, A, r)
    parts, k = s.x.shape[-2], A.shape[-1]
    heard = np.ones((*y.shape[:-2], y.shape[-2] // parts))
    w, kept = ages(heard, o.forgetting)
    v, ar_kept = ages(heard, o.ar_forgetting)
    errors = y - X[..., :k] @ transposed(A)
    spread = (A @ P[..., :k, :k] * A).sum(axis=(-2, -1)) / A.shape[-2]
    noise = parts * (errors * errors).mean(axis=(-2, -1)) + spread
    return Heard(
        X, P, y, w, kept, v, ar_kept,
        (w * w).sum(axis=-1)[..., None, None] * P,
        (v * v).sum(axis=-1)[..., None, None] * P,
        np.zeros((*A.shape[:-2], k, A.shape[-2])),
        noise * (2 / parts),
    )  # fmt: skip


def with_gaps(s: Sources, y: Float, F: Float, Q: Float, A: Float, r: Float, o: Options) -> Heard:
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
    return Heard(
        X, Ps[..., -1, :, :], y, w, kept, v, ar_kept,
        np.einsum("...j,...jkl->...kl", w * w, Ps),
        np.einsum("...j,...jkl->...kl", v * v, Ps),
        unheard,
        noise * (2 / parts),
    )  # fmt: skip


# -- manifold (sec. 3) -----------------------------------------------------------------------------


def directions(
    s: Sources, heard: Heard, A: Float, manifold: ArrayManifold, o: Options
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


def covariance_rows(heard: Heard, k: int, centre: int) -> Float:
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


# -- AR models (sec. 4) ----------------------------------------------------------------------------


def autoregression(
    s: Sources, now: Sources, heard: Heard, blocks: Blocks, o: Options
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


def lagged(s: Sources, X: Float, blocks: Blocks, same: bool) -> Float:
    """Return [s(j-1) ... s(j-p) | s(j)] of all sources, (..., rows, n_sources, p + 1).

    All as believed after sample j; or, without the correction, the lags as before it.
    """
    if same:
        return X[..., blocks.columns]
    before = np.concatenate([s.x, X[..., : -s.x.shape[-2], :]], axis=-2)
    lags, now = before[..., blocks.lags[:, :-1]], X[..., blocks.lags[:, :1]]
    return np.concatenate([lags, now], axis=-1)


def lag_covariance(P: Float, blocks: Blocks) -> Float:
    """Return the covariances of the columns of `lagged`, (..., n_sources, p + 1, p + 1).

    A lag that a source does not have is 1 by itself.
    """
    C = P[..., blocks.columns[:, :, None], blocks.columns[:, None, :]]
    if blocks.used.all():
        return C
    there = present(blocks)
    both = there[:, :, None] * there[:, None, :]
    return np.asarray(C * both + np.eye(there.shape[-1]) * (1 - both))


def present(blocks: Blocks) -> Float:
    """Return 1 for the columns of `lagged` that a source has, 0 for others."""
    return np.concatenate([blocks.used, np.ones((len(blocks.used), 1))], axis=-1)
