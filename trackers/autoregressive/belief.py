"""What is believed of autoregressive sources between two intervals, and how it begins.

Everything has leading batch axes. Samples of complex sources are two real rows each, real and
imaginary part; states are counted lag by lag, the sources' current samples first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.array_snapshot import LARGEST
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.autoregressive import AutoregressiveSources
from arrivals.motion_models.combined import block_diagonal
from arrivals.motion_models.companion_form import blocks
from arrivals.trackers.autoregressive.qrd_rls import ridge_rows
from arrivals.typing import Bool, Complex, Float, Int


@dataclass(frozen=True, eq=False)
class Settings:
    """The parameters of the tracker that an interval asks for; see there."""

    forgetting: float
    ar_forgetting: float
    ridge: float
    ar_ridge: float
    gate: float
    inner: int
    correction: bool
    adapt_drive: bool
    adapt_noise: bool
    r_start: float
    tau: float
    memory: float


@dataclass(frozen=True, eq=False)
class SourceBelief:
    """All that is believed between two intervals.

    Attributes
    ----------
    x : ndarray, shape (..., parts, n)
    P : ndarray, shape (..., n, n)
    doa, q, power : ndarray, shape (..., n_sources)
        Directions, rad; driving variances; long-term powers.
    a : ndarray, shape (..., n_sources, p)
        AR coefficients.
    r : ndarray, shape (...)
        Variance of the complex noise of one sensor.
    rows : ndarray, shape (..., n_sources, n_sources + 2 n_pairs)
        Factor of the regression for the manifold's rows.
    models : ndarray, shape (..., n_sources, p + 1, p + 1)
        Factors of those for the AR coefficients.
    weight : ndarray, shape (...)
        Σ λ_a^age of the samples in `models`.
    active : ndarray of bool, shape (..., n_sources)
        Who was heard in the last interval.
    n : ndarray of int, shape (...)
        Intervals so far.
    """

    x: Float
    P: Float
    doa: Float
    a: Float
    q: Float
    r: Float
    power: Float
    rows: Float
    models: Float
    weight: Float
    active: Bool
    n: Int


def beginning(
    doa: Float,
    x: Float,
    P: Float,
    motion: AutoregressiveSources,
    manifold: ArrayManifold,
    o: Settings,
) -> SourceBelief:
    """Return what is believed before anything is heard.

    Parameters
    ----------
    doa : ndarray, shape (n_batch, n_sources)
        rad.
    x, P : ndarray, shape (n_batch, parts, n), (n_batch, n, n)
    motion : AutoregressiveSources
    manifold : ArrayManifold
    o : Options
    """
    lead = len(doa)

    def each(value: Float) -> Float:
        return np.repeat(np.asarray(value, dtype=np.float64)[None], lead, axis=0)

    a, power = each(motion.padded), each(motion.power)
    target = np.delete(manifold.real_steering(doa), manifold.centre, axis=-1)
    ridge = np.broadcast_to(o.ar_ridge * power[..., None], a.shape)
    models = ridge_rows(ridge, a[..., None])
    return SourceBelief(
        x=x,
        P=P,
        doa=doa,
        a=a,
        q=each(np.array(motion.noise)),
        r=np.full(lead, float(manifold.noise)),
        power=power,
        rows=ridge_rows(o.ridge * power, target),
        models=np.concatenate([models, np.zeros_like(models[..., :1, :])], axis=-2),
        weight=np.zeros(lead),
        active=np.ones(doa.shape, dtype=np.bool_),
        n=np.zeros(lead, dtype=np.int64),
    )


def measured(z: Complex, manifold: ArrayManifold, parts: int) -> Float:
    """Return transformed snapshots as real rows, NaN where missing.

    Parameters
    ----------
    z : ndarray, shape (..., n_snapshots, n_sensors)
        Not finite where missing.
    manifold : ArrayManifold
    parts : int
        2, or 1 to leave the imaginary part out.

    Returns
    -------
    ndarray, shape (..., n_snapshots * parts, n_sensors)
        Both rows of a pair are missing if one of its sensors is.
    """
    there = np.abs(z) < LARGEST
    gaps = not there.all()
    y = manifold.transform(np.where(there, z, 0) if gaps else z)
    if gaps:
        y[(~there @ (manifold.T != 0)) > 0] = complex(np.nan, np.nan)
    rows = np.stack([y.real, y.imag][:parts], axis=-2)
    return np.asarray(rows.reshape(*y.shape[:-2], -1, y.shape[-1]), dtype=np.float64)


def inside(x: Float, P: Float, motion: AutoregressiveSources) -> tuple[Float, Float]:
    """Return a state as trackers show it, (dim_x,), as (parts, n) and (n, n), lag by lag."""
    parts, places = motion.n_parts, blocks(motion.orders, lag_by_lag=True)
    n, order = places.dim, places.order
    both = sum(P[i * n : (i + 1) * n, i * n : (i + 1) * n] for i in range(parts))
    return x.reshape(parts, n)[:, order], np.asarray(both)[order[:, None], order]


def outside(x: Float, motion: AutoregressiveSources) -> Float:
    """Return states (..., parts, n), lag by lag, as trackers show them: (..., dim_x)."""
    back = blocks(motion.orders, lag_by_lag=True).back
    return x[..., back].reshape(*x.shape[:-2], -1)


def covariance_outside(P: Float, motion: AutoregressiveSources) -> Float:
    """Return a covariance (n, n), lag by lag, as trackers show it: (dim_x, dim_x)."""
    back = blocks(motion.orders, lag_by_lag=True).back
    each = P[back[:, None], back] / motion.n_parts
    return each if motion.real_valued else block_diagonal(each, each)


def joined(X: Float, parts: int, n_sources: int) -> Complex:
    """Return states' rows (..., n_samples * parts, n) as signals, (..., n_samples, n_sources)."""
    rows = X[..., :n_sources].reshape(*X.shape[:-2], -1, parts, n_sources)
    return np.asarray(rows[..., 0, :] + 1j * (rows[..., 1, :] if parts == 2 else 0.0))


def repeated(s: SourceBelief, n: int) -> SourceBelief:
    """Return a belief n times."""
    return SourceBelief(**{name: np.repeat(value, n, axis=0) for name, value in vars(s).items()})
