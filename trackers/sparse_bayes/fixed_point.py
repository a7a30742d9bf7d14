"""Sparse Bayesian learning: the powers of plane waves on a grid of directions.

The kernels have a leading batch axis: B problems with one array and one number of snapshots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.typing import Bool, Complex, Float, Int

NOISE_FLOOR = 1e-12  # of the power of a sensor


@dataclass(frozen=True, eq=False)
class Powers:
    """What B fits found.

    Parameters
    ----------
    gamma : ndarray, shape (B, n_directions)
        Powers of unit-norm waves.
    noise : ndarray, shape (B,)
        Variance of the noise of one sensor.
    iterations : ndarray of int, shape (B,)
    converged : ndarray of bool, shape (B,)
    """

    gamma: Float
    noise: Float
    iterations: Int
    converged: Bool


@dataclass(frozen=True)
class SparseBayes:
    """Settings of the fixed-point iteration.

    Parameters
    ----------
    tolerance : float
        Relative change of γ, in the 1-norm, at which it rests.
    min_iterations, max_iterations : int
    patience : int
        Iterations without a smaller change after which it gives up.
    circular : bool
        Whether the first direction follows the last.
    """

    tolerance: float = 1e-3
    min_iterations: int = 15
    max_iterations: int = 1000
    patience: int = 200
    circular: bool = False

    def fit(self, A: Complex, Y: Complex, gamma: Float, noise: float) -> Powers:
        """Iterate; give the γ and σ² of the iteration that changed γ least.

        Parameters
        ----------
        A : ndarray, shape (n_directions, n_sensors)
            Rows a(β) of unit norm.
        Y : ndarray, shape (B, n_sensors, n_snapshots)
        gamma : ndarray, shape (B, n_directions)
            Where γ starts.
        noise : float
            Where σ² starts.
        """
        least = np.full(len(Y), np.inf)
        best = Powers(gamma.copy(), np.full(len(Y), noise), *np.zeros((2, len(Y)), dtype=np.int64))
        at, going = np.zeros(len(Y), dtype=np.int64), np.arange(len(Y))
        rests = np.zeros(len(Y), dtype=np.bool_)
        sigma2 = best.noise.copy()
        for iteration in range(1, self.max_iterations + 1):
            old, y = gamma, Y[going]
            gamma = sharpened(A, y, old, sigma2)
            sigma2 = residual_noise(A, y, gamma, self.circular)
            total = gamma.sum(axis=-1)
            change = np.abs(gamma - old).sum(axis=-1) / np.where(total > 0, total, 1.0)
            better = change < least[going]
            fitter = going[better]
            least[fitter], at[fitter] = change[better], iteration
            best.gamma[fitter], best.noise[fitter] = gamma[better], sigma2[better]
            rests[going] = (change < self.tolerance) & (iteration >= self.min_iterations)
            best.iterations[going] = iteration
            on = ~rests[going] & (iteration - at[going] < self.patience)
            going, gamma, sigma2 = going[on], gamma[on], sigma2[on]
            if not len(going):
                break
        return Powers(best.gamma, best.noise, best.iterations, rests)


def sharpened(A: Complex, Y: Complex, gamma: Float, noise: Float) -> Float:
    """Return γᵢ |aᵢᴴΣ⁻¹y|² / aᵢᴴΣ⁻¹aᵢ, Σ = σ²I + Σ γᵢ aᵢaᵢᴴ, the mean over snapshots.

    Examples
    --------
    >>> A = np.eye(2, dtype=complex)
    >>> sharpened(A, np.array([[[2.0], [0.0]]]), np.ones((1, 2)), np.array([1.0]))
    array([[2., 0.]])
    """
    n_sensors = A.shape[1]
    sigma = (A.T * gamma[:, None]) @ A.conj() + noise[:, None, None] * np.eye(n_sensors)
    filters = A.conj() @ np.linalg.inv(sigma)  # rows aᵢᴴΣ⁻¹
    heard = filters @ Y
    numerator = (heard.real**2 + heard.imag**2).mean(axis=-1)
    return np.asarray(gamma * numerator / np.einsum("bim,im->bi", filters, A).real)


def residual_noise(A: Complex, Y: Complex, gamma: Float, circular: bool) -> Float:
    """Return σ² = tr[(I - A_M A_M⁺) S] / (M - K), A_M the K = ⌈M/2⌉ highest peaks of γ."""
    n_sensors, n_snapshots = Y.shape[-2:]
    K = min(-(-n_sensors // 2), n_sensors - 1)
    top, there = highest(gamma, K, circular)
    columns = np.swapaxes(np.where(there[..., None], A[top], 0), -1, -2)  # the absent come last
    Q = np.linalg.qr(columns)[0]
    seen = np.swapaxes(Q.conj(), -1, -2) @ Y
    explained = np.where(there, (np.abs(seen) ** 2).sum(axis=-1), 0).sum(axis=-1)
    power = (np.abs(Y) ** 2).sum(axis=(-2, -1))
    left = (power - explained) / (n_snapshots * (n_sensors - K))
    return np.asarray(np.maximum(left, NOISE_FLOOR * power / (n_snapshots * n_sensors)))


def highest(gamma: Float, n: int, circular: bool) -> tuple[Int, Bool]:
    """Return the indices of the n highest local maxima, and whether there are so many, (..., n).

    Examples
    --------
    >>> top, there = highest(np.array([9.0, 1.0, 3.0, 2.0, 4.0, 0.0]), 3, circular=False)
    >>> top[there]
    array([4, 2])
    """
    rises = (gamma > np.roll(gamma, 1, axis=-1)) & (gamma >= np.roll(gamma, -1, axis=-1))
    if not circular:
        rises[..., [0, -1]] = False
    order = np.argsort(-np.where(rises, gamma, -1), axis=-1, kind="stable")[..., :n]
    return order, np.take_along_axis(rises, order, axis=-1)


def widened(gamma: Float, reach: int, share: float, floor: float, circular: bool) -> Float:
    """Return share · Σ γ over `reach` neighbours to either side, plus `floor` of its maximum.

    Examples
    --------
    >>> widened(np.array([0, 0, 1.0, 0, 0, 0]), 1, 0.5, 0.1, circular=False)
    array([0.05, 0.55, 0.55, 0.55, 0.05, 0.05])
    """
    ends = {"mode": "wrap"} if circular else {}
    padded = np.pad(gamma, reach, **ends)  # type: ignore[call-overload]  # a mode by name
    near = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).sum(axis=-1)
    return np.asarray(share * near + floor * share * near.max())
