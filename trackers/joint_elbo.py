"""The ELBO of a line spectrum as a smooth function of all its angles.

The angles have wrapped normal densities; amplitudes and their covariance are eliminated in closed
form. Arrays have a leading axis of independent problems, (B, ...), and places for L components of
which the first K are in use.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from arrivals.measurement_models.manifolds import Manifold
from arrivals.trackers.rows import Rows
from arrivals.typing import Bool, Complex, Float, Int

Array = TypeVar("Array", Float, Complex)

# What is known of a component: rows of the arrays of components, (B, 7, L).
MU, S = 0, 1  # mean and variance of its angle
PRIOR_MU, PRIOR_KAPPA = 2, 3  # of the predicted von Mises density
ODDS = 4  # prior log odds of being active
KL_CONSTANT = 5  # ln 2π I₀(κ)
PLACE = 6  # in the memory of the step; -1 while on trial
N_FACTS = 7


class Response:
    """Mean steering vectors of wrapped normal angles, â = G ⟨d⟩ with ⟨d_k⟩ = exp(jkμ - k²s/2).

    Parameters
    ----------
    manifold : Manifold
        Of one bin, without a second parameter, and with constant ‖a(θ)‖².

    Attributes
    ----------
    extent : float
        Sensors of the filled line that resolves as well: 1/extent is the scale of its beam.
    """

    def __init__(self, manifold: Manifold) -> None:
        self.manifold = manifold
        k = manifold.harmonics.astype(np.float64)
        self.jk, self.half_k2 = 1j * k, k * k / 2
        self.factors = np.stack([np.ones(len(k)), 1j * k, -k * k])[:, None]
        self.norm2 = manifold.norm_squared()
        self.G = None if manifold.coefficients is None else manifold.coefficients[0, 0]
        weight = np.ones(len(k)) if self.G is None else (np.abs(self.G) ** 2).sum(axis=0)
        weight /= weight.sum()
        self.extent = np.sqrt(12 * float(weight @ (k - weight @ k) ** 2) + 1)

    def __call__(self, mu: Float, s: Float) -> Complex:
        """Return â, ∂â/∂μ and ∂²â/∂μ² = 2 ∂â/∂s for angles (B, L): (B, 3, L, n_sensors)."""
        d = np.exp(mu[..., None] * self.jk - s[..., None] * self.half_k2)
        d = d[:, None] * self.factors
        return d if self.G is None else np.asarray(d @ self.G.T)

    def at(self, theta: Float) -> tuple[Complex, Float | float]:
        """Return a(θ) and ‖∂a/∂θ‖² at known angles (n,): (n, n_sensors), and (n,) or a constant."""
        A = np.exp(theta[:, None] * self.jk)
        if self.G is None:
            return A, 2 * float(self.half_k2.sum())
        T = (A * self.jk) @ self.G.T
        return A @ self.G.T, np.asarray((T.real**2 + T.imag**2).sum(axis=1))

    def products(self, stack: Complex) -> Complex:
        """Return âᴴâ, (∂â)ᴴâ, (∂²â)ᴴâ, and (∂â)ᴴ∂â where it is not -(∂²â)ᴴâ: (B, 3 or 4, L, L)."""
        B, _, L, M = stack.shape
        A = stack[:, 0].swapaxes(1, 2)
        X = (stack.reshape(B, 3 * L, M).conj() @ A).reshape(B, 3, L, L)
        if self.G is None:
            return X
        T = stack[:, 1]
        return np.concatenate([X, (T.conj() @ T.swapaxes(1, 2))[:, None]], axis=1)


@dataclass(eq=False)
class State(Rows):
    """Components, variances, and all that follows from them; never written into.

    Attributes
    ----------
    y : ndarray, shape (B, n_sensors)
        Snapshots, of unit power: ‖y‖² is the number of sensors.
    facts : ndarray, shape (B, 7, L)
        The components; see the names of the rows above.
    K : ndarray of int, shape (B,)
    used : ndarray of bool, shape (B, L)
        Which places hold a component.
    nu, tau, rest : ndarray, shape (B,)
        Variances of noise and amplitudes; Σ ln(1-ρ) where ρ is not given, else 0.
    A : ndarray, shape (B, L, n_sensors)
        Mean steering vectors â.
    X : ndarray, shape (B, 3 or 4, L, L)
        `Response.products`; the diagonals are ‖a‖² in the first and 0 in the others.
    h : ndarray, shape (B, 3, L)
        âᴴy, (∂â)ᴴy, (∂²â)ᴴy.
    size : ndarray, shape (B, L)
        ‖â‖².
    pull : ndarray, shape (B, L)
        κ exp(-s/2 + j(μ-μₚ)): what the prior adds to gradient and curvature.
    D : ndarray, shape (B, L)
        KL divergence of each angle's density from its prior.
    prior : ndarray, shape (B,)
        What odds and divergences give to the ELBO.
    w, G : ndarray, shapes (B, L), (B, L, L)
        Means of the amplitudes; their covariance is ν G.
    explained : ndarray, shape (B,)
        hᴴŵ.
    F : ndarray, shape (B,)
        The ELBO, up to a constant of the step.
    """

    y: Complex
    facts: Float
    K: Int
    used: Bool
    nu: Float
    tau: Float
    rest: Float
    A: Complex
    X: Complex
    h: Complex
    size: Float
    pull: Complex
    D: Float
    prior: Float
    w: Complex
    G: Complex
    explained: Float
    F: Float

    def __len__(self) -> int:
        return len(self.K)

    @property
    def TT(self) -> Complex:
        """(∂â)ᴴ∂â off the diagonal, (B, L, L)."""
        return self.X[:, 3] if self.X.shape[1] == 4 else -self.X[:, 2]

    def trimmed(self) -> State:
        """Return the same without places that no problem uses."""
        L = max(int(self.K.max()), 1)
        if self.facts.shape[2] == L:
            return self
        return State(
            self.y, self.facts[:, :, :L], self.K, self.used[:, :L], self.nu, self.tau, self.rest,
            self.A[:, :L], self.X[:, :, :L, :L], self.h[:, :, :L], self.size[:, :L],
            self.pull[:, :L], self.D[:, :L], self.prior, self.w[:, :L], self.G[:, :L, :L],
            self.explained, self.F,
        )  # fmt: skip

    def criterion(self, kl: float) -> Float:
        """Return the support criterion F + (1 - kl) Σ D, (B,)."""
        return np.asarray(self.F + (1 - kl) * self.D.sum(axis=1))


def evaluate(
    response: Response, y: Complex, facts: Float, K: Int, nu: Float, tau: Float, rest: Float
) -> State:
    """Return the state of given components and variances."""
    B, _, L = facts.shape
    used = np.arange(L) < K[:, None]
    padded = min(K.tolist()) < L
    s = np.where(used, facts[:, S], 1.0) if padded else facts[:, S]
    stack = response(facts[:, MU], s)
    if padded:
        stack = stack * used[:, None, :, None]
    X = response.products(stack)
    own = diagonals(X)
    size = own[:, 0].real.copy()
    own[...] = 0
    own[:, 0] = response.norm2 * used if padded else response.norm2
    h = (stack.reshape(B, 3 * L, -1).conj() @ y[:, :, None]).reshape(B, 3, L)
    turn = np.exp(1j * (facts[:, MU] - facts[:, PRIOR_MU]) - 0.5 * s)
    pull = facts[:, PRIOR_KAPPA] * turn
    D = facts[:, KL_CONSTANT] - 0.5 * np.log(2 * np.pi * np.e * s) - pull.real
    each = facts[:, ODDS] - D
    if padded:
        pull, D, each = pull * used, D * used, each * used
    prior = rest + each.sum(axis=1)
    w, G, explained, F = amplitudes(X[:, 0], h[:, 0], used, K, nu, tau, y.shape[1])
    return State(
        y, facts, K, used, nu, tau, rest, stack[:, 0], X, h, size, pull, D, prior,
        w, G, explained, F + prior,
    )  # fmt: skip


def diagonals(X: Array) -> Array:
    """Return the diagonals (..., L) of contiguous matrices (..., L, L), to be read and written."""
    L = X.shape[-1]
    return X.reshape(*X.shape[:-2], L * L)[..., :: L + 1]


def with_variances(state: State, nu: Float, tau: Float) -> State:
    """Return the state with other variances; the angles stay."""
    s = state
    w, G, explained, F = amplitudes(s.X[:, 0], s.h[:, 0], s.used, s.K, nu, tau, s.y.shape[1])
    return State(
        s.y, s.facts, s.K, s.used, nu, tau, s.rest, s.A, s.X, s.h, s.size, s.pull, s.D, s.prior,
        w, G, explained, F + s.prior,
    )  # fmt: skip


def amplitudes(
    J: Complex, h: Complex, used: Bool, K: Int, nu: Float, tau: Float, M: int
) -> tuple[Complex, Complex, Float, Float]:
    """Return ŵ = G h, G = (J + ν/τ I)⁻¹, hᴴŵ, and what all this gives to the ELBO."""
    ratio = nu / tau
    regularised = J.copy()
    # 1 where unused: no part in the determinant
    diagonals(regularised)[...] += np.where(used, ratio[:, None], 1.0)
    G = np.asarray(np.linalg.inv(regularised), dtype=np.complex128)
    w = (G @ h[:, :, None])[:, :, 0]
    explained = (h.conj() * w).real.sum(axis=1)
    F = (explained - M) / nu - M * np.log(np.pi * nu) + K * np.log(ratio)
    return w, G, explained, F - np.linalg.slogdet(regularised)[1]
