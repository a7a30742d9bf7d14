"""One damped Newton step on all unknowns together, amplitudes eliminated.

The derivatives are those of the ELBO in `elbo`; η and B are the letters of the derivation, and
equation numbers those of Park, Meyer and Gerstoft, JASA 153(1), 2023.
"""

from __future__ import annotations

import numpy as np

from arrivals.symmetric import between, clamped_inverse, full
from arrivals.trackers.svalse.newton.batch import any_set
from arrivals.trackers.svalse.newton.elbo import Evaluation, evaluate, with_variances
from arrivals.trackers.svalse.newton.expected_response import (
    ExpectedResponse,
    diagonals,
    numbers,
    over_snapshots,
)
from arrivals.trackers.svalse.newton.linear_algebra import clipped_solution
from arrivals.typing import Bool, Complex, Float

ROUNDING = 1e-7  # nats
# Shares of the step of the unknowns, and of that of their covariances, which in full can
# decrease F however short the step of the unknowns.
BACKTRACKING = ((1 / 4, 1.0), (1 / 16, 1.0), (1 / 64, 1.0), (1 / 16, 1 / 16), (1 / 256, 1 / 256))
MIN_FREEDOM_SHARE = 0.15  # of the data, that is left for the noise


def newton_step(
    response: ExpectedResponse, evaluation: Evaluation, estimate_nu: Bool
) -> Evaluation:
    """Take one Newton step, then update ν and τ in some rows; the ELBO never decreases.

    Parameters
    ----------
    response : ExpectedResponse
    evaluation : Evaluation
    estimate_nu : ndarray of bool, shape (B,)
        Rows in which ν and τ are updated.
    """
    v, P = weights(evaluation)
    g, curvature = slopes(response, evaluation, v, P)  # (33)
    N = negative_hessian(response, evaluation, P, curvature)
    d = ascent_direction(g, N, longest=response.chart.longest_step)
    s = clamped_inverse(curvature, 1 / response.chart.max_variance)
    best = take_step(response, evaluation, d, s)
    worse = decreased(best, evaluation)
    if any_set(worse):
        shorter = backtrack(response, evaluation.select(worse), d[worse], s[worse])
        best = best.replace_rows(worse, shorter)
    if any_set(estimate_nu):
        best = best.replace_rows(estimate_nu, update_variances(response, best.select(estimate_nu)))
    return best


def weights(evaluation: Evaluation) -> tuple[Complex, Complex]:
    """Return Ŵ*/ν, (B, F, L, N), and Pₗₗ' = Σ ŵ*ₗ ŵₗ'/ν + N Gₗ'ₗ, (B, F, L, L)."""
    v = evaluation.W.conj() / evaluation.nu[:, :, None, None]
    G, N = evaluation.G.swapaxes(2, 3), v.shape[3]
    return v, v @ evaluation.W.swapaxes(2, 3) + (G if N == 1 else N * G)


def slopes(
    response: ExpectedResponse, evaluation: Evaluation, v: Complex, P: Complex
) -> tuple[Float, Float]:
    """Return ∂F/∂x, (B, d, L), and the curvature with the amplitudes held, -∂²F/∂x∂x.

    The curvature is that of each component alone, (B, d(d+1)/2, L). The fixed point of the
    covariances is S = curvature⁻¹: ∂F/∂S = S⁻¹/2 - curvature/2.
    """
    d, n = response.n_unknowns, evaluation.h.shape[2]
    # Re (∂â)ᴴη and Re (∂²â)ᴴη, with ηₗ = 2/ν Σ w*ₗ y - 2 Σ Pₗₗ' âₗ' over all others   (33)
    alone = over_snapshots(v[:, :, None] * evaluation.h[:, :, 1:])
    others = np.add.reduce(P[:, :, None] * evaluation.X[:, :, 1:n], axis=4)
    both = 2 * response.total((alone - others).real)
    return both[:, :d] - evaluation.prior_gradient, evaluation.prior_curvature - both[:, d:]


def negative_hessian(
    response: ExpectedResponse, evaluation: Evaluation, P: Complex, curvature: Float
) -> Float:
    """Return -∂²F/∂x∂x' with the amplitudes eliminated, (B, dL, dL), unknowns first.

    One term of second order, tr(G ∂J G ∂J), is left out.
    """
    d, W = response.n_unknowns, evaluation.W
    B_, F, L, N = W.shape
    TA = evaluation.X[:, :, 1 : 1 + d]
    # a matrix for each snapshot, row (i, l): the derivative of (J + ν/τ I) w - h in xᵢ of l
    B: Complex = np.multiply(
        TA.conj()[:, :, None], W.swapaxes(2, 3)[:, :, :, None, :, None], order="C"
    )
    own = TA @ W[:, :, None] - evaluation.h[:, :, 1 : 1 + d]
    diagonals(B)[...] += own.transpose(0, 1, 4, 2, 3)
    B = B.reshape(B_, F, N, d * L, L)
    gained = (B.conj() @ evaluation.G[:, :, None] @ B.swapaxes(3, 4)).real
    gained = gained[:, :, 0] if N == 1 else gained.sum(axis=2)
    products = (P[:, :, None, None] * evaluation.second_products).real
    products = products.swapaxes(3, 4).reshape(B_, F, d * L, d * L)
    H = 2 * response.total(products - gained / evaluation.nu[:, :, None, None])
    add_blocks(H, curvature)
    return H


def add_blocks(H: Float, blocks: Float) -> None:
    """Add matrices of each component, (B, d(d+1)/2, L), to the block diagonal of (B, dL, dL)."""
    L, d = blocks.shape[2], H.shape[1] // blocks.shape[2]
    if d == 1:
        diagonals(H)[...] += blocks[:, 0]
        return
    each = np.arange(L)
    H.reshape(-1, d, L, d, L)[:, :, each, :, each] += full(blocks).transpose(3, 0, 1, 2)


def ascent_direction(g: Float, N: Float, longest: float) -> Float:
    """Return the step N⁻¹ g, (B, d, L), with the eigenvalues of N made positive.

    No component moves by more than `longest`.
    """
    d = clipped_solution(N, g.reshape(len(g), -1)).reshape(g.shape)
    size = np.abs(d) if g.shape[1] == 1 else np.hypot(d[:, :1], d[:, 1:])
    size = size.max(axis=2, keepdims=True)
    return np.asarray(d * np.minimum(1.0, longest / np.maximum(size, 1e-300)))


def take_step(response: ExpectedResponse, old: Evaluation, d: Float, s: Float) -> Evaluation:
    """Return the evaluation after a step d of the unknowns, with their covariances s."""
    components = old.components.copy()
    components.point[...] = response.chart.move(components.point, d)
    components.covariance[...] = s
    return evaluate(response, old.Y, components, old.K, old.nu, old.tau, old.log_prior_inactive)


def backtrack(response: ExpectedResponse, old: Evaluation, d: Float, s: Float) -> Evaluation:
    """Return the evaluation after the first shorter step that does not decrease F."""
    best, undecided = old, np.ones(len(old), dtype=np.bool_)
    for alpha, beta in BACKTRACKING:
        part = old.select(undecided)
        covariance = between(part.components.covariance, s[undecided], beta)
        trial = take_step(response, part, alpha * d[undecided], covariance)
        good = ~decreased(trial, part)
        rows = undecided.copy()
        rows[undecided] = good
        if any_set(good):
            best = best.replace_rows(rows, trial.select(good))
        undecided = undecided & ~rows
        if not any_set(undecided):
            break
    return best


def decreased(new: Evaluation, old: Evaluation) -> Bool:
    """Return the rows in which F decreased by more than rounding."""
    return np.asarray(~(new.F >= old.F - ROUNDING))


def update_variances(response: ExpectedResponse, old: Evaluation) -> Evaluation:
    """Return the evaluation with ν and τ by their fixed points, (58) and (59).

    ν with effective degrees of freedom has the fixed point of (58), and is some 1.5 K/M times
    nearer to it. Where F decreases the EM step (58) is taken, for which it cannot.
    """
    M, N = old.Y.shape[2:]
    w2 = over_snapshots(old.W.real**2 + old.W.imag**2)
    energy, S = np.add.reduce(w2, axis=2), uncertainty_losses(response, old, w2)
    nu, tau, K, explained, energy, trace, S = numbers(
        old.nu, old.tau, old.K[:, None], old.explained, energy, amplitude_traces(old), S
    )
    ratio = nu / tau
    # ‖Y‖² - 2 Re tr HᴴŴ + tr ŴᴴJŴ, since JŴ = H - ν/τ Ŵ and ‖Y‖² = M N
    E = M * N - explained - ratio * energy
    gamma = N * (K - ratio * trace)  # N tr JG
    freedom = np.maximum(M * N - gamma - S / nu, MIN_FREEDOM_SHARE * M * N)
    new_nu = np.maximum((E - S) / freedom, response.noise_floor)
    # τ = Σ (|ŵ|² + ν G) / N K   (59)
    tau = (energy + N * nu * trace) / np.maximum(N * K, 1)
    # ν = (E + ν N tr JG) / M N   (58)
    em = np.maximum((E + nu * gamma) / (M * N), response.noise_floor)
    nu, tau, em = (np.reshape(each, old.nu.shape) for each in (new_nu, tau, em))
    new = with_variances(response, old, nu, floored(response, old, nu, tau))
    worse = decreased(new, old)
    if any_set(worse):
        part, em = old.select(worse), em[worse]
        tau = floored(response, part, em, tau[worse])
        new = new.replace_rows(worse, with_variances(response, part, em, tau))
    return new


def noise_freedom(response: ExpectedResponse, evaluation: Evaluation) -> Float:
    """Return the complex degrees of freedom left for the noise of each bin, (B, F)."""
    M, N = evaluation.Y.shape[2:]
    w2 = over_snapshots(evaluation.W.real**2 + evaluation.W.imag**2)
    ratio = evaluation.nu / evaluation.tau
    gamma = N * (evaluation.K[:, None] - ratio * amplitude_traces(evaluation))
    S = uncertainty_losses(response, evaluation, w2)
    freedom = M * N - gamma - S / evaluation.nu
    return np.asarray(np.maximum(freedom, MIN_FREEDOM_SHARE * M * N))


def amplitude_traces(evaluation: Evaluation) -> Float:
    """Return tr G of the used slots, (B, F)."""
    return np.asarray(np.vecdot(diagonals(evaluation.G).real, evaluation.used[:, None]))


def uncertainty_losses(response: ExpectedResponse, evaluation: Evaluation, w2: Float) -> Float:
    """Return the power lost by uncertainty, (B, F), at most half of all the amplitudes' d."""
    most = 0.5 * response.n_unknowns * response.tempering * evaluation.K[:, None] * evaluation.nu
    return np.asarray(np.minimum(np.vecdot(w2, evaluation.uncertainty_loss), most))


def floored(response: ExpectedResponse, old: Evaluation, nu: Float, tau: Float) -> Float:
    """Return τ, not below the smallest power of a source; the old one without components."""
    if response.power_floor:
        tau = np.maximum(tau, response.power_floor * nu / response.norm2[:, 0])
    return np.where(old.K[:, None] > 0, tau, old.tau) if 0 in old.K.tolist() else tau
