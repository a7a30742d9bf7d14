"""One damped Newton step of one problem: what `newton.step` computes."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.compiler import compiled_part
from arrivals.trackers.svalse.newton.compiled.elbo import evaluate, set_amplitudes
from arrivals.trackers.svalse.newton.compiled.records import (
    MU,
    VARIANCE,
    ChartNumbers,
    Terms,
)
from arrivals.trackers.svalse.newton.linear_algebra import MIN_RELATIVE_CURVATURE
from arrivals.trackers.svalse.newton.step import (
    BACKTRACKING,
    MIN_FREEDOM_SHARE,
    ROUNDING,
)
from arrivals.typing import Float


@compiled_part
def newton_step(chart: ChartNumbers, now: Terms, trial: Terms) -> bool:
    """Evaluate one Newton step in `trial`; return False if F decreases however short it is."""
    K = now.K[0]
    g, curvature, H = derivatives(chart, now)
    d = ascent_direction(g, H)
    longest = 1e-300
    for c in range(K):
        longest = max(longest, abs(d[c]))
    shorter = min(1.0, chart.longest_step / longest)
    for c in range(K):
        d[c] *= shorter
    return take_step(chart, now, trial, d, curvature)


@compiled_part
def derivatives(chart: ChartNumbers, e: Terms) -> tuple[Float, Float, Float]:
    """Return ∂F/∂μ, the curvature with the amplitudes held, and -∂²F/∂μ∂μ' without them."""
    K = e.K[0]
    g, curvature, H = np.zeros(K), np.zeros(K), np.zeros((K, K))
    add_derivatives(e, g, curvature, H)
    for c in range(K):
        g[c] = g[c] / chart.tempering - e.prior_gradient[c]
        curvature[c] = e.prior_curvature[c] - curvature[c] / chart.tempering
        for j in range(K):
            H[c, j] /= chart.tempering
        H[c, c] += curvature[c]
    return g, curvature, H


@compiled_part
def add_derivatives(e: Terms, g: Float, second: Float, H: Float) -> None:
    """Add the data's parts of ∂F/∂μ, its own second derivative, and -∂²F/∂μ∂μ', of all bins.

    The amplitudes are held in the second derivative of a component itself, and eliminated in H.
    With P = Σ ŵ* ŵ'/ν + N G, B = ∂(h - (J + ν/τ I) ŵ) = diag(own) - diag(ŵ) X₁* of each snapshot:

    ∂F = 2 Re [Σ ŵ*/ν h₁ - Σ P X₁],  -∂²F = 2 Re [P X₃ - B* G Bᵀ/ν] - diag of the second derivative.
    """
    K, N, G, W, X, h = e.K[0], e.Y.shape[2], e.G, e.W, e.X, e.h
    own = np.empty((K, N), dtype=np.complex128)
    XG = np.empty((K, K), dtype=np.complex128)
    for f in range(e.Y.shape[0]):
        nu = e.nu[f]
        for c in range(K):
            for n in range(N):
                own[c, n] = h[f, 1, c, n]
                for j in range(K):
                    own[c, n] -= X[f, 1, c, j] * W[f, j, n]
                w = np.conj(W[f, c, n])
                g[c] += 2 * (w * h[f, 1, c, n]).real / nu
                second[c] += 2 * (w * h[f, 2, c, n]).real / nu
            for j in range(K):
                XG[c, j] = 0
                for i in range(K):
                    XG[c, j] += X[f, 1, c, i] * G[f, i, j]
        for c in range(K):
            for j in range(c + 1):
                WW, Wo, oW, oo = 0j, 0j, 0j, 0j  # sums over snapshots
                for n in range(N):
                    w, o = np.conj(W[f, c, n]), np.conj(own[c, n])
                    WW += w * W[f, j, n]
                    Wo += w * own[j, n]
                    oW += o * W[f, j, n]
                    oo += o * own[j, n]
                XGX = 0j
                for i in range(K):
                    XGX += XG[c, i] * np.conj(X[f, 1, j, i])
                P = WW / nu + N * G[f, j, c]
                g[c] -= 2 * (P * X[f, 1, c, j]).real
                second[c] -= 2 * (P * X[f, 2, c, j]).real
                gained = XGX * WW - XG[c, j] * Wo - np.conj(XG[j, c]) * oW + G[f, c, j] * oo
                X3 = -X[f, 2, c, j] if X.shape[1] == 3 else X[f, 3, c, j]
                value = 2 * (P * X3 - gained / nu).real
                H[c, j] += value
                if j < c:
                    H[j, c] += value
                    g[j] -= 2 * (np.conj(P) * X[f, 1, j, c]).real
                    second[j] -= 2 * (np.conj(P) * X[f, 2, j, c]).real


@compiled_part
def ascent_direction(g: Float, H: Float) -> Float:
    """Return H⁻¹ g with the eigenvalues of H made positive, and at least a share of the largest."""
    K, largest = len(g), 0.0  # a bound of the eigenvalues: if all exceed the share of it, none
    for i in range(K):  # is changed
        total = 0.0
        for j in range(K):
            total += abs(H[i, j])
        largest = max(largest, total)
    d, L = np.zeros(K), np.empty((K, K))
    if cholesky(H, -MIN_RELATIVE_CURVATURE * largest - 1e-300, L) and cholesky(H, 0.0, L):
        for i in range(K):
            d[i] = g[i]
            for k in range(i):
                d[i] -= L[i, k] * d[k]
            d[i] /= L[i, i]
        for i in range(K - 1, -1, -1):
            for k in range(i + 1, K):
                d[i] -= L[k, i] * d[k]
            d[i] /= L[i, i]
        return d
    eigenvalues, V = np.linalg.eigh(H)
    smallest = MIN_RELATIVE_CURVATURE * max(abs(eigenvalues[0]), abs(eigenvalues[K - 1])) + 1e-300
    for i in range(K):
        share = 0.0
        for j in range(K):
            share += V[j, i] * g[j]
        share /= max(abs(eigenvalues[i]), smallest)
        for j in range(K):
            d[j] += share * V[j, i]
    return d


@compiled_part
def cholesky(H: Float, ridge: float, L: Float) -> bool:
    """Set the lower triangle L, H + ridge I = L Lᵀ; return False if that is not positive."""
    for i in range(len(H)):
        for j in range(i + 1):
            a = H[i, j]
            for k in range(j):
                a -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = a / L[j, j]
            elif a + ridge > 0:
                L[i, i] = np.sqrt(a + ridge)
            else:
                return False
    return True


@compiled_part
def prepare(now: Terms, new: Terms) -> None:
    """Copy the components and variances from which another evaluation starts."""
    new.K[0], new.log_prior_inactive[0] = now.K[0], now.log_prior_inactive[0]
    for f in range(len(now.nu)):
        new.nu[f], new.tau[f] = now.nu[f], now.tau[f]
    for i in range(now.packed.shape[0]):
        for c in range(now.K[0]):
            new.packed[i, c] = now.packed[i, c]


@compiled_part
def take_step(chart: ChartNumbers, now: Terms, trial: Terms, d: Float, curvature: Float) -> bool:
    """Evaluate a step d in `trial`, or the first shorter one that does not decrease F.

    Return False if all do.
    """
    prepare(now, trial)
    smallest = 1 / chart.max_variance
    for attempt in range(len(BACKTRACKING) + 1):
        alpha, beta = (1.0, 1.0) if attempt == 0 else BACKTRACKING[attempt - 1]
        for c in range(now.K[0]):
            old, new = now.packed[VARIANCE, c], 1 / max(curvature[c], smallest)
            trial.packed[MU, c] = now.packed[MU, c] + alpha * d[c]
            trial.packed[VARIANCE, c] = new if beta == 1 else old * (new / old) ** beta
        evaluate(chart, trial)
        if trial.F[0] >= now.F[0] - ROUNDING:
            return True
    return False


@compiled_part
def power_sums(chart: ChartNumbers, e: Terms, f: int) -> tuple[float, float, float, float]:
    """Return the energy Σ |ŵ|² of a bin, tr G, N tr JG, and the power lost by uncertainty."""
    K, N, energy, trace, loss = e.K[0], e.Y.shape[2], 0.0, 0.0, 0.0
    for c in range(K):
        w2 = 0.0
        for n in range(N):
            w2 += e.W[f, c, n].real ** 2 + e.W[f, c, n].imag ** 2
        energy += w2
        trace += e.G[f, c, c].real
        loss += w2 * e.uncertainty_loss[f, c]
    gamma = N * (K - e.nu[f] / e.tau[f] * trace)
    return energy, trace, gamma, min(loss, 0.5 * chart.tempering * K * e.nu[f])


@compiled_part
def update_variances(chart: ChartNumbers, now: Terms) -> None:
    """Set ν and τ by their fixed points, (58) and (59); if F decreases, by the EM step of (58)."""
    K, n_bins, M, N = now.K[0], now.Y.shape[0], now.Y.shape[1], now.Y.shape[2]
    before, nu_new, tau, em = now.F[0], np.empty(n_bins), np.empty(n_bins), np.empty(n_bins)
    for f in range(n_bins):
        nu, ratio = now.nu[f], now.nu[f] / now.tau[f]
        energy, trace, gamma, S = power_sums(chart, now, f)
        E = M * N - now.explained[f] - ratio * energy
        freedom = max(M * N - gamma - S / nu, MIN_FREEDOM_SHARE * M * N)
        nu_new[f] = max((E - S) / freedom, chart.noise_floor)
        tau[f] = (energy + N * nu * trace) / max(N * K, 1)
        em[f] = max((E + nu * gamma) / (M * N), chart.noise_floor)
    set_variances(chart, now, nu_new, tau)
    if not now.F[0] >= before - ROUNDING:
        set_variances(chart, now, em, tau)


@compiled_part
def set_variances(chart: ChartNumbers, now: Terms, nu: Float, tau: Float) -> None:
    """Set ν, and τ, not below the smallest power of a source; the old one without components."""
    for f in range(len(nu)):
        now.nu[f] = nu[f]
        if now.K[0] > 0:
            floor = chart.power_floor * nu[f] / chart.norm2[f]
            now.tau[f] = max(tau[f], floor) if chart.power_floor > 0 else tau[f]
    set_amplitudes(chart, now)
