"""Marginal variances and odds of existence of one problem: what `newton.marginals` computes."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.compiler import compiled_part
from arrivals.trackers.marginal_variances import MIN_EIGENVALUE, MIN_FREEDOM
from arrivals.trackers.svalse.newton.compiled.records import (
    LOG_ODDS,
    ChartNumbers,
    Outcome,
    SearchNumbers,
    Task,
    Terms,
)
from arrivals.trackers.svalse.newton.compiled.step import derivatives, power_sums
from arrivals.trackers.svalse.newton.step import MIN_FREEDOM_SHARE
from arrivals.typing import Float


@compiled_part
def set_marginals(task: Task, e: Terms, outcome: Outcome, b: int) -> None:
    """Set the amplitudes and the marginals of the components of the b-th problem."""
    K, n_bins, M, N = e.K[0], e.Y.shape[0], e.Y.shape[1], e.Y.shape[2]
    chart, search = task.chart, task.search
    if K == 0:
        return
    freedom = np.empty(n_bins)  # real degrees of freedom left for the noise
    for f in range(n_bins):
        _, _, gamma, S = power_sums(chart, e, f)
        share = max(M * N - gamma - S / e.nu[f], MIN_FREEDOM_SHARE * M * N)
        freedom[f] = 2 * share
        for c in range(K):
            for n in range(N):
                outcome.W[b, f, c, n] = e.W[f, c, n]
    variance = marginal_variances(derivatives(chart, e)[2], chart.max_variance)
    for c in range(K):
        # s = [P + max(v⁻¹ - P, 0)/f]⁻¹, where P is the prior's part of the information
        P = e.prior_curvature[c]
        information = P + max(1 / variance[c] - P, 0.0) / noise_factor(search, e, freedom, c)
        outcome.covariance[b, c] = variance[c]
        outcome.stated_covariance[b, c] = 1 / max(information, 1 / chart.max_variance)
        outcome.log_odds[b, c] = existence_log_odds(chart, search, e, freedom, c)


@compiled_part
def marginal_variances(H: Float, largest: float) -> Float:
    """Return the diagonal of H⁻¹, at most `largest`, by eigenvalues after scaling, clipped."""
    K = len(H)
    d, R, variance = np.empty(K), np.empty((K, K)), np.zeros(K)
    for c in range(K):
        d[c] = np.sqrt(max(H[c, c], 1 / largest))
    for c in range(K):
        for j in range(K):
            R[c, j] = H[c, j] / (d[c] * d[j])
    eigenvalues, V = np.linalg.eigh(R)
    for c in range(K):
        for i in range(K):
            variance[c] += V[c, i] ** 2 / max(eigenvalues[i], MIN_EIGENVALUE)
        variance[c] = min(variance[c] / d[c] ** 2, largest)
    return variance


@compiled_part
def noise_factor(search: SearchNumbers, e: Terms, freedom: Float, c: int) -> float:
    """Return by how much unknown noise widens the variance that the data give."""
    n_bins, N = e.Y.shape[0], e.Y.shape[2]
    share, total, uneven = np.zeros(n_bins), 0.0, 0.0
    for f in range(n_bins):
        powers = residual_powers(e, f) if N > 1 else np.ones(1)
        for n in range(N):
            part = (e.W[f, c, n].real ** 2 + e.W[f, c, n].imag ** 2) / e.nu[f]
            share[f] += part
            uneven += part * powers[n]
        total += share[f]
    if not total > 0:
        return 1.0
    # ω_f: share of each bin in the information;  n = 1/Σω²,  d = Σ ω_f d_f
    squares, d, scale = 0.0, 0.0, max(total, 1e-300)
    for f in range(n_bins):
        squares += (share[f] / scale) ** 2
        d += share[f] / scale * freedom[f]
    n_even, m = 1 / max(squares, 1e-300), max(d, 4.0)
    # f = c(d n) (m/(m-2))^(2(1-1/n)) g
    inverse = 1 / max(d * n_even, MIN_FREEDOM)
    factor: float = np.interp(inverse, search.inverse_freedom, search.student_factor)
    factor *= (m / (m - 2)) ** (2 * (1 - 1 / n_even))
    if N > 1:
        factor *= uneven / scale
    return factor


@compiled_part
def residual_powers(e: Terms, f: int) -> Float:
    """Return the residual power of each snapshot over the mean of its bin, (N,)."""
    M, N = e.Y.shape[1:]
    powers, mean = np.zeros(N), 0.0
    for n in range(N):
        for m in range(M):
            rest = e.Y[f, m, n]
            for c in range(e.K[0]):
                rest -= e.responses[f, c, 0, m] * e.W[f, c, n]
            powers[n] += rest.real**2 + rest.imag**2
        mean += powers[n] / N
    for n in range(N):
        powers[n] /= max(mean, 1e-300)
    return powers


@compiled_part
def existence_log_odds(
    chart: ChartNumbers, search: SearchNumbers, e: Terms, freedom: Float, c: int
) -> float:
    """Return the log odds of existence with the noise integrated out."""
    N, total = e.Y.shape[2], 0.0
    for f in range(e.Y.shape[0]):
        C, w2, n = e.nu[f] * e.G[f, c, c].real, 0.0, freedom[f] / 2
        for i in range(N):
            w2 += e.W[f, c, i].real ** 2 + e.W[f, c, i].imag ** 2
        # ln r/(1-r) = 1/T Σ (n+N) ln(1 + q/n) - N ln τ/C  +  ln ρ/(1-ρ) - c D
        total += (n + N) * np.log1p(w2 / C / n) - N * np.log(e.tau[f] / C)
    odds: float = total / chart.tempering + e.packed[LOG_ODDS, c] - search.kl_weight * e.D[c]
    return odds
