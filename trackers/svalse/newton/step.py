"""One damped Newton step on all angles together, amplitudes eliminated.

The derivatives are those of the ELBO in `joint_elbo`; η and B are the letters of the derivation.
"""

from __future__ import annotations

import numpy as np

from arrivals.trackers.svalse.newton.batch import some
from arrivals.trackers.svalse.newton.elbo import MU, Evaluation, S, evaluate, with_variances
from arrivals.trackers.svalse.newton.expected_response import (
    ExpectedResponse,
    diagonals,
    over_snapshots,
)
from arrivals.typing import Bool, Complex, Float

LARGEST_VARIANCE = 0.3  # rad²: a wrapped normal density of more is no longer normal
ROUNDING = 1e-7  # nats
# Shares of the way of the angles, and of the logarithms of their variances, which in full can make
# F fall however short the step of the angles.
SHORTER = ((1 / 4, 1.0), (1 / 16, 1.0), (1 / 64, 1.0), (1 / 16, 1 / 16), (1 / 256, 1 / 256))
SMALLEST_CURVATURE = 1e-3  # of the largest: what is flatter is no direction to run along


def weights(state: Evaluation) -> tuple[Complex, Complex]:
    """Return Ŵ*/ν, (B, F, L, N), and Pₗₗ' = Σ ŵ*ₗ ŵₗ'/ν + N Gₗ'ₗ, (B, F, L, L)."""
    v = state.W.conj() / state.nu[:, :, None, None]
    G, N = state.G.swapaxes(2, 3), v.shape[3]
    return v, v @ state.W.swapaxes(2, 3) + (G if N == 1 else N * G)


def slopes(
    response: ExpectedResponse, state: Evaluation, v: Complex, P: Complex
) -> tuple[Float, Float]:
    """Return ∂F/∂μ and the curvature with the amplitudes held, -∂²F/∂μ², both (B, L).

    The fixed point of the variances is s = 1/curvature: ∂F/∂s = 1/2s - curvature/2.
    """
    # Re (∂â)ᴴη and Re (∂²â)ᴴη, with ηₗ = 2/ν Σ w*ₗ y - 2 Σ Pₗₗ' âₗ' over all others (33)
    alone = over_snapshots(v[:, :, None] * state.h[:, :, 1:])
    others = (P[:, :, None] * state.X[:, :, 1:3]).sum(axis=4)
    both = 2 * response.total((alone - others).real)
    return both[:, 0] - state.pull.imag, state.pull.real - both[:, 1]


def negative_hessian(
    response: ExpectedResponse, state: Evaluation, P: Complex, curvature: Float
) -> Float:
    """Return -∂²F/∂μ∂μ' with the amplitudes eliminated, (B, L, L).

    One term of second order, tr(G ∂J G ∂J), is left out.
    """
    TA, W = state.X[:, :, 1], state.W
    # a matrix for each look, row l: the derivative of h - (J + ν/τ I) w with respect to μₗ
    B: Complex = np.multiply(TA.conj()[:, :, None], -W.swapaxes(2, 3)[..., None], order="C")
    diagonals(B)[...] += (state.h[:, :, 1] - TA @ W).swapaxes(2, 3)
    gained = (B.conj() @ state.G[:, :, None] @ B.swapaxes(3, 4)).real
    gained = gained[:, :, 0] if gained.shape[2] == 1 else gained.sum(axis=2)
    looks = (P * state.TT).real - gained / state.nu[:, :, None, None]
    N = 2 * response.total(looks)
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


def ascend(response: ExpectedResponse, state: Evaluation, learn: Bool) -> Evaluation:
    """Take one Newton step, and learn ν and τ in the rows that say so; the ELBO never falls.

    Parameters
    ----------
    response : Response
    state : State
    learn : ndarray of bool, shape (B,)
    """
    v, P = weights(state)
    g, curvature = slopes(response, state, v, P)
    d = direction(g, negative_hessian(response, state, P, curvature), 2 / response.extent)
    s = 1 / np.maximum(curvature, 1 / LARGEST_VARIANCE)
    best = moved(response, state, d, s)
    worse = fell(best, state)
    if some(worse):
        best = best.put(worse, shortened(response, state.take(worse), d[worse], s[worse]))
    if some(learn):
        best = best.put(learn, learned(response, best.take(learn)))
    return best


def moved(response: ExpectedResponse, state: Evaluation, d: Float, s: Float) -> Evaluation:
    """Return the state with the angles moved by d and of the variances s."""
    facts = state.facts.copy()
    facts[:, MU] += d
    facts[:, S] = s
    return evaluate(response, state.Y, facts, state.K, state.nu, state.tau, state.rest)


def shortened(response: ExpectedResponse, state: Evaluation, d: Float, s: Float) -> Evaluation:
    """Return the state after the first of some shorter steps that does not make F fall."""
    best, left = state, np.ones(len(state), dtype=np.bool_)
    way = s / np.where(state.used, state.facts[:, S], s)
    for alpha, beta in SHORTER:
        part = state.take(left)
        trial = moved(response, part, alpha * d[left], part.facts[:, S] * way[left] ** beta)
        good = ~fell(trial, part)
        rows = left.copy()
        rows[left] = good
        if some(good):
            best = best.put(rows, trial.take(good))
        left = left & ~rows
        if not some(left):
            break
    return best


def fell(new: Evaluation, old: Evaluation) -> Bool:
    """Tell in which rows F fell by more than rounding."""
    return np.asarray(~(new.F >= old.F - ROUNDING))


def learned(response: ExpectedResponse, state: Evaluation) -> Evaluation:
    """Return the state with ν and τ by their fixed points, ν with effective degrees of freedom.

    It has the fixed points of (58) and (59), and is some 1.5 K/M times nearer to them. Where F
    falls the EM step (58) is taken, for which it cannot.
    """
    M, N = state.Y.shape[2:]
    K, ratio, T = state.K[:, None], state.nu / state.tau, response.temper
    w2 = over_snapshots(state.W.real**2 + state.W.imag**2)
    energy = w2.sum(axis=2)
    trace = (diagonals(state.G).real * state.used[:, None]).sum(axis=2)
    # ‖Y‖² - 2 Re tr HᴴŴ + tr ŴᴴJŴ, since JŴ = H - ν/τ Ŵ and ‖Y‖² = M N
    E = M * N - state.explained - ratio * energy
    gamma = N * (K - ratio * trace)  # N tr JG
    S = np.minimum((w2 * state.lost).sum(axis=2), 0.5 * T * K * state.nu)
    freedom = np.maximum(M * N - gamma - S / state.nu, 0.15 * M * N)
    nu = np.maximum((E - S) / freedom, response.noise_floor)
    tau = (energy + N * state.nu * trace) / np.maximum(N * K, 1)
    new = with_variances(response, state, nu, floored(response, state, nu, tau))
    worse = fell(new, state)
    if some(worse):
        em = np.maximum((E + state.nu * gamma) / (M * N), response.noise_floor)[worse]
        part = state.take(worse)
        tau = floored(response, part, em, tau[worse])
        new = new.put(worse, with_variances(response, part, em, tau))
    return new


def floored(response: ExpectedResponse, state: Evaluation, nu: Float, tau: Float) -> Float:
    """Return τ, not below the power that counts as a source; the old one where there is none."""
    if response.power_floor:
        tau = np.maximum(tau, response.power_floor * nu / response.norm2[:, 0])
    return np.where(state.K[:, None] > 0, tau, state.tau) if 0 in state.K.tolist() else tau
