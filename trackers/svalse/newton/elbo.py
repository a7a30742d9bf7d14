"""The ELBO of some looks as a smooth function of all their angles.

The angles have wrapped normal densities; amplitudes and their covariance are eliminated in closed
form. Arrays have a leading axis of independent problems, (B, ...), then, where it matters, one of
F frequency bins, and places for L components of which the first K are in use. The looks of a bin
are its N snapshots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.trackers.svalse.newton.batch import BatchRecord
from arrivals.trackers.svalse.newton.expected_response import ExpectedResponse, diagonals
from arrivals.typing import Bool, Complex, Float, Int

# What is known of a component: rows of the arrays of components, (B, 7, L).
MU, S = 0, 1  # mean and variance of its angle
PRIOR_MU, PRIOR_KAPPA = 2, 3  # of the predicted von Mises density
ODDS = 4  # prior log odds of being active
KL_CONSTANT = 5  # ln 2π I₀(κ)
PLACE = 6  # in the memory of the step; -1 while on trial
N_FACTS = 7
LOG_2PIE = float(np.log(2 * np.pi * np.e))


@dataclass(eq=False)
class Evaluation(BatchRecord):
    """Components, variances, and all that follows from them; never written into.

    Attributes
    ----------
    Y : ndarray, shape (B, F, n_sensors, N)
        Looks, each bin of unit power: ‖Y‖² is n_sensors N.
    facts : ndarray, shape (B, 7, L)
        The components; see the names of the rows above.
    K : ndarray of int, shape (B,)
    used : ndarray of bool, shape (B, L)
        Which places hold a component.
    nu, tau : ndarray, shape (B, F)
        Variances of noise and amplitudes.
    rest : ndarray, shape (B,)
        Σ ln(1-ρ) where ρ is not given, else 0.
    A : ndarray, shape (B, F, L, n_sensors)
        Mean steering vectors â.
    X : ndarray, shape (B, F, 3 or 4, L, L)
        `ExpectedResponse.products`; the diagonals are ⟨‖a‖²⟩ in the first, and half its first and
        second
        derivatives in the second and third.
    h : ndarray, shape (B, F, 3, L, N)
        âᴴY, (∂â)ᴴY, (∂²â)ᴴY.
    lost : ndarray, shape (B, F, L)
        ⟨‖a‖²⟩ - ‖â‖².
    pull : ndarray, shape (B, L)
        κ exp(-s/2 + j(μ-μₚ)): what the prior adds to gradient and curvature.
    D : ndarray, shape (B, L)
        KL divergence of each angle's density from its prior.
    prior : ndarray, shape (B,)
        What odds and divergences give to the ELBO.
    W, G : ndarray, shapes (B, F, L, N), (B, F, L, L)
        Means of the amplitudes; their covariance, that of every look of a bin, is ν G.
    explained : ndarray, shape (B, F)
        Re tr HᴴŴ.
    F : ndarray, shape (B,)
        The ELBO, up to a constant of the step.
    """

    Y: Complex
    facts: Float
    K: Int
    used: Bool
    nu: Float
    tau: Float
    rest: Float
    A: Complex
    X: Complex
    h: Complex
    lost: Float
    pull: Complex
    D: Float
    prior: Float
    W: Complex
    G: Complex
    explained: Float
    F: Float

    def __len__(self) -> int:
        return len(self.K)

    @property
    def TT(self) -> Complex:
        """(∂â)ᴴ∂â off the diagonal, (B, F, L, L)."""
        return self.X[:, :, 3] if self.X.shape[2] == 4 else -self.X[:, :, 2]

    def trimmed(self) -> Evaluation:
        """Return the same without places that no problem uses."""
        L = max(*self.K.tolist(), 1)
        if self.facts.shape[2] == L:
            return self
        return Evaluation(
            self.Y, self.facts[:, :, :L], self.K, self.used[:, :L], self.nu, self.tau, self.rest,
            self.A[:, :, :L], self.X[..., :L, :L], self.h[:, :, :, :L], self.lost[:, :, :L],
            self.pull[:, :L], self.D[:, :L], self.prior, self.W[:, :, :L], self.G[:, :, :L, :L],
            self.explained, self.F,
        )  # fmt: skip

    def criterion(self, kl: float) -> Float:
        """Return the support criterion F + (1 - kl) Σ D, (B,)."""
        return np.asarray(self.F + (1 - kl) * self.D.sum(axis=1))


def evaluate(
    response: ExpectedResponse, Y: Complex, facts: Float, K: Int, nu: Float, tau: Float, rest: Float
) -> Evaluation:
    """Return the state of given components and variances."""
    L = facts.shape[2]
    used = np.arange(L) < K[:, None]
    padded = min(K.tolist()) < L
    mu, s = facts[:, MU], facts[:, S]
    if padded:
        s = np.where(used, s, 1.0)
    A, X, h, lost = response.products(Y, mu, s, used if padded else None)
    pull = facts[:, PRIOR_KAPPA] * np.exp(1j * (mu - facts[:, PRIOR_MU]) - 0.5 * s)
    D = facts[:, KL_CONSTANT] - 0.5 * (LOG_2PIE + np.log(s)) - pull.real
    each = facts[:, ODDS] - D
    if padded:
        pull, D, each = pull * used, D * used, each * used
    prior = rest + each.sum(axis=1)
    W, G, explained, F = amplitudes(response, X[:, :, 0], h[:, :, 0], used, K, nu, tau)
    return Evaluation(
        Y, facts, K, used, nu, tau, rest, A, X, h, lost, pull, D, prior, W, G, explained, F + prior
    )


def with_variances(
    response: ExpectedResponse, state: Evaluation, nu: Float, tau: Float
) -> Evaluation:
    """Return the state with other variances; the angles stay."""
    s = state
    W, G, explained, F = amplitudes(response, s.X[:, :, 0], s.h[:, :, 0], s.used, s.K, nu, tau)
    return Evaluation(
        s.Y, s.facts, s.K, s.used, nu, tau, s.rest, s.A, s.X, s.h, s.lost, s.pull, s.D, s.prior,
        W, G, explained, F + s.prior,
    )  # fmt: skip


def amplitudes(
    response: ExpectedResponse, J: Complex, H: Complex, used: Bool, K: Int, nu: Float, tau: Float
) -> tuple[Complex, Complex, Float, Float]:
    """Return Ŵ = G H, G = (J + ν/τ I)⁻¹, Re tr HᴴŴ, and what all this gives to the ELBO.

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
