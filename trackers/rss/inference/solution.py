"""Solution of one set of readings, its weights and its diagnostics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from arrivals.typing import Bool, Float, Int


class Marginals(NamedTuple):
    """Variances v (..., n_sources), Np², and covariances Σ (..., n_sources, 2, 2), m²."""

    v: Float
    Sigma: Float


class WeightedReadings(NamedTuple):
    """Readings ξ, their weights W, and their precisions 1/r, all (n_batch, n_sensors)."""

    xi: Float
    W: Float
    precision: Float


class Solution(NamedTuple):
    """Solution of a batch of problems.

    Parameters
    ----------
    u, theta : ndarray, shape (n_batch, n_sources), (n_batch, n_sources, 2)
        Log amplitudes, Np, and positions, m.
    marginals : Marginals
        Their variances and covariances.
    log_posterior, initial : ndarray, shape (n_batch,)
        L of the solution and of the starting point.
    log_likelihood : ndarray, shape (n_batch,)
        Laplace's approximation to the log density of the readings.
    iterations : ndarray of int, shape (n_batch,)
    converged : ndarray of bool, shape (n_batch,)
    """

    u: Float
    theta: Float
    marginals: Marginals
    log_posterior: Float
    initial: Float
    log_likelihood: Float
    iterations: Int
    converged: Bool


class Diagnostics(NamedTuple):
    """Convergence and goodness of fit of solutions: numbers, or arrays (n_batch,).

    Parameters
    ----------
    converged : bool
        False if the iterations ended before they met their tolerance.
    iterations : int
    fit : float
        Probability of a larger misfit q ~ χ² of M - 3K degrees of freedom; NaN if there are none.
    poor_fit : bool
        fit < 1e-3: a wrong local maximum, or a model that does not hold.
    diverged : bool
        A number is not finite, a source is more than 5 √tr Σ₀ from its prior mean, L is below its
        initial value, or fit < 1e-6.
    """

    converged: bool | Bool = True
    iterations: int | Int = 0
    fit: float | Float = np.nan
    poor_fit: bool | Bool = False
    diverged: bool | Bool = False
