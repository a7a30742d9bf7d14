"""Covariance of the errors of the directions, interval by interval.

Directions are in terms of u = sin θ, in which the response of each source has a slope of the same
length, L = |dA_T/du|². An interval moves the estimates by a step along a martingale S:

    u <- u + D (RᵀR)⁻¹ S,  S = Σ_j w_j² [s_j (y_j - A_T s_j)ᵀ - P_ss A_Tᵀ],  D = dA_Tᵀ / L

because old rows and the ridge draw to the present directions, and new ones to these and S. With
the innovations e, of covariance S_e, and predicted samples s⁻, a sample of S is
r [s⁻ eᵀ + K (e eᵀ - S_e)] S_e⁻¹: at the truth of mean zero, uncorrelated in time. The error
follows from its variance V and from its slope J, both given here without approximation in a
steady state of Gaussian noise. All arrays have leading batch axes, as in `belief`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.trackers.autoregressive.belief import SourceBelief
from arrivals.trackers.autoregressive.interval_filter import FilteredInterval, filter_interval
from arrivals.trackers.autoregressive.regressions import TINY
from arrivals.trackers.autoregressive.settings import RegressionSettings
from arrivals.trackers.autoregressive.steady_state import StateSpace
from arrivals.trackers.gaussian.linalg import transposed
from arrivals.typing import Float

UNIFORM = 1 / 3  # variance of sin θ, uniform in ±1


class DirectionStep(NamedTuple):
    """Statistics of the step of an interval.

    J (..., k, k) is the mean step per error, V (..., k, k) the covariance of the step; `inverse`
    is (RᵀR)⁻¹, and `sensitivity`, (..., k, n, n), the new one of the belief.
    """

    J: Float
    V: Float
    inverse: Float
    sensitivity: Float


def direction_step(
    belief: SourceBelief,
    factor: Float,
    filtered: FilteredInterval,
    model: StateSpace,
    manifold: ArrayManifold,
) -> DirectionStep:
    """Return mean and covariance of the step of an interval.

    Parameters
    ----------
    belief : SourceBelief
        Before the interval.
    factor : ndarray, shape (..., n_sources, n_sources + 2 n_pairs)
        Of the regression for the rows of the manifold, after the interval.
    filtered : FilteredInterval
    model : StateSpace
        The model that it was filtered with.
    manifold : ArrayManifold
    """
    F, _, A, r = model
    k, n_parts = A.shape[-1], belief.x.shape[-2]
    slope, length = slope_matrix(manifold)
    At, dA = transposed(A), slope @ A
    w = filtered.weights * filtered.weights
    total = np.maximum(w.sum(axis=-1), TINY)[..., None, None]
    # Σ w² x sᵀ, Σ w² P_xs and Σ w² r K,  r K = P_xs A_Tᵀ
    XS = transposed(filtered.X) @ (np.repeat(w, n_parts, axis=-1)[..., None] * filtered.X[..., :k])
    PS = filtered.covariance[..., :k]
    rK = PS @ At - filtered.missing_covariance
    R = factor[..., :k]
    inverse: Float = np.asarray(np.linalg.inv(transposed(R) @ R), dtype=np.float64)
    C, weighted = inverse @ XS[..., :k, :], filtered.precision @ dA
    M, N = rK[..., :k, :] @ dA, transposed(dA) @ weighted
    T = inverse @ M
    # V = Σ w⁴ r/n_parts D (RᵀR)⁻¹ [E s sᵀ ⊗ r S_e⁻¹ + r K ⊗ r K / r] (RᵀR)⁻¹ Dᵀ
    share = (w * w).sum(axis=-1)[..., None, None] / (n_parts * length**2 * total)
    V = share * (r * N * (C @ inverse) + T * transposed(T) / total)
    # X_k = E x̃ x⁻ᵀ per error of u_k, x̃ the error of the predicted state x⁻:
    # X <- F (I - K A_T) X Fᵀ + F [K a_k E s_k xᵀ - P_k (K a_k)ᵀ] Fᵀ,  a_k = dA_T/du_k
    FK = F @ rK / (r * total)
    closed = F.copy()
    closed[..., :k] -= FK @ A
    gain, mean, error = transposed(FK @ dA), transposed(F @ XS), transposed(F @ PS)
    new = gain[..., None] * mean[..., None, :] - error[..., None] * gain[..., None, :]
    X = closed[..., None, :, :] @ belief.sensitivity @ transposed(F)[..., None, :, :]
    X = X + new / total[..., None]
    # J = D (RᵀR)⁻¹ Σ w² [E s sᵀ ⊗ r S_e⁻¹ + r K ⊗ r K / r - X_ssᵀ A_Tᵀ r S_e⁻¹] dA_T
    lag = inverse[..., None, :, :] @ transposed(X[..., :k, :k])
    lag = (lag * transposed(At @ weighted)[..., None, :, :]).sum(axis=-1)
    return DirectionStep(
        (C * N + T * transposed(M) / (r * total) - total * transposed(lag)) / length, V, inverse, X
    )


def with_direction_covariance(
    belief: SourceBelief,
    new: SourceBelief,
    filtered: FilteredInterval,
    model: StateSpace,
    manifold: ArrayManifold,
    forgetting: float,
    inner: int,
) -> SourceBelief:
    """Return the belief after an interval with the covariance of the errors of sin θ.

    Parameters
    ----------
    belief, new : SourceBelief
        Before and after the interval.
    filtered : FilteredInterval
    model : StateSpace
        The model that it was filtered with.
    manifold : ArrayManifold
    forgetting : float
        λ.
    inner : int
        Iterations of the interval.
    """
    step = direction_step(belief, new.manifold_factor, filtered, model, manifold)
    J, V = step.J, step.V
    all_active = new.active.all()
    if not all_active:
        active = new.active[..., None].astype(np.float64)
        J, V = active * J, active * V * transposed(active)
    # Cov <- a Cov aᵀ + b V bᵀ,  a = I - J, b = I in the first iteration; then, with the share
    # g = 1 - λ^N of new data,  a <- (1 - g) I + (g I - J) a,  b <- I + (g I - J) b
    eye = np.eye(J.shape[-1])
    a, b = eye - J, eye
    if inner > 1:
        g = (1 - filtered.decay[..., None, None]) * eye
        for _ in range(inner - 1):
            a, b = eye - g + (g - J) @ a, eye + (g - J) @ b
        V = b @ V @ transposed(b)
    C = a @ belief.covariance @ transposed(a) + V
    if not (all_active and filtered.has_pairs.all()):
        # A snapshot of an interval without data adds (1/λ - 1) r/n_parts (RᵀR)⁻¹ / L: the random
        # walk that makes λ the best forgetting; at most up to a uniform direction
        missing = ~(new.active & filtered.has_pairs[..., None]) & (new.ar_weight > 0)
        walk = (1 / forgetting - 1) / (belief.x.shape[-2] * slope_matrix(manifold)[1])
        walk *= filtered.weights.shape[-1]
        growth = missing * walk * model.r[..., 0] * np.diagonal(step.inverse, axis1=-2, axis2=-1)
        room = UNIFORM - np.diagonal(C, axis1=-2, axis2=-1)
        C = C + np.minimum(growth, np.maximum(room, 0.0))[..., None] * eye
    return replace(new, covariance=C, sensitivity=step.sensitivity)


def with_acquisition_errors(
    start: SourceBelief,
    belief: SourceBelief,
    y: Float,
    model: StateSpace,
    manifold: ArrayManifold,
    regression: RegressionSettings,
) -> SourceBelief:
    """Return a belief with the errors of maximum-likelihood directions from the same rows.

    Parameters
    ----------
    start, belief : SourceBelief
        With these directions, and after the intervals of these rows, which do not reduce their
        errors.
    y : ndarray, shape (..., n_samples * n_parts, n_sensors)
    model : StateSpace
        Of `start`.
    manifold : ArrayManifold
    regression : RegressionSettings
    """
    filtered = filter_interval(start, y, model, regression)
    step = direction_step(belief, belief.manifold_factor, filtered, model, manifold)
    # where S vanishes:  Cov <- Cov + J⁻¹ V J⁻ᵀ
    root: Float = np.asarray(np.linalg.pinv(step.J, rcond=1e-6), dtype=np.float64)
    return replace(belief, covariance=belief.covariance + root @ step.V @ transposed(root))


def direction_std(covariance: Float, doa: Float) -> Float:
    """Return the deviations of directions: half the width in θ of u ± one deviation of u.

    Parameters
    ----------
    covariance : ndarray, shape (..., n_sources, n_sources)
        Of u = sin θ.
    doa : ndarray, shape (..., n_sources)
        rad.

    Examples
    --------
    >>> direction_std(np.eye(2) * 1e-4, np.array([0.0, np.pi / 2])).round(4)
    array([0.01  , 0.0708])
    """
    u, std = np.sin(doa), np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    upper, lower = np.arcsin(np.minimum(u + std, 1.0)), np.arcsin(np.maximum(u - std, -1.0))
    return np.asarray((upper - lower) / 2)


@lru_cache(maxsize=64)
def slope_matrix(manifold: ArrayManifold) -> tuple[Float, float]:
    """Return the matrix that turns A_T into dA_T/du, 2π d (-sin row, 0, cos row), and L."""
    M, rate = manifold.n_pairs, 2 * np.pi * manifold.distances
    pair = np.arange(M)
    n = manifold.array.n_sensors
    matrix = np.zeros((n, n))
    matrix[pair, n - M + pair], matrix[n - M + pair, pair] = -rate, rate
    matrix.setflags(write=False)
    return matrix, float(2 * (rate @ rate))
