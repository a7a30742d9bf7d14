"""Marginal covariances of the components and odds of existence, at the end of a step.

The ELBO has the covariance of each component with all others held, `Components.covariance`. The
marginal ones follow from the joint Hessian of all components; the noise, which the ELBO takes as
known, is integrated out of what is reported. Neither is put back into the ELBO.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.symmetric import clamped, clamped_inverse, inverse
from arrivals.trackers.marginal_variances import marginal_covariances, student_factor
from arrivals.trackers.svalse.newton.elbo import Evaluation
from arrivals.trackers.svalse.newton.expected_response import (
    ExpectedResponse,
    diagonals,
    over_snapshots,
)
from arrivals.trackers.svalse.newton.step import (
    negative_hessian,
    noise_freedom,
    slopes,
    weights,
)
from arrivals.typing import Complex, Float


@dataclass(frozen=True, eq=False)
class ComponentMarginals:
    """What is kept and reported of the components of each problem.

    Attributes
    ----------
    covariance : ndarray, shape (B, d(d+1)/2, L)
        Marginal covariances with known noise: the motion model widens them.
    stated_covariance : ndarray, shape (B, d(d+1)/2, L)
        Those with unknown noise: the reported ones.
    log_odds : ndarray, shape (B, L)
        Log odds of existence, the noise integrated out, nats.
    """

    covariance: Float
    stated_covariance: Float
    log_odds: Float


def marginals(
    response: ExpectedResponse, evaluation: Evaluation, kl_weight: float
) -> ComponentMarginals:
    """Return the marginals of the components of each problem."""
    freedom = 2 * noise_freedom(response, evaluation)
    w2 = evaluation.W.real**2 + evaluation.W.imag**2
    covariance = component_covariances(response, evaluation)
    factor = noise_factor(evaluation, w2, freedom)
    return ComponentMarginals(
        covariance,
        stated_covariances(response, evaluation, covariance, factor),
        existence_log_odds(response, evaluation, w2, freedom, kl_weight),
    )


def component_covariances(response: ExpectedResponse, evaluation: Evaluation) -> Float:
    """Return the blocks of N⁻¹ of each component: the Laplace approximation, noise known.

    N is the negative Hessian of F with the amplitudes eliminated. The result has the shape
    (B, d(d+1)/2, L).
    """
    v, P = weights(evaluation)
    curvature = slopes(response, evaluation, v, P)[1]
    N = negative_hessian(response, evaluation, P, curvature)
    used = np.tile(evaluation.used, response.n_unknowns)
    if not used.all():
        N = np.where(used[:, :, None] & used[:, None, :], N, 0.0)
        diagonals(N)[...] += ~used
    return marginal_covariances(N, response.n_unknowns, response.chart.max_variance)


def noise_factor(evaluation: Evaluation, w2: Float, freedom: Float) -> Float:
    """Return by how much unknown noise widens the variances that the data give, (B, L).

    Parameters
    ----------
    evaluation : Evaluation
    w2 : ndarray, shape (B, F, L, N)
        Powers of the amplitudes' means.
    freedom : ndarray, shape (B, F)
        Real degrees of freedom left for the noise of each bin.
    """
    share = w2 / evaluation.nu[:, :, None, None]
    total = np.maximum(share.sum(axis=(1, 3)), 1e-300)
    # ω_f: share of each bin in the information;  n = 1/Σω²,  d = Σ ω_f d_f
    weight = share.sum(axis=3) / total[:, None]
    n_bins = 1 / np.maximum((weight**2).sum(axis=1), 1e-300)
    d = (weight * freedom[:, :, None]).sum(axis=1)
    m = np.maximum(d, 4.0)
    # f = c(d n) (m/(m-2))^(2(1-1/n)) g
    factor = student_factor(d * n_bins) * (m / (m - 2)) ** (2 * (1 - 1 / n_bins))
    if w2.shape[3] > 1:
        factor = factor * (share * snapshot_noise(evaluation)).sum(axis=(1, 3)) / total
    return np.where(evaluation.used & (share.sum(axis=(1, 3)) > 0), factor, 1.0)


def snapshot_noise(evaluation: Evaluation) -> Float:
    """Return the residual power of each snapshot over the mean of its bin, (B, F, 1, N)."""
    residual: Complex = evaluation.Y - evaluation.A.swapaxes(2, 3) @ evaluation.W
    power = (residual.real**2 + residual.imag**2).sum(axis=2, keepdims=True)
    return np.asarray(power / np.maximum(power.mean(axis=3, keepdims=True), 1e-300))


def stated_covariances(
    response: ExpectedResponse, evaluation: Evaluation, covariance: Float, factor: Float
) -> Float:
    """Return the reported covariances: the data's information divided by `factor`.

    S = [P + max(S⁻¹ - P, 0)/f]⁻¹, where P is the prior's part of the information.
    """
    prior = evaluation.prior_curvature
    information = prior + clamped(inverse(covariance) - prior, 0.0) / factor[:, None]
    return clamped_inverse(information, 1 / response.chart.max_variance)


def existence_log_odds(
    response: ExpectedResponse, evaluation: Evaluation, w2: Float, freedom: Float, kl_weight: float
) -> Float:
    """Return the log odds of existence with the noise integrated out, (B, L).

    A component of power q in units of its own noise, with n complex degrees of freedom left for
    the noise, counts (n + N) ln(1 + q/n) nats instead of q.
    """
    N = w2.shape[3]
    C = evaluation.nu[:, :, None] * evaluation.G.diagonal(axis1=2, axis2=3).real
    C = np.where(evaluation.used[:, None], C, 1.0)
    q, n = over_snapshots(w2) / C, freedom[:, :, None] / 2
    # ln r/(1-r) = 1/T Σ (n+N) ln(1 + q/n) - N ln τ/C  +  ln ρ/(1-ρ) - c D
    by_bin = (n + N) * np.log1p(q / n) - N * np.log(evaluation.tau[:, :, None] / C)
    prior = evaluation.components.log_odds - kl_weight * evaluation.D
    return np.asarray(response.total(by_bin) + prior)
