"""The ELBO of the snapshots of a step as a smooth function of all their angles.

The angles have wrapped normal densities; amplitudes and their covariance are eliminated in closed
form. Arrays have a leading axis of independent problems, (B, ...), then, where it matters, one of
F frequency bins, and slots for L components of which the first K are in use. A bin has N
snapshots.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arrivals.trackers.svalse.newton.batch import BatchRecord
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse, diagonals
from arrivals.typing import Bool, Complex, Float, Int

MU, VARIANCE, PRIOR_MU, PRIOR_KAPPA, LOG_ODDS, KL_CONSTANT, SLOT = range(7)
LOG_2PIE = float(np.log(2 * np.pi * np.e))


@dataclass(eq=False)
class Components(BatchRecord):
    """Components of each problem in one array; its properties are views of shape (B, L).

    Attributes
    ----------
    packed : ndarray, shape (B, 7, L)
        The quantities in the order of the properties.
    """

    packed: Float

    @classmethod
    def zeros(cls, n_problems: int, n_components: int) -> Components:
        """Return components of which all is zero.

        Examples
        --------
        >>> components = Components.zeros(1, 2)
        >>> components.mu[0, 1] = 0.5
        >>> components.mu
        array([[0. , 0.5]])
        """
        return cls(np.zeros((n_problems, 7, n_components)))

    @property
    def mu(self) -> Float:
        """Mean of the angle, rad."""
        return self.packed[:, MU]

    @property
    def variance(self) -> Float:
        """Variance of the angle, rad²."""
        return self.packed[:, VARIANCE]

    @property
    def prior_mu(self) -> Float:
        """Mean of the predicted von Mises density, rad."""
        return self.packed[:, PRIOR_MU]

    @property
    def prior_kappa(self) -> Float:
        """Concentration of the predicted von Mises density."""
        return self.packed[:, PRIOR_KAPPA]

    @property
    def log_odds(self) -> Float:
        """Prior log odds of being active."""
        return self.packed[:, LOG_ODDS]

    @property
    def kl_constant(self) -> Float:
        """Logarithm of 2π I₀(κ) of the predicted density."""
        return self.packed[:, KL_CONSTANT]

    @property
    def slot(self) -> Int:
        """Index in the memory of the step; -1 while on trial. A copy: see `with_slots`."""
        return self.packed[:, SLOT].astype(np.int64)

    def copy(self) -> Components:
        """Return a copy that may be written into."""
        return Components(self.packed.copy())

    def with_slots(self, slot: Int) -> Components:
        """Return the components with other indices in the memory, (B, L)."""
        changed = self.copy()
        changed.packed[:, SLOT] = slot
        return changed

    def first(self, n: int) -> Components:
        """Return the first n components of each problem."""
        return Components(self.packed[:, :, :n])

    def without(self, k: Int) -> Components:
        """Return the components without the k-th of each problem, the last slot unused."""
        L = self.packed.shape[2]
        order = np.arange(L) + (np.arange(L) >= k[:, None])
        rows = np.arange(len(k))[:, None]
        kept = self.packed[rows, :, np.minimum(order, L - 1)]
        return Components(np.asarray(kept.swapaxes(1, 2)))


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
    X : ndarray, shape (B, F, 3 or 4, L, L)
        `ExpectedResponse.products`; the diagonals are ⟨‖a‖²⟩ in the first, and half its first and
        second derivatives in the second and third.
    h : ndarray, shape (B, F, 3, L, N)
        âᴴY, (∂â)ᴴY, (∂²â)ᴴY.
    uncertainty_loss : ndarray, shape (B, F, L)
        ⟨‖a‖²⟩ - ‖â‖².
    prior_gradient : ndarray, shape (B, L)
        κ exp(-s/2 + j(μ-μₚ)): the prior's part of gradient and curvature.
    D : ndarray, shape (B, L)
        KL divergence of each angle's density from its prior.
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
    prior_gradient: Complex
    D: Float
    log_prior: Float
    W: Complex
    G: Complex
    explained: Float
    F: Float

    def __len__(self) -> int:
        return len(self.K)

    @property
    def second_products(self) -> Complex:
        """(∂â)ᴴ∂â off the diagonal, (B, F, L, L)."""
        return self.X[:, :, 3] if self.X.shape[2] == 4 else -self.X[:, :, 2]

    def trimmed(self) -> Evaluation:
        """Return the same without slots that no problem uses."""
        L = max(*self.K.tolist(), 1)
        if self.used.shape[1] == L:
            return self
        return replace(
            self,
            components=self.components.first(L),
            used=self.used[:, :L],
            A=self.A[:, :, :L],
            X=self.X[..., :L, :L],
            h=self.h[:, :, :, :L],
            uncertainty_loss=self.uncertainty_loss[:, :, :L],
            prior_gradient=self.prior_gradient[:, :L],
            D=self.D[:, :L],
            W=self.W[:, :, :L],
            G=self.G[:, :, :L, :L],
        )

    def criterion(self, kl_weight: float) -> Float:
        """Return the support criterion F + (1 - kl_weight) Σ D, (B,)."""
        return np.asarray(self.F + (1 - kl_weight) * self.D.sum(axis=1))


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
    mu, s = components.mu, components.variance
    L = mu.shape[1]
    used = np.arange(L) < K[:, None]
    partly_used = min(K.tolist()) < L
    if partly_used:
        s = np.where(used, s, 1.0)
    A, X, h, uncertainty_loss = response.products(Y, mu, s, used if partly_used else None)
    # KL(q ‖ p) = ln 2πI₀(κ) - ½ ln 2πes - κ exp(-s/2) cos(μ-μₚ)
    prior_gradient = components.prior_kappa * np.exp(1j * (mu - components.prior_mu) - 0.5 * s)
    D = components.kl_constant - 0.5 * (LOG_2PIE + np.log(s)) - prior_gradient.real
    each = components.log_odds - D
    if partly_used:
        prior_gradient, D, each = prior_gradient * used, D * used, each * used
    log_prior = log_prior_inactive + each.sum(axis=1)
    W, G, explained, F = amplitudes(response, X[:, :, 0], h[:, :, 0], used, K, nu, tau)
    return Evaluation(
        Y=Y, components=components, K=K, used=used, nu=nu, tau=tau,
        log_prior_inactive=log_prior_inactive, A=A, X=X, h=h, uncertainty_loss=uncertainty_loss,
        prior_gradient=prior_gradient, D=D, log_prior=log_prior, W=W, G=G, explained=explained,
        F=F + log_prior,
    )  # fmt: skip


def with_variances(
    response: ExpectedResponse, evaluation: Evaluation, nu: Float, tau: Float
) -> Evaluation:
    """Return the evaluation with other variances; the angles stay."""
    J, H = evaluation.X[:, :, 0], evaluation.h[:, :, 0]
    W, G, explained, F = amplitudes(response, J, H, evaluation.used, evaluation.K, nu, tau)
    F = F + evaluation.log_prior
    return replace(evaluation, nu=nu, tau=tau, W=W, G=G, explained=explained, F=F)


def amplitudes(
    response: ExpectedResponse, J: Complex, H: Complex, used: Bool, K: Int, nu: Float, tau: Float
) -> tuple[Complex, Complex, Float, Float]:
    """Return Ŵ = G H, G = (J + ν/τ I)⁻¹, Re tr HᴴŴ, and their part of the ELBO.

    F = Σ [Re tr HᴴŴ/ν - M N/ν - M N ln πν + N K ln ν/τ - N ln det(J + ν/τ I)] over bins, over T.
    """
    M, N = response.n_sensors, H.shape[3]
    ratio = nu / tau
    regularised = J.copy()
    ridge = ratio[:, :, None]
    if min(K.tolist()) < J.shape[3]:  # 1 where unused: no part in the determinant
        ridge = np.where(used[:, None], ridge, 1.0)
    diagonals(regularised)[...] += ridge
    G = np.asarray(np.linalg.inv(regularised), dtype=np.complex128)
    W = G @ H
    explained = (H.conj() * W).real.sum(axis=(2, 3))
    volume = K[:, None] * np.log(ratio) - np.linalg.slogdet(regularised)[1]
    if N > 1:
        volume = N * volume
    F = (explained - M * N) / nu - M * N * np.log(np.pi * nu) + volume
    return W, G, explained, response.total(F)
