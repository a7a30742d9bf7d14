"""The ELBO of one problem: what `expected_response`, `angle_chart` and `elbo` compute."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.svalse.newton.compiled.compiler import compiled_part
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
    if chart.G.shape[0] == 0:
        set_harmonics(chart, e)
    else:
        set_responses(chart, e)
        set_products(e)
    set_norms(chart, e)
    set_priors(e)
    set_amplitudes(chart, e)


@compiled_part
def set_harmonics(chart: ChartNumbers, e: Terms) -> None:
    """Set â, X and h where the sensors are the harmonics: â_k = exp(jkμ - k²s/2), ∂â = jk â.

    The derivatives of â are not kept.
    """
    k, a, X, h, y = chart.harmonics, e.responses, e.X, e.h, e.Y
    for c in range(e.K[0]):
        mu, s = e.packed[MU, c], e.packed[VARIANCE, c]
        for m in range(len(k)):
            size = np.exp(-0.5 * k[m] * k[m] * s)
            a[0, 0, c, m] = complex(size * np.cos(k[m] * mu), size * np.sin(k[m] * mu))
        for j in range(c):
            x0, x1, x2 = 0j, 0j, 0j
            for m in range(len(k)):
                product = np.conj(a[0, 0, c, m]) * a[0, 0, j, m]
                x0 += product
                x1 += k[m] * product
                x2 += k[m] * k[m] * product
            x1, x2 = -1j * x1, -x2
            X[0, 0, c, j], X[0, 1, c, j], X[0, 2, c, j] = x0, x1, x2
            X[0, 0, j, c], X[0, 1, j, c] = np.conj(x0), -np.conj(x1)
            X[0, 2, j, c] = np.conj(x2)
        for n in range(y.shape[2]):
            x0, x1, x2 = 0j, 0j, 0j
            for m in range(len(k)):
                product = np.conj(a[0, 0, c, m]) * y[0, m, n]
                x0 += product
                x1 += k[m] * product
                x2 += k[m] * k[m] * product
            h[0, 0, c, n], h[0, 1, c, n], h[0, 2, c, n] = x0, -1j * x1, -x2


@compiled_part
def set_responses(chart: ChartNumbers, e: Terms) -> None:
    """Set â, ∂â/∂μ and ∂²â/∂μ² = 2 ∂â/∂s: â = G ⟨d⟩ with ⟨d_k⟩ = exp(jkμ - k²s/2)."""
    k, a, G = chart.harmonics, e.responses, chart.G
    for c in range(e.K[0]):
        mu, s = e.packed[MU, c], e.packed[VARIANCE, c]
        for f in range(a.shape[0]):
            for p in range(3):
                for m in range(a.shape[3]):
                    a[f, p, c, m] = 0
        for i in range(len(k)):
            size = np.exp(-0.5 * k[i] * k[i] * s)
            d = complex(size * np.cos(k[i] * mu), size * np.sin(k[i] * mu))
            for f in range(a.shape[0]):
                for m in range(a.shape[3]):
                    part = d * G[f, i, m]
                    a[f, 0, c, m] += part
                    a[f, 1, c, m] += 1j * k[i] * part
                    a[f, 2, c, m] -= k[i] * k[i] * part


@compiled_part
def set_products(e: Terms) -> None:
    """Set X off the diagonal: âᴴâ, (∂â)ᴴâ, (∂²â)ᴴâ and (∂â)ᴴ∂â; and h."""
    a, X, h, y, K = e.responses, e.X, e.h, e.Y, e.K[0]
    for f in range(a.shape[0]):
        for c in range(K):
            for j in range(K):
                x0, x1, x2, x3 = 0j, 0j, 0j, 0j
                for m in range(a.shape[3]):
                    x0 += np.conj(a[f, 0, c, m]) * a[f, 0, j, m]
                    x1 += np.conj(a[f, 1, c, m]) * a[f, 0, j, m]
                    x2 += np.conj(a[f, 2, c, m]) * a[f, 0, j, m]
                    x3 += np.conj(a[f, 1, c, m]) * a[f, 1, j, m]
                X[f, 0, c, j], X[f, 1, c, j], X[f, 2, c, j], X[f, 3, c, j] = x0, x1, x2, x3
            for p in range(3):
                for n in range(y.shape[2]):
                    h[f, p, c, n] = 0
                for m in range(a.shape[3]):
                    conj = np.conj(a[f, p, c, m])
                    for n in range(y.shape[2]):
                        h[f, p, c, n] += conj * y[f, m, n]


@compiled_part
def set_norms(chart: ChartNumbers, e: Terms) -> None:
    """Set the diagonal of X: ⟨‖a‖²⟩, half its first and second derivatives; and the loss."""
    X, a, series = e.X, e.responses, chart.series
    for c in range(e.K[0]):
        mu, s = e.packed[MU, c], e.packed[VARIANCE, c]
        for f in range(X.shape[0]):
            for p in range(X.shape[1]):
                X[f, p, c, c] = 0
            if series.shape[0] == 0:
                X[f, 0, c, c] = chart.norm2[f]
            for i in range(series.shape[1]):
                size = np.exp(-0.5 * i * i * s)
                d = complex(size * np.cos(i * mu), size * np.sin(i * mu)) * series[f, i]
                X[f, 0, c, c] += d.real
                X[f, 1, c, c] -= 0.5 * i * d.imag
                X[f, 2, c, c] -= 0.5 * i * i * d.real
            size = 0.0
            for m in range(a.shape[3]):
                size += a[f, 0, c, m].real ** 2 + a[f, 0, c, m].imag ** 2
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
