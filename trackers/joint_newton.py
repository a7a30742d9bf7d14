"""One damped Newton step on all angles of a line spectrum together, amplitudes eliminated.

The derivatives are those of the ELBO in `joint_elbo`; η and B are the letters of the derivation.
"""

from __future__ import annotations

import numpy as np

from arrivals.trackers.joint_elbo import (
    MU,
    Response,
    S,
    State,
    diagonals,
    evaluate,
    with_variances,
)
from arrivals.trackers.noise_start import NOISE_FLOOR
from arrivals.typing import Bool, Complex, Float

LARGEST_VARIANCE = 0.3  # rad²: a wrapped normal density of more is no longer normal
ROUNDING = 1e-7  # nats
SMALLEST_CURVATURE = 1e-3  # of the largest: what is flatter is no direction to run along


def weights(state: State) -> tuple[Complex, Complex]:
    """Return ŵ*/ν, (B, L), and Pₗₗ' = ŵ*ₗ ŵₗ'/ν + Gₗ'ₗ, (B, L, L)."""
    v = state.w.conj() / state.nu[:, None]
    return v, v[:, :, None] * state.w[:, None] + state.G.swapaxes(1, 2)


def slopes(state: State, v: Complex, P: Complex) -> tuple[Float, Float]:
    """Return ∂F/∂μ and the curvature with the amplitudes held, -∂²F/∂μ², both (B, L).

    The fixed point of the variances is s = 1/curvature: ∂F/∂s = 1/2s - curvature/2.
    """
    # Re (∂â)ᴴη and Re (∂²â)ᴴη, with ηₗ = 2/ν w*ₗ y - 2 Σ Pₗₗ' âₗ' over all others (33)
    others = (P[:, None] * state.X[:, 1:3]).sum(axis=3)
    both = 2 * (v[:, None] * state.h[:, 1:] - others).real
    return both[:, 0] - state.pull.imag, state.pull.real - both[:, 1]


def negative_hessian(state: State, P: Complex, curvature: Float) -> Float:
    """Return -∂²F/∂μ∂μ' with the amplitudes eliminated, (B, L, L).

    One term of second order, tr(G ∂J G ∂J), is left out.
    """
    TA, w = state.X[:, 1], state.w[:, :, None]
    B = TA.conj() * -w  # row l: the derivative of h - (J + ν/τ I) w with respect to μₗ
    diagonals(B)[...] = state.h[:, 1] - (TA @ w)[:, :, 0]
    gained = (B.conj() @ state.G @ B.swapaxes(1, 2)).real / state.nu[:, None, None]
    N = np.asarray(2 * ((P * state.TT).real - gained))
    diagonals(N)[...] += curvature
    return N


def direction(g: Float, N: Float, longest: float) -> Float:
    """Return the step N⁻¹ g with the eigenvalues of N made positive, its entries ≤ longest."""
    eigenvalues, V = np.linalg.eigh(N)
    steep = np.abs(eigenvalues)
    steep = np.maximum(steep, SMALLEST_CURVATURE * steep.max(axis=1, keepdims=True) + 1e-300)
    d = (V @ ((V.swapaxes(1, 2) @ g[:, :, None]) / steep[:, :, None]))[:, :, 0]
    size = np.abs(d).max(axis=1, keepdims=True)
    return np.asarray(d * np.minimum(1.0, longest / np.maximum(size, 1e-300)))


def ascend(response: Response, state: State, learn: Bool) -> State:
    """Take one Newton step, and learn ν and τ in the rows that say so; the ELBO never falls.

    Parameters
    ----------
    response : Response
    state : State
    learn : ndarray of bool, shape (B,)
    """
    v, P = weights(state)
    g, curvature = slopes(state, v, P)
    d = direction(g, negative_hessian(state, P, curvature), 2 / response.extent)
    s = 1 / np.maximum(curvature, 1 / LARGEST_VARIANCE)
    best = moved(response, state, d, s)
    worse = fell(best, state)
    if worse.any():
        best = best.put(worse, shortened(response, state.take(worse), d[worse], s[worse]))
    if learn.any():
        best = best.put(learn, learned(response, best.take(learn)))
    return best


def moved(response: Response, state: State, d: Float, s: Float) -> State:
    """Return the state with the angles moved by d and of the variances s."""
    facts = state.facts.copy()
    facts[:, MU] += d
    facts[:, S] = s
    return evaluate(response, state.y, facts, state.K, state.nu, state.tau, state.rest)


def shortened(response: Response, state: State, d: Float, s: Float) -> State:
    """Return the state after the longest of three shorter steps that does not make F fall."""
    best, left = state, np.ones(len(state), dtype=np.bool_)
    for alpha in (1 / 4, 1 / 16, 1 / 64):
        trial = moved(response, state.take(left), alpha * d[left], s[left])
        good = ~fell(trial, state.take(left))
        rows = left.copy()
        rows[left] = good
        if good.any():
            best = best.put(rows, trial.take(good))
        left = left & ~rows
        if not left.any():
            break
    return best


def fell(new: State, old: State) -> Bool:
    """Tell in which rows F fell by more than rounding."""
    return np.asarray(~(new.F >= old.F - ROUNDING))


def learned(response: Response, state: State) -> State:
    """Return the state with ν and τ by their fixed points, ν with effective degrees of freedom.

    It has the fixed points of (58) and (59), and is some 1.5 K/M times nearer to them. Where F
    falls the EM step (58) is taken, for which it cannot.
    """
    M, K, ratio = state.y.shape[1], state.K, state.nu / state.tau
    w2 = state.w.real**2 + state.w.imag**2
    energy = w2.sum(axis=1)
    trace = (state.G.diagonal(axis1=1, axis2=2).real * state.used).sum(axis=1)
    # ‖y‖² - 2 Re hᴴŵ + ŵᴴJŵ, since Jŵ = h - ν/τ ŵ and ‖y‖² = M
    E = M - state.explained - ratio * energy
    gamma = K - ratio * trace  # tr JG
    lost = (w2 * (response.norm2 - state.size)).sum(axis=1)
    S = np.minimum(lost, 0.5 * K * state.nu)
    freedom = np.maximum(M - gamma - S / state.nu, 0.15 * M)
    nu = np.maximum((E - S) / freedom, NOISE_FLOOR)
    tau = np.where(K > 0, (energy + state.nu * trace) / np.maximum(K, 1), state.tau)
    new = with_variances(state, nu, tau)
    worse = fell(new, state)
    if worse.any():
        em = np.maximum((E + state.nu * gamma) / M, NOISE_FLOOR)
        slow = with_variances(state.take(worse), em[worse], tau[worse])
        new = new.put(worse, slow)
    return new
