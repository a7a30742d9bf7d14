"""The ELBO of the snapshots of a step as a smooth function of all unknowns of the components.

Their densities are normal in a chart, wrapped normal of an angle; amplitudes and their covariance
are eliminated in closed form. Arrays have a leading axis of independent problems, (B, ...), then,
where it matters, one of F frequency bins, and slots for L components of which the first K are in
use. A bin has N snapshots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.symmetric import identity, log_det, places
from arrivals.trackers.svalse.newton.batch import BatchRecord, Components
from arrivals.trackers.svalse.newton.expected_response import (
    ExpectedResponse,
    diagonals,
    numbers,
)
from arrivals.trackers.svalse.newton.linear_algebra import inverse_and_log_det
from arrivals.typing import Bool, Complex, Float, Int

LOG_2PIE = float(np.log(2 * np.pi * np.e))


@dataclass(eq=False)
class Evaluation(BatchRecord):
    """Components, variances, and all that follows from them; never written into.

    Attributes
    ----------
    Y : ndarray, shape (B, F, n_sensors, N)
        Snapshots, each bin of unit power: ‖Y‖² is n_sensors N.
    components : Components
    K : ndarray of int, shape (B,)
    used : ndarray of bool, shape (B, L)
        Slots that hold a component.
    nu, tau : ndarray, shape (B, F)
        Variances of noise and amplitudes.
    log_prior_inactive : ndarray, shape (B,)
        Σ ln(1-ρ) where ρ is estimated, else 0.
    A : ndarray, shape (B, F, L, n_sensors)
        Mean steering vectors â.
    X : ndarray, shape (B, F, P or P + d², L, L)
        `ExpectedResponse.products`, P = 1 + d + d(d+1)/2 for d unknowns; the diagonals are ⟨‖a‖²⟩
        in the first, and half its first and second derivatives in the following ones.
    h : ndarray, shape (B, F, P, L, N)
        âᴴY, (∂ᵢâ)ᴴY, (∂ᵢⱼâ)ᴴY, i ≤ j.
    uncertainty_loss : ndarray, shape (B, F, L)
        ⟨‖a‖²⟩ - ‖â‖².
    prior_gradient, prior_curvature : ndarray, shapes (B, d, L), (B, d(d+1)/2, L)
        First and second derivatives of the prior's part of D.
    D : ndarray, shape (B, L)
        KL divergence of each component's density from its prior.
    log_prior : ndarray, shape (B,)
        Part of the odds and divergences in the ELBO.
    W, G : ndarray, shapes (B, F, L, N), (B, F, L, L)
        Means of the amplitudes; their covariance, that of every snapshot of a bin, is ν G.
    explained : ndarray, shape (B, F)
        Re tr HᴴŴ.
    F : ndarray, shape (B,)
        The ELBO, up to a constant of the step.
    """

    Y: Complex
    components: Components
    K: Int
    used: Bool
    nu: Float
    tau: Float
    log_prior_inactive: Float
    A: Complex
    X: Complex
    h: Complex
    uncertainty_loss: Float
    prior_gradient: Float
    prior_curvature: Float
    D: Float
    log_prior: Float
    W: Complex
    G: Complex
    explained: Float
    F: Float

    def __len__(self) -> int:
        return len(self.K)

    @property
    def n_unknowns(self) -> int:
        """Unknowns d of a component."""
        return self.components.layout.n_unknowns

    @property
    def second_products(self) -> Complex:
        """(∂ᵢâ)ᴴ∂ⱼâ off the diagonal, (B, F, d, d, L, L)."""
        d, L = self.n_unknowns, self.X.shape[-1]
        first, last = 1 + d, 1 + d + d * (d + 1) // 2
        if self.X.shape[2] > last:
            return self.X[:, :, last:].reshape(*self.X.shape[:2], d, d, L, L)
        if d == 1:
            return -self.X[:, :, 2:, None]
        return np.asarray(-self.X[:, :, first:][:, :, places(d)])

    def trimmed(self) -> Evaluation:
        """Return the same without slots that no problem uses."""
        L = max(*self.K.tolist(), 1)
        if self.used.shape[1] == L:
            return self
        return self.changed(
            components=self.components.first(L),
            used=self.used[:, :L],
            A=self.A[:, :, :L],
            X=self.X[..., :L, :L],
            h=self.h[:, :, :, :L],
            uncertainty_loss=self.uncertainty_loss[:, :, :L],
            prior_gradient=self.prior_gradient[..., :L],
            prior_curvature=self.prior_curvature[..., :L],
            D=self.D[:, :L],
            W=self.W[:, :, :L],
            G=self.G[:, :, :L, :L],
        )

    def criterion(self, kl_weight: float) -> Float:
        """Return the support criterion F + (1 - kl_weight) Σ D, (B,)."""
        return np.asarray(self.F + (1 - kl_weight) * np.add.reduce(self.D, axis=1))


def evaluate(
    response: ExpectedResponse,
    Y: Complex,
    components: Components,
    K: Int,
    nu: Float,
    tau: Float,
    log_prior_inactive: Float,
) -> Evaluation:
    """Return the evaluation of given components and variances."""
    x, s = components.point, components.covariance
    L = x.shape[2]
    used = np.arange(L) < K[:, None]
    partly_used = min(K.tolist()) < L
    if partly_used:
        s = np.where(used[:, None], s, identity(response.n_unknowns))
    A, X, h, uncertainty_loss = response.products(Y, x, s, used if partly_used else None)
    # KL(q ‖ p) = c - ½ ln det 2πe S + ⟨prior⟩;  c = ln 2πI₀(κ), ⟨prior⟩ = -κ exp(-s/2) cos(μ-μₚ)
    # of an angle, c = ½ ln det 2π P⁻¹, ⟨prior⟩ = ½ (δᵀPδ + tr PS) of a point
    value, prior_gradient, prior_curvature = response.chart.prior(
        x, s, components.prior_mean, components.prior_precision
    )
    D = components.kl_constant - 0.5 * (response.n_unknowns * LOG_2PIE + log_det(s)) + value
    each = components.log_odds - D
    if partly_used:
        D, each = D * used, each * used
        prior_gradient = prior_gradient * used[:, None]
        prior_curvature = prior_curvature * used[:, None]
    log_prior = log_prior_inactive + np.add.reduce(each, axis=1)
    W, G, explained, F = amplitudes(response, X[:, :, 0], h[:, :, 0], used, K, nu, tau)
    return Evaluation(
        Y=Y, components=components, K=K, used=used, nu=nu, tau=tau,
        log_prior_inactive=log_prior_inactive, A=A, X=X, h=h, uncertainty_loss=uncertainty_loss,
        prior_gradient=prior_gradient, prior_curvature=prior_curvature, D=D,
        log_prior=log_prior, W=W, G=G, explained=explained,
        F=F + log_prior,
    )  # fmt: skip


def with_variances(
    response: ExpectedResponse, evaluation: Evaluation, nu: Float, tau: Float
) -> Evaluation:
    """Return the evaluation with other variances; the points stay."""
    J, H = evaluation.X[:, :, 0], evaluation.h[:, :, 0]
    W, G, explained, F = amplitudes(response, J, H, evaluation.used, evaluation.K, nu, tau)
    F = F + evaluation.log_prior
    return evaluation.changed(nu=nu, tau=tau, W=W, G=G, explained=explained, F=F)


def amplitudes(
    response: ExpectedResponse, J: Complex, H: Complex, used: Bool, K: Int, nu: Float, tau: Float
) -> tuple[Complex, Complex, Float, Float]:
    """Return Ŵ = G H, G = (J + ν/τ I)⁻¹, Re tr HᴴŴ, and their part of the ELBO.

    F = Σ [Re tr HᴴŴ/ν - M N/ν - M N ln πν + N K ln ν/τ - N ln det(J + ν/τ I)] over bins, over T.
    """
    B, n_bins, L, N = H.shape
    MN, ratio = response.n_sensors * N, nu / tau
    regularised = J.copy()
    ridge = ratio[:, :, None]
    if min(K.tolist()) < L:  # 1 where unused: no part in the determinant
        ridge = np.where(used[:, None], ridge, 1.0)
    diagonals(regularised)[...] += ridge
    G, log_det = inverse_and_log_det(regularised)
    W = G @ H
    explained = np.vecdot(H.reshape(B, n_bins, L * N), W.reshape(B, n_bins, L * N)).real
    fit, n, r, volume, k = numbers(explained, nu, ratio, log_det, K[:, None])
    F = (fit - MN) / n - MN * np.log(np.pi * n) + N * (k * np.log(r) - volume)
    return W, G, explained, response.total(np.reshape(F, nu.shape))
