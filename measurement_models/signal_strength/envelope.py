"""Averaged envelope of N Gaussian snapshots: the Chi statistic and its logarithm.

The reading is e = (Σ|y|²/N)^½ = σ Z/√(2N) with Z ~ χ of 2N degrees of freedom; ξ = log e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import count, instance


def envelope_moments(n_snapshots: ArrayLike) -> tuple[Float, Float]:
    """Return mean and standard deviation of e/σ: Γ(N+½)/(√N Γ(N)), and what is left of 1.

    Parameters
    ----------
    n_snapshots : array_like
        N.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, text of (3).

    Examples
    --------
    >>> mean, std = envelope_moments(50)
    >>> round(float(mean), 4), round(float(std), 4)
    (0.9975, 0.0706)
    """
    from scipy.special import gammaln

    N = np.asarray(n_snapshots, dtype=np.float64)
    mean = np.exp(gammaln(N + 0.5) - gammaln(N)) / np.sqrt(N)
    return mean, np.sqrt(1 - mean**2)


def log_envelope_moments(n_snapshots: ArrayLike) -> tuple[Float, Float]:
    """Return mean and variance of ξ - log σ: ½(ψ(N) - ln N) in Np, and ¼ψ'(N) in Np².

    Parameters
    ----------
    n_snapshots : array_like
        N.

    References
    ----------
    The same; to first order they are -1/4N and 1/4N, the paper's (3).

    Examples
    --------
    >>> bias, variance = log_envelope_moments(50)
    >>> round(float(bias), 4), round(float(variance * 4 * 50), 3)
    (-0.005, 1.01)
    """
    from scipy.special import polygamma, psi

    N = np.asarray(n_snapshots, dtype=np.float64)
    return 0.5 * (psi(N) - np.log(N)), 0.25 * polygamma(1, N)


def sample_log_envelope(
    n_snapshots: int, shape: tuple[int, ...], rng: np.random.Generator
) -> Float:
    """Draw ξ - log σ = ½ log(χ²/2N), χ² of 2N degrees of freedom, exactly.

    Examples
    --------
    >>> sample_log_envelope(50, (3,), np.random.default_rng(0)).shape
    (3,)
    """
    return 0.5 * np.log(rng.chisquare(2 * n_snapshots, shape) / (2 * n_snapshots))


@dataclass(frozen=True)
class AveragedEnvelope(FrozenModel):
    """Error of readings that average the envelope of N Gaussian snapshots.

    Parameters
    ----------
    n_snapshots : int
        N, snapshots in one reading.
    exact_moments : bool
        Use the exact mean log σ_y + ½(ψ(N) - ln N), with variance ¼ψ'(N), in place of log σ_y
        and 1/4N.

    References
    ----------
    Cevher, Sankaranarayanan, Chellappa, ICASSP 2008, (3).

    Examples
    --------
    >>> AveragedEnvelope(n_snapshots=25).moments()
    (0.0, 0.01)
    """

    n_snapshots: int = 50
    exact_moments: bool = False

    def __post_init__(self) -> None:
        count("n_snapshots", self.n_snapshots)
        instance("exact_moments", self.exact_moments, bool)

    def moments(self) -> tuple[float, float]:
        """Return bias, Np, and variance, Np², of a reading."""
        if not self.exact_moments:
            return 0.0, 1 / (4 * self.n_snapshots)
        mean, variance = log_envelope_moments(self.n_snapshots)
        return float(mean), float(variance)
