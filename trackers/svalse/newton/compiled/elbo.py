"""The ELBO of one problem: what `expected_response`, `angle_chart` and `elbo` compute."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.compiler import compiled_part
from arrivals.trackers.svalse.newton.compiled.records import (
    KL_CONSTANT,
    LOG_ODDS,
    MU,
    PRIOR_KAPPA,
    PRIOR_MU,
    VARIANCE,
    ChartNumbers,
    Terms,
)
from arrivals.trackers.svalse.newton.elbo import LOG_2PIE
from arrivals.typing import Complex

MIN_PIVOT = 1e-16  # of a diagonal entry


@compiled_part
def evaluate(chart: ChartNumbers, e: Terms) -> None:
    """Evaluate the components and variances of a record: all other fields follow."""
    set_responses(chart, e)
    set_products(e)
    set_norms(chart, e)
    set_priors(e)
    set_amplitudes(chart, e)


@compiled_part
def set_responses(chart: ChartNumbers, e: Terms) -> None:
    """Set â, ∂â/∂μ and ∂²â/∂μ² = 2 ∂â/∂s: â = G ⟨d⟩ with ⟨d_k⟩ = exp(jkμ - k²s/2)."""
    k, sizes, G, K, M = chart.harmonics, chart.sizes, chart.G, e.K[0], e.Y.shape[1]
    n, phasors = len(k), np.empty(len(sizes), dtype=np.complex128)
    rows = e.responses[0] if G.shape[0] == 0 else np.empty((K, 3, n), dtype=np.complex128)
    for c in range(K):
        mu, s = e.packed[MU, c], e.packed[VARIANCE, c]
        for i in range(len(sizes)):
            size = np.exp(-0.5 * sizes[i] * sizes[i] * s)
            phasors[i] = complex(size * np.cos(sizes[i] * mu), size * np.sin(sizes[i] * mu))
        for i in range(n):
            d = phasors[chart.column[i]]
            d = d if k[i] > 0 else np.conj(d)
            rows[c, 0, i], rows[c, 1, i], rows[c, 2, i] = d, 1j * k[i] * d, -k[i] * k[i] * d
    for f in range(G.shape[0]):
        np.dot(rows.reshape(3 * K, n), G[f], e.responses[f].reshape(-1, M)[: 3 * K])


@compiled_part
def set_products(e: Terms) -> None:
    """Set X: âᴴâ, (∂â)ᴴâ, (∂²â)ᴴâ, and (∂â)ᴴ∂â where it is not -(∂²â)ᴴâ; and h."""
    a, X, h, K, (M, N) = e.responses, e.X, e.h, e.K[0], e.Y.shape[1:]
    conj = np.empty((2 * K + N, M), dtype=np.complex128)
    n = K + N + (K if X.shape[1] > 3 else 0)  # columns that are used
    for f in range(a.shape[0]):
        for m in range(M):
            for c in range(K):
                conj[c, m], conj[K + N + c, m] = np.conj(a[f, c, 0, m]), np.conj(a[f, c, 1, m])
            for i in range(N):
                conj[K + i, m] = np.conj(e.Y[f, m, i])
        products = np.dot(a[f].reshape(-1, M)[: 3 * K], conj[:n].T)  # conjugates of X and h
        for c in range(K):
            for p in range(3):
                for j in range(K):
                    X[f, p, c, j] = np.conj(products[3 * c + p, j])
                for i in range(N):
                    h[f, p, c, i] = np.conj(products[3 * c + p, K + i])
            for j in range(n - K - N):
                X[f, 3, c, j] = np.conj(products[3 * c + 1, K + N + j])


@compiled_part
def set_norms(chart: ChartNumbers, e: Terms) -> None:
    """Set the diagonal of X: ⟨‖a‖²⟩, half its first and second derivatives; and the loss."""
    X, series = e.X, chart.series
    for c in range(e.K[0]):
        mu, s = e.packed[MU, c], e.packed[VARIANCE, c]
        for f in range(X.shape[0]):
            size = X[f, 0, c, c].real
            for p in range(X.shape[1]):
                X[f, p, c, c] = 0
            if series.shape[0] == 0:
                X[f, 0, c, c] = chart.norm2[f]
            for i in range(series.shape[1]):
                scale = np.exp(-0.5 * i * i * s)
                d = complex(scale * np.cos(i * mu), scale * np.sin(i * mu)) * series[f, i]
                X[f, 0, c, c] += d.real
                X[f, 1, c, c] -= 0.5 * i * d.imag
                X[f, 2, c, c] -= 0.5 * i * i * d.real
            e.uncertainty_loss[f, c] = X[f, 0, c, c].real - size


@compiled_part
def set_priors(e: Terms) -> None:
    """Set D = c - ½ ln 2πe s + ⟨prior⟩, ⟨prior⟩ = -κ exp(-s/2) cos(μ-μₚ), and its derivatives."""
    e.log_prior[0] = e.log_prior_inactive[0]
    for c in range(e.K[0]):
        s, turned = e.packed[VARIANCE, c], e.packed[MU, c] - e.packed[PRIOR_MU, c]
        size = e.packed[PRIOR_KAPPA, c] * np.exp(-0.5 * s)
        e.prior_gradient[c], e.prior_curvature[c] = size * np.sin(turned), size * np.cos(turned)
        e.D[c] = e.packed[KL_CONSTANT, c] - 0.5 * (LOG_2PIE + np.log(s)) - e.prior_curvature[c]
        e.log_prior[0] += e.packed[LOG_ODDS, c] - e.D[c]


@compiled_part
def set_amplitudes(chart: ChartNumbers, e: Terms) -> None:
    """Set Ŵ = G H, G = (J + ν/τ I)⁻¹, Re tr HᴴŴ, and the ELBO.

    F = Σ [Re tr HᴴŴ/ν - M N/ν - M N ln πν + N K ln ν/τ - N ln det(J + ν/τ I)] over bins, over T.
    """
    K, n_bins, M, N = e.K[0], e.Y.shape[0], e.Y.shape[1], e.Y.shape[2]
    G, W, h, total = e.G, e.W, e.h, 0.0
    L = np.empty((K, K), dtype=np.complex128)
    for f in range(n_bins):
        nu, ratio, explained = e.nu[f], e.nu[f] / e.tau[f], 0.0
        log_det = set_inverse(e, f, ratio, L)
        for c in range(K):
            for n in range(N):
                w = 0j
                for j in range(K):
                    w += G[f, c, j] * h[f, 0, j, n]
                W[f, c, n] = w
                explained += (np.conj(h[f, 0, c, n]) * w).real
        e.explained[f] = explained
        volume = N * (K * np.log(ratio) - log_det)
        total += (explained - M * N) / nu - M * N * np.log(np.pi * nu) + volume
    e.F[0] = total / chart.tempering + e.log_prior[0]


@compiled_part
def set_inverse(e: Terms, f: int, ridge: float, L: Complex) -> float:
    """Set G = (J + ridge I)⁻¹ of a bin by Cholesky, L for the triangle; return ln det."""
    J, G, K, log_det = e.X, e.G, e.K[0], 0.0
    for i in range(K):
        for j in range(i):
            a = J[f, 0, i, j]
            for k in range(j):
                a -= L[i, k] * np.conj(L[j, k])
            L[i, j] = a / L[j, j].real
        square = J[f, 0, i, i].real + ridge
        smallest = MIN_PIVOT * square  # rounding can make it negative
        for k in range(i):
            square -= L[i, k].real ** 2 + L[i, k].imag ** 2
        square = max(square, smallest)
        L[i, i] = np.sqrt(square)
        log_det += np.log(square)
    for j in range(K):  # L becomes its inverse, column by column
        for i in range(j + 1, K):
            a = L[i, j] / L[j, j].real
            for k in range(j + 1, i):
                a += L[i, k] * L[k, j]
            L[i, j] = -a / L[i, i].real
    for i in range(K):
        L[i, i] = 1 / L[i, i].real
    for i in range(K):
        for j in range(i + 1):
            a = 0j
            for k in range(i, K):
                a += np.conj(L[k, i]) * L[k, j]
            G[f, i, j], G[f, j, i] = a, np.conj(a)
    return log_det
