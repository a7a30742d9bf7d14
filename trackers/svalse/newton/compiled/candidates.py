"""Changes of the support of one problem: what `candidates` and `candidate_grid` compute."""

from __future__ import annotations

import numpy as np

from arrivals.trackers.compiler import compiled_part
from arrivals.trackers.svalse.newton.candidates import SECONDARY_PEAK_POWER
from arrivals.trackers.svalse.newton.charts.angle_chart import LOG_2PI
from arrivals.trackers.svalse.newton.compiled.records import (
    KL_CONSTANT,
    LOG_ODDS,
    MU,
    PRIOR_KAPPA,
    PRIOR_MU,
    SLOT,
    VARIANCE,
    ChartNumbers,
    GridNumbers,
    Removed,
    Task,
    Terms,
)
from arrivals.typing import Bool, Float


@compiled_part
def direction(chart: ChartNumbers, theta: float) -> float:
    """Return the direction of an angle, rad; NaN if it has none."""
    if chart.step > 0:
        sine = theta / chart.step
        return np.arcsin(min(max(sine, -1.0), 1.0)) if abs(sine) <= 1 + 1e-9 else np.nan
    doa: float = (theta + np.pi) % (2 * np.pi) - np.pi
    if chart.front_back_ambiguous and abs(doa) > np.pi / 2:
        return np.pi - doa if doa > 0 else -np.pi - doa
    return doa


@compiled_part
def first_duplicate(chart: ChartNumbers, grid: GridNumbers, e: Terms) -> int:
    """Return the first component too near to an earlier one, or -1."""
    if grid.merge == 0 and grid.merge_correlation == 0:
        return -1
    for c in range(1, e.K[0]):
        for j in range(c):
            if grid.merge_correlation > 0:
                if correlated(grid, e, c, j):
                    return c
            elif np.cos(e.packed[MU, c] - e.packed[MU, j]) > grid.cos_near:
                apart = direction(chart, e.packed[MU, c]) - direction(chart, e.packed[MU, j])
                if np.cos(apart) > grid.cos_merge:
                    return c
    return -1


@compiled_part
def correlated(grid: GridNumbers, e: Terms, c: int, j: int) -> bool:
    """Return True if two components have responses that count as one."""
    for f in range(e.X.shape[0]):
        size = np.sqrt(abs(e.X[f, 0, c, c])) * np.sqrt(abs(e.X[f, 0, j, j]))
        if abs(e.X[f, 0, c, j]) <= grid.merge_correlation * size:
            return False
    return True


@compiled_part
def exclude_near(chart: ChartNumbers, grid: GridNumbers, e: Terms, c: int, out: Bool) -> None:
    """Set which points are too near to a component."""
    if grid.merge_correlation == 0:
        doa = direction(chart, e.packed[MU, c])
        for q in range(len(grid.theta)):
            apart = abs(doa - grid.doa[q])
            out[q] |= min(apart, 2 * np.pi - apart) < grid.merge
        return
    for q in range(len(grid.theta)):
        alike = True
        for f in range(e.X.shape[0]):
            size = np.sqrt(e.X[f, 0, c, c].real * grid.norm2[f, q])
            product = 0j
            for m in range(grid.A.shape[2]):
                product += np.conj(e.responses[f, c, 0, m]) * grid.A[f, q, m]
            alike = alike and abs(product) > grid.merge_correlation * size
        out[q] |= alike


@compiled_part
def removal_gains(chart: ChartNumbers, e: Terms, kl_weight: float, reestimate: bool) -> Float:
    """Return the increase of the criterion by removal of each component, (K,).

    If wanted with the further increase of F as ν is updated again, d' (x - 1 - ln x) of each bin.
    """
    K, n_bins, M, N = e.K[0], e.Y.shape[0], e.Y.shape[1], e.Y.shape[2]
    gains = np.zeros(K)
    for c in range(K):
        for f in range(n_bins):
            C = e.nu[f] * e.G[f, c, c].real
            w2 = 0.0
            for n in range(N):
                w2 += e.W[f, c, n].real ** 2 + e.W[f, c, n].imag ** 2
            gains[c] += N * (np.log(e.tau[f]) - np.log(C)) - w2 / C
            if reestimate:
                freedom = N * (M - K)
                x = (freedom + w2 / C) / (freedom + N)
                gains[c] += (freedom + N) * (x - 1 - np.log(max(x, 1e-3)))
        gains[c] /= chart.tempering
        gains[c] += kl_weight * e.D[c] - e.packed[LOG_ODDS, c]
    return gains


@compiled_part
def grid_evidence(chart: ChartNumbers, grid: GridNumbers, e: Terms) -> tuple[Float, Float, Float]:
    """Return gain, power |u|² and variance of one more component at each point, (n_points,)."""
    N, n_points, share = e.Y.shape[2], len(grid.theta), 1 / chart.tempering
    gain, power, variance = np.zeros(n_points), np.zeros(n_points), np.zeros(n_points)
    for f in range(e.Y.shape[0]):
        nu, tau = e.nu[f], e.tau[f]
        z2, PGP = grid_powers(grid, e, f)
        for q in range(n_points):
            d = grid.norm2[f, q] + nu / tau - PGP[q]
            fits, u2 = z2[q] / d, z2[q] / d**2
            power[q] += u2
            gain[q] += (N * np.log(nu / (tau * d)) + fits / nu) * share
            variance[q] += 2 * u2 * grid.gram[f, q] / nu * share
    for q in range(n_points):
        variance[q] = 1 / max(variance[q], 1 / chart.max_variance)
    return gain, power, variance


@compiled_part
def grid_powers(grid: GridNumbers, e: Terms, f: int) -> tuple[Float, Float]:
    """Return Σ |aᴴη|² over snapshots, η the residual, and PᴴGP with P = âᴴa, (n_points,) each."""
    K, N = e.K[0], e.Y.shape[2]
    products = np.dot(real_coefficients(grid, e, f), grid.R[f].T)
    z, P, n = products[: 2 * N], products[2 * N :], len(products) - 2 * N
    G = np.empty((n, n))  # [Re G, -Im G; Im G, Re G] of real and imaginary parts
    for c in range(n):
        for j in range(n):
            value = e.G[f, c % K, j % K]
            if c // K == j // K:
                G[c, j] = value.real
            else:
                G[c, j] = value.imag if c > j else -value.imag
    return summed_products(z, z), summed_products(P, np.dot(G, P))


@compiled_part
def real_coefficients(grid: GridNumbers, e: Terms, f: int) -> Float:
    """Return coefficients of the columns of R: of aᴴη, (N,), and of âᴴa, (K,), as real rows.

    First the real parts, then the imaginary ones, of the N, and then of the K.
    """
    K, (M, N), C = e.K[0], e.Y.shape[1:], grid.R.shape[2] // 2
    conj, rows = np.empty(N + K, dtype=np.complex128), np.zeros((2 * (N + K), 2 * C))
    for m in range(M):
        for n in range(N):
            conj[n] = np.conj(e.Y[f, m, n])
        for c in range(K):
            conj[N + c] = np.conj(e.responses[f, c, 0, m])
            for n in range(N):
                conj[n] -= conj[N + c] * np.conj(e.W[f, c, n])
        cosine, sine, sign = grid.column[m], C + grid.column[m], grid.sign[m]
        for i in range(N + K):
            real = i if i < N else N + i
            imag = real + (N if i < N else K)
            rows[real, cosine] += conj[i].real
            rows[imag, cosine] += conj[i].imag
            rows[real, sine] -= sign * conj[i].imag
            rows[imag, sine] += sign * conj[i].real
    return rows


@compiled_part
def summed_products(one: Float, other: Float) -> Float:
    """Return the sums of products over the rows."""
    total = np.zeros(one.shape[1])
    for i in range(len(one)):
        for q in range(one.shape[1]):
            total[q] += one[i, q] * other[i, q]
    return total


@compiled_part
def add_candidates(
    task: Task, e: Terms, new: Terms, removed: Removed, log_odds: float, room: int
) -> int:
    """Add new components, or one that was removed before, to a record; return how many."""
    chart, grid, kl_weight, K = task.chart, task.grid, task.search.kl_weight, e.K[0]
    evidence, power, variance = grid_evidence(chart, grid, e)
    excluded, gain = removed.excluded.copy(), np.empty(len(evidence))
    for c in range(K):
        exclude_near(chart, grid, e, c, excluded)
    for q in range(len(gain)):
        if excluded[q]:
            evidence[q] = -np.inf
        kl = grid.log_range - 0.5 * (LOG_2PI + 1 + np.log(variance[q]))
        gain[q] = evidence[q] + log_odds - kl_weight * kl
    n, most = 0, max(gain.max(), 0.0)
    if most > 0:
        n = add_peaks(grid, new, gain, power, variance, room)
        new.packed[LOG_ODDS, K : K + n] = log_odds
    # a component that was removed, with its prior, if that gains more
    for r in range(len(removed.can_reactivate)):
        if not removed.can_reactivate[r]:
            continue
        prior_mu, kappa = removed.memory[PRIOR_MU, r], removed.memory[PRIOR_KAPPA, r]
        for q in range(len(gain)):
            kl = removed.memory[KL_CONSTANT, r] - kappa * np.cos(grid.theta[q] - prior_mu)
            kl -= 0.5 * (LOG_2PI + 1 + np.log(variance[q]))
            back = evidence[q] + removed.memory[LOG_ODDS, r] - kl_weight * kl
            if back > most:
                n, most = 1, back
                for i in range(new.packed.shape[0]):
                    new.packed[i, K] = removed.memory[i, r]
                information = max(1 / variance[q] + kappa, 1 / chart.max_variance)
                new.packed[MU, K], new.packed[VARIANCE, K] = grid.theta[q], 1 / information
    new.K[0] += n
    return n


@compiled_part
def add_peaks(
    grid: GridNumbers, new: Terms, gain: Float, power: Float, variance: Float, room: int
) -> int:
    """Put the best new component, and further local maxima, two beams apart and strong.

    Return how many.
    """
    n_points, last, n = len(gain), int(gain.argmax()), 0
    open_ = np.zeros(n_points, dtype=np.bool_)
    for q in range(n_points):
        peak = gain[q] >= gain[q - 1] and gain[q] >= gain[(q + 1) % n_points]
        open_[q] = peak and gain[q] > 0 and power[q] > SECONDARY_PEAK_POWER * power[last]
    while last >= 0 and n < room:
        c = new.K[0] + n
        new.packed[MU, c], new.packed[VARIANCE, c] = grid.theta[last], variance[last]
        new.packed[PRIOR_MU, c], new.packed[PRIOR_KAPPA, c] = 0.0, 0.0
        new.packed[KL_CONSTANT, c], new.packed[SLOT, c] = grid.log_range, -1
        n, before, last = n + 1, grid.theta[last], -1
        for q in range(n_points):
            if open_[q] and np.cos(grid.theta[q] - before) > grid.cos_apart:
                open_[q] = False
            if open_[q] and (last < 0 or gain[q] > gain[last]):
                last = q
    return n
