"""Belief about autoregressive sources between two intervals, and conversions of its layout.

All arrays have leading batch axes. A sample of a complex source is two real rows, real and
imaginary part; internal states are arranged lag by lag, the current samples first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.motion_models.autoregressive.companion_form import companion_layout
from arrivals.motion_models.autoregressive.sources import AutoregressiveSources
from arrivals.motion_models.combined import block_diagonal
from arrivals.trackers.autoregressive.settings import RegressionSettings
from arrivals.trackers.gaussian.linalg import ridge_rows
from arrivals.typing import Bool, Complex, Float, Int

GRID_STD = float(np.deg2rad(5.0) / np.sqrt(12.0))  # rad, uniform in a cell of acquisition
ACQUISITION = 60  # snapshots for the initial directions


@dataclass(frozen=True, eq=False)
class SourceBelief:
    """Belief between two intervals.

    Attributes
    ----------
    x : ndarray, shape (..., n_parts, n)
        Mean of the state.
    P : ndarray, shape (..., n, n)
        Covariance of the state; of complex states, E|x - mean|².
    doa : ndarray, shape (..., n_sources)
        Directions, rad.
    a : ndarray, shape (..., n_sources, p)
        AR coefficients.
    q : ndarray, shape (..., n_sources)
        Innovation variances.
    r : ndarray, shape (...)
        Variance of the complex noise of one sensor.
    power : ndarray, shape (..., n_sources)
        Long-term powers.
    manifold_factor : ndarray, shape (..., n_sources, n_sources + 2 n_pairs)
        Triangular factor of the regression for the rows of the manifold.
    ar_factor : ndarray, shape (..., n_sources, p + 1, p + 1)
        Triangular factors of the regressions for the AR coefficients.
    ar_weight : ndarray, shape (..., n_sources)
        Σ λ_a^age of the samples in `ar_factor`, times their robust weights.
    covariance : ndarray, shape (..., n_sources, n_sources)
        Covariance of the errors of sin θ.
    sensitivity : ndarray, shape (..., n_sources, n, n)
        E (x - mean) meanᵀ of the predicted state per error of the sine of each direction.
    active : ndarray of bool, shape (..., n_sources)
        Sources above the gate in the last interval.
    n : ndarray of int, shape (...)
        Number of intervals so far.
    """

    x: Float
    P: Float
    doa: Float
    a: Float
    q: Float
    r: Float
    power: Float
    manifold_factor: Float
    ar_factor: Float
    ar_weight: Float
    covariance: Float
    sensitivity: Float
    active: Bool
    n: Int


def samples_needed(belief: SourceBelief | None, interval: int) -> int:
    """Return the number of snapshots processed next: an interval, or those of acquisition.

    Examples
    --------
    >>> samples_needed(None, 25)
    75
    """
    return interval * (1 if belief is not None else -(-ACQUISITION // interval))


def initialize_belief(
    doa: Float,
    std: float,
    x: Float,
    P: Float,
    motion: AutoregressiveSources,
    manifold: ArrayManifold,
    regression: RegressionSettings,
) -> SourceBelief:
    """Return the belief before the first interval: line 1 of Algorithm 1.

    Parameters
    ----------
    doa : ndarray, shape (n_batch, n_sources)
        Directions, rad.
    std : float
        Their standard deviation, rad.
    x, P : ndarray, shape (n_batch, n_parts, n), (n_batch, n, n)
    motion : AutoregressiveSources
    manifold : ArrayManifold
    regression : RegressionSettings
    """
    n_batch = len(doa)

    def repeat(value: Float) -> Float:
        return np.repeat(np.asarray(value, dtype=np.float64)[None], n_batch, axis=0)

    a, power = repeat(motion.coefficient_matrix), repeat(motion.power)
    target = manifold.pairs_of(manifold.real_steering(doa))
    ridge = np.broadcast_to(regression.ar_ridge * power[..., None], a.shape)
    rows = ridge_rows(ridge, a[..., None])
    # var sin(θ + ε) = cos² θ σ² + sin² θ σ⁴ / 2
    u = np.sin(doa)
    std = std if regression.states_deviations else np.nan
    variance = (1 - u * u) * std**2 + u * u * std**4 / 2
    return SourceBelief(
        x=x,
        P=P,
        doa=doa,
        a=a,
        q=repeat(np.array(motion.noise)),
        r=np.full(n_batch, float(manifold.noise)),
        power=power,
        manifold_factor=ridge_rows(regression.ridge * power, target),
        ar_factor=np.concatenate([rows, np.zeros_like(rows[..., :1, :])], axis=-2),
        ar_weight=np.zeros(doa.shape),
        covariance=variance[..., None] * np.eye(doa.shape[-1]),
        sensitivity=np.zeros((*doa.shape, *P.shape[1:])),
        active=np.ones(doa.shape, dtype=np.bool_),
        n=np.zeros(n_batch, dtype=np.int64),
    )


def repeat_belief(belief: SourceBelief, n: int) -> SourceBelief:
    """Return a belief n times."""
    fields = {name: np.repeat(value, n, axis=0) for name, value in vars(belief).items()}
    return SourceBelief(**fields)


def select_beliefs(belief: SourceBelief, index: Bool) -> SourceBelief:
    """Return the belief of the members of a batch that a mask selects."""
    return SourceBelief(**{name: value[index] for name, value in vars(belief).items()})


def to_internal(x: Float, P: Float, motion: AutoregressiveSources) -> tuple[Float, Float]:
    """Return a tracker's state, (dim_x,), lag by lag: (n_parts, n) and (n, n)."""
    n_parts, layout = motion.n_parts, companion_layout(motion.orders, lag_by_lag=True)
    n, order = layout.dim, layout.permutation
    total = sum(P[i * n : (i + 1) * n, i * n : (i + 1) * n] for i in range(n_parts))
    return x.reshape(n_parts, n)[:, order], np.asarray(total)[order[:, None], order]


def to_state_vector(x: Float, motion: AutoregressiveSources) -> Float:
    """Return internal states (..., n_parts, n) as `motion` arranges them: (..., dim_x)."""
    order = companion_layout(motion.orders, lag_by_lag=True).inverse_permutation
    return x[..., order].reshape(*x.shape[:-2], -1)


def to_state_covariance(P: Float, motion: AutoregressiveSources) -> Float:
    """Return an internal covariance (n, n) as `motion` arranges it: (dim_x, dim_x)."""
    order = companion_layout(motion.orders, lag_by_lag=True).inverse_permutation
    part = P[order[:, None], order] / motion.n_parts
    return part if motion.real_valued else block_diagonal(part, part)


def to_signals(X: Float, n_parts: int, n_sources: int) -> Complex:
    """Return states (..., n_samples * n_parts, n) as signals (..., n_samples, n_sources)."""
    rows = X[..., :n_sources].reshape(*X.shape[:-2], -1, n_parts, n_sources)
    return np.asarray(rows[..., 0, :] + 1j * (rows[..., 1, :] if n_parts == 2 else 0.0))
