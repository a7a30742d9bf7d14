"""Posterior of one angle with any prior on the circle, and of a second, discrete unknown.

ln q(θ, s) = Re Σ c_si exp(jiθ) + ln p(θ) + ln p(s) on a uniform grid: one inverse FFT, an
exponential, one FFT; or, where it is sharp, in windows about its modes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from arrivals.trackers.svalse.coordinate.angle_posterior import MAX_PLAIN_GRID, grid_size, squares
from arrivals.trackers.svalse.coordinate.windowed_quadrature import (
    integrate_windows,
    mode_grid_size,
)
from arrivals.typing import Complex, Float, Int

DENSITY_FLOOR = 1e-5  # of a uniform density that is mixed into one given by a series


class CirclePrior(Protocol):
    """Prior density of an angle, up to a constant."""

    @property
    def concentration(self) -> float:
        """Largest curvature of the logarithm, which the grid must resolve."""

    def on_grid(self, n_points: int) -> Float:
        """Return ln p at 2π i / n_points."""

    def at(self, theta: Float) -> Float:
        """Return ln p at any angles, up to the same constant."""


@dataclass(frozen=True, eq=False)
class VonMisesPrior:
    """Von Mises density, or its even mixture with its mirror image about ±90 degrees.

    Parameters
    ----------
    eta : complex
        κ exp(jμ); 0 for a uniform density.
    front_back_ambiguous : bool
        Whether θ and π - θ are the same direction.

    Examples
    --------
    >>> VonMisesPrior(2.0, front_back_ambiguous=True).on_grid(4).round(2) + 0
    array([ 0.02, -1.31,  0.02, -1.31])
    >>> VonMisesPrior(2.0, front_back_ambiguous=False).on_grid(4).round(2) + 0
    array([ 2.,  0., -2.,  0.])
    """

    eta: complex
    front_back_ambiguous: bool
    _grids: dict[int, Float] = field(default_factory=dict, init=False, repr=False)

    @property
    def concentration(self) -> float:
        """κ."""
        return abs(self.eta)

    def on_grid(self, n_points: int) -> Float:
        """Return ln p at 2π i / n_points (cached)."""
        if n_points not in self._grids:
            self._grids[n_points] = self.at(2 * np.pi * np.arange(n_points) / n_points)
        return self._grids[n_points]

    def at(self, theta: Float) -> Float:
        """Return ln p, or ln [p(θ) + p(π - θ)]."""
        if self.eta == 0:
            return np.zeros(np.shape(theta))
        along, across = self.eta.real * np.cos(theta), self.eta.imag * np.sin(theta)
        if not self.front_back_ambiguous:
            return np.asarray(along + across)
        return np.asarray(across + np.logaddexp(along, -along) - abs(self.eta))


@dataclass(frozen=True, eq=False)
class SeriesPrior:
    """Density given by its moments ⟨exp(jiθ)⟩, i = 0, 1, ..., with a uniform floor.

    Parameters
    ----------
    moments : ndarray, shape (n_moments,)
    concentration : float
        Concentration of the motion step that the density was convolved with.

    Examples
    --------
    >>> flat = SeriesPrior(np.array([1.0, 0.0, 0.0]), 1.0).on_grid(8)
    >>> bool(np.ptp(flat) < 1e-12)
    True
    """

    moments: Complex
    concentration: float
    _grids: dict[int, Float] = field(default_factory=dict, init=False, repr=False)

    def on_grid(self, n_points: int) -> Float:
        """Return ln(max(p, 0) + floor) of a density scaled to mean 1 (cached)."""
        if n_points not in self._grids:
            n = min(len(self.moments), n_points // 2)
            density = np.fft.irfft(self.moments[:n].conj(), n_points, norm="forward")
            self._grids[n_points] = np.log(np.maximum(density, 0) + DENSITY_FLOOR)
        return self._grids[n_points]

    def at(self, theta: Float) -> Float:
        """Return ln p by linear interpolation on a fine grid."""
        n = 1 << (32 * len(self.moments)).bit_length()
        log_p = self.on_grid(n)
        position = np.asarray(theta) % (2 * np.pi) * (n / (2 * np.pi))
        return np.asarray(np.interp(position, np.arange(n + 1), np.append(log_p, log_p[0])))


def circle_moments(
    c: Complex, prior: CirclePrior, weights: Float, n_moments: int, *, front_only: bool = False
) -> tuple[Complex, complex]:
    """Return moments ⟨exp(jiθ) 1ₛ⟩ and the mean of exp(jθ).

    Parameters
    ----------
    c : ndarray, shape (n_nuisance, D + 1)
        One-sided coefficients of the log likelihood, constants included.
    prior : CirclePrior
    weights : ndarray, shape (n_nuisance,)
        Prior of the second unknown.
    n_moments : int
    front_only : bool
        Whether the mean is that of the front half, cos θ ≥ 0, as θ and π - θ are the same
        direction.

    Returns
    -------
    moments : ndarray, shape (n_nuisance, n_moments)
        Those of order zero are the posterior of the second unknown.
    mean : complex

    Examples
    --------
    >>> c = np.array([[0.0, 4.0], [0.0, 0.0]])
    >>> E, mean = circle_moments(c, VonMisesPrior(0.0, False), np.array([0.5, 0.5]), 2)
    >>> E[:, 0].real.round(4), float((E[0, 1] / E[0, 0]).real.round(6))  # I0(4):1, I1(4)/I0(4)
    (array([0.9187, 0.0813]), 0.863523)
    """
    with np.errstate(divide="ignore"):
        log_weights = np.log(weights)
    n_points = grid_size(float((np.abs(c) @ squares(c.shape[1])).max()) + prior.concentration)
    if n_points > MAX_PLAIN_GRID:
        solution = window_circle_moments(c, prior, log_weights, n_moments, front_only=front_only)
        if solution is not None:
            return solution
    size = 1 << max(8, int(max(n_points, 2 * c.shape[1], 2 * n_moments)).bit_length())
    log_q = log_posterior(c, size, prior, log_weights)
    log_q -= log_q.max()
    q = np.exp(log_q, out=log_q)
    F = np.fft.rfft(q, axis=1)
    moments = F[:, :n_moments].conj() / F[:, 0].real.sum()
    return moments, front_mean(q.sum(axis=0)) if front_only else complex(moments[:, 1].sum())


def log_posterior(c: Complex, n_points: int, prior: CirclePrior, log_weights: Float) -> Float:
    """Return ln q at 2π i / n_points, (n_nuisance, n_points)."""
    log_q = np.fft.irfft(c, n_points, axis=1, norm="forward")  # twice, except for the constant
    log_q += c[:, :1].real
    log_q *= 0.5
    log_q += prior.on_grid(n_points)
    log_q += log_weights[:, None]
    return log_q


def front_mean(q: Float) -> complex:
    """Return the mean of exp(jθ) over cos θ ≥ 0 of a density on a uniform grid."""
    half = len(q) // 4
    front_q = np.concatenate([q[-half:], q[: half + 1]])
    theta = 2 * np.pi * np.arange(-half, half + 1) / len(q)
    return complex(front_q @ np.exp(1j * theta) / front_q.sum())


def window_circle_moments(
    c: Complex, prior: CirclePrior, log_weights: Float, n_moments: int, *, front_only: bool
) -> tuple[Complex, complex] | None:
    """Return the same by quadrature about each mode near the top; None if that fails."""

    def log_prior(s: Int, theta: Float) -> Float:
        return np.asarray(prior.at(theta) + log_weights[s])

    log_q = log_posterior(c, mode_grid_size(c.shape[1]), prior, log_weights)
    windows = integrate_windows(c, log_q, n_moments, log_prior)
    if windows is None:
        return None
    s, powers, weight = windows
    moments = np.zeros((len(c), n_moments), dtype=np.complex128)
    np.add.at(moments, s, np.einsum("wp,wpi->wi", weight, powers))
    if not front_only:
        return moments, complex(moments[:, 1].sum())
    front_weight = weight * (powers[..., 1].real >= 0)
    return moments, complex((front_weight * powers[..., 1]).sum() / front_weight.sum())
