"""Fixed-point iteration of sparse Bayesian learning: powers of plane waves on a scan grid.

The kernels have a leading batch axis: B problems with one array and one number of snapshots.
Frequency bins share the powers γ; each has responses and a noise variance of its own, with an axis
after that of the batch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.parameters import FrozenModel
from arrivals.trackers.beamforming.scan_ends import ends_coincide
from arrivals.trackers.beamforming.spectrum import local_maxima
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import count, positive

NOISE_FLOOR = 1e-12  # of the noise variance, relative to the power of a sensor


@dataclass(frozen=True, eq=False)
class PowerEstimate:
    """Solutions of B problems.

    Parameters
    ----------
    gamma : ndarray, shape (B, n_directions)
        Powers of unit-norm waves.
    noise : ndarray, shape (B, [n_bins])
        Noise variance of one sensor.
    iterations : ndarray of int, shape (B,)
        Number of iterations.
    converged : ndarray of bool, shape (B,)
        False where the iteration stopped before it met its tolerance.
    """

    gamma: Float
    noise: Float
    iterations: Int
    converged: Bool


@dataclass(frozen=True)
class FixedPointSolver(FrozenModel):
    """Fixed-point iteration of the powers γ and the noise variance σ².

    Parameters
    ----------
    tolerance : float
        Relative change of γ, in the 1-norm, below which the iteration has converged.
    min_iterations : int
        Minimum number of iterations before convergence.
    max_iterations : int
        Maximum number of iterations.
    patience : int
        Maximum number of iterations without a smaller change.

    Examples
    --------
    >>> A = np.exp(1j * np.pi * np.outer([-0.5, 0.0, 0.5], np.arange(4))) / 2
    >>> solution = FixedPointSolver().solve(A, 6 * A[None, 1, :, None], np.ones((1, 3)), 1.0)
    >>> solution.gamma.round(1)
    array([[ 0., 36.,  0.]])
    """

    tolerance: float = 1e-3
    min_iterations: int = 15
    max_iterations: int = 1000
    patience: int = 200

    def __post_init__(self) -> None:
        positive("tolerance", self.tolerance)
        count("min_iterations", self.min_iterations)
        count("max_iterations", self.max_iterations)
        count("patience", self.patience)

    def solve(
        self, A: Complex, Y: Complex, gamma: Float, noise: float, *, circular: bool = False
    ) -> PowerEstimate:
        """Iterate, and return γ and σ² of the iteration with the smallest change of γ.

        Parameters
        ----------
        A : ndarray, shape ([n_bins,] n_directions, n_sensors)
            Rows a(β) of unit norm.
        Y : ndarray, shape (B, [n_bins,] n_sensors, n_snapshots)
            Snapshots.
        gamma : ndarray, shape (B, n_directions)
            Initial γ.
        noise : float
            Initial σ².
        circular : bool
            True if the first direction follows the last.

        Returns
        -------
        PowerEstimate
            The solutions.
        """
        B = len(Y)
        smallest, at = np.full(B, np.inf), np.zeros(B, dtype=np.int64)
        sigma2 = np.full(Y.shape[:-2], noise)
        best = PowerEstimate(gamma.copy(), sigma2.copy(), *np.zeros((2, B), dtype=np.int64))
        joined = not circular and ends_coincide(A[..., 0, :], A[..., -1, :])
        converged, active = np.zeros(B, dtype=np.bool_), np.arange(B)
        for iteration in range(1, self.max_iterations + 1):
            old, y = gamma, Y[active]
            gamma = update_powers(A, y, old, sigma2)
            sigma2 = residual_noise(A, y, gamma, circular, joined)
            total = gamma.sum(axis=-1)
            change = np.abs(gamma - old).sum(axis=-1) / np.where(total > 0, total, 1.0)
            better = change < smallest[active]
            improved = active[better]
            smallest[improved], at[improved] = change[better], iteration
            best.gamma[improved], best.noise[improved] = gamma[better], sigma2[better]
            converged[active] = (change < self.tolerance) & (iteration >= self.min_iterations)
            best.iterations[active] = iteration
            remain = ~converged[active] & (iteration - at[active] < self.patience)
            active, gamma, sigma2 = active[remain], gamma[remain], sigma2[remain]
            if not len(active):
                break
        return PowerEstimate(best.gamma, best.noise, best.iterations, converged)


def update_powers(A: Complex, Y: Complex, gamma: Float, noise: Float) -> Float:
    """Return the next powers γᵢ |aᵢᴴΣ⁻¹y|² / aᵢᴴΣ⁻¹aᵢ, the mean over snapshots.

    Numerator and denominator are sums over the bins.

    Parameters
    ----------
    A : ndarray, shape ([n_bins,] n_directions, n_sensors)
        Rows a(β) of unit norm.
    Y : ndarray, shape (B, [n_bins,] n_sensors, n_snapshots)
        Snapshots.
    gamma : ndarray, shape (B, n_directions)
        Powers.
    noise : ndarray, shape (B, [n_bins])
        Noise variance σ².

    Returns
    -------
    ndarray, shape (B, n_directions)
        Powers.

    Examples
    --------
    >>> A = np.eye(2, dtype=complex)
    >>> update_powers(A, np.array([[[2.0], [0.0]]]), np.ones((1, 2)), np.array([1.0]))
    array([[2., 0.]])
    """
    n_sensors, has_bins = A.shape[-1], A.ndim > 2
    shared = gamma[:, None, None] if has_bins else gamma[:, None]
    # Σ = σ²I + A diag(γ) Aᴴ
    sigma = (np.swapaxes(A, -1, -2) * shared) @ A.conj()
    sigma = sigma + noise[..., None, None] * np.eye(n_sensors)
    filters = A.conj() @ np.linalg.inv(sigma)  # rows aᵢᴴΣ⁻¹
    output = filters @ Y
    numerator = (output.real**2 + output.imag**2).mean(axis=-1)
    denominator = np.einsum("b...im,...im->b...i", filters, A).real
    if has_bins:
        numerator, denominator = numerator.sum(axis=1), denominator.sum(axis=1)
    return np.asarray(gamma * numerator / denominator)


def residual_noise(
    A: Complex, Y: Complex, gamma: Float, circular: bool, joined: bool = False
) -> Float:
    """Return σ² = tr[(I - A_M A_M⁺) S] / (M - K), A_M the K = ⌈M/2⌉ highest peaks of γ.

    Parameters
    ----------
    A : ndarray, shape ([n_bins,] n_directions, n_sensors)
        Rows a(β) of unit norm.
    Y : ndarray, shape (B, [n_bins,] n_sensors, n_snapshots)
        Snapshots of covariance S.
    gamma : ndarray, shape (B, n_directions)
        Powers.
    circular, joined : bool
        As in `find_peaks`.

    Returns
    -------
    ndarray, shape (B, [n_bins])
        Noise variance of one sensor.
    """
    n_sensors, n_snapshots = Y.shape[-2:]
    K = min(-(-n_sensors // 2), n_sensors - 1)
    peaks, exists = highest_peaks(gamma, K, circular, joined)
    waves = A[..., peaks, :]
    if A.ndim > 2:
        waves, exists = np.moveaxis(waves, 0, 1), exists[:, None]
    columns = np.swapaxes(np.where(exists[..., None], waves, 0), -1, -2)  # missing peaks last
    Q = np.linalg.qr(columns)[0]
    projection = np.swapaxes(Q.conj(), -1, -2) @ Y
    explained = np.where(exists, (np.abs(projection) ** 2).sum(axis=-1), 0).sum(axis=-1)
    power = (np.abs(Y) ** 2).sum(axis=(-2, -1))
    residual = (power - explained) / (n_snapshots * (n_sensors - K))
    return np.asarray(np.maximum(residual, NOISE_FLOOR * power / (n_snapshots * n_sensors)))


def highest_peaks(gamma: Float, n: int, circular: bool, joined: bool = False) -> tuple[Int, Bool]:
    """Return the indices of the n highest local maxima.

    Parameters
    ----------
    gamma : ndarray, shape (..., n_directions)
        Powers.
    n : int
        Number of peaks.
    circular, joined : bool
        As in `find_peaks`.

    Returns
    -------
    peaks : ndarray of int, shape (..., n)
        Indices, the highest first.
    exists : ndarray of bool, shape (..., n)
        False where there are fewer peaks.

    Examples
    --------
    >>> gamma = np.array([9.0, 1.0, 3.0, 2.0, 4.0, 0.0])
    >>> peaks, exists = highest_peaks(gamma, 3, circular=False)
    >>> peaks[exists]
    array([0, 4, 2])
    """
    is_peak = local_maxima(gamma, circular=circular, joined=joined)
    order = np.argsort(-np.where(is_peak, gamma, -1), axis=-1, kind="stable")[..., :n]
    return order, np.take_along_axis(is_peak, order, axis=-1)


def spread_powers(
    gamma: Float, n_neighbours: int, leakage: float, floor: float, circular: bool
) -> Float:
    """Return the sum of `leakage` γ over neighbours, plus `floor` times its maximum.

    Parameters
    ----------
    gamma : ndarray, shape (n_directions,)
        Powers.
    n_neighbours : int
        Number of neighbours on either side.
    leakage : float
        Fraction of a power that each neighbour receives.
    floor : float
        Minimum, relative to the maximum of the result.
    circular : bool
        True if the first direction follows the last.

    Returns
    -------
    ndarray, shape (n_directions,)
        Powers.

    Examples
    --------
    >>> spread_powers(np.array([0, 0, 1.0, 0, 0, 0]), 1, 0.5, 0.1, circular=False)
    array([0.05, 0.55, 0.55, 0.55, 0.05, 0.05])
    """
    ends = {"mode": "wrap"} if circular else {}
    padded = np.pad(gamma, n_neighbours, **ends)  # type: ignore[call-overload]  # a mode by name
    near = np.lib.stride_tricks.sliding_window_view(padded, 2 * n_neighbours + 1).sum(axis=-1)
    return np.asarray(leakage * near + floor * leakage * near.max())
