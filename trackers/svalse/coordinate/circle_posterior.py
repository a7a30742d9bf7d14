"""Posterior of one angle with any prior on the circle, and beside a second, discrete unknown.

ln q(θ, s) = Re Σ c_si exp(jiθ) + ln p(θ) + ln p(s) on a uniform grid: one inverse FFT, an
exponential, one FFT; or, where it is sharp, in windows about its modes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from arrivals.trackers.svalse.coordinate.angle_posterior import FINEST_GRID, LARGEST_GRID, NATS
from arrivals.typing import Complex, Float, Int

MOST_WINDOWS = 24
DENSITY_FLOOR = 1e-5  # of a uniform density that is mixed into one that a series gives


class CirclePrior(Protocol):
    """A density of an angle before it is measured, up to a constant."""

    @property
    def concentration(self) -> float:
        """Largest curvature of its logarithm, which the grid must resolve."""

    def on_grid(self, n_points: int) -> Float:
        """Return ln p at 2π i / n_points."""

    def at(self, theta: Float) -> Float:
        """Return ln p at any angles, up to the same constant."""


@dataclass(frozen=True, eq=False)
class VonMisesPrior:
    """A von Mises density, or its even mixture with its mirror image about ±90 degrees.

    Parameters
    ----------
    eta : complex
        κ exp(jμ); 0 for a uniform density.
    mirror : bool

    Examples
    --------
    >>> VonMisesPrior(2.0, mirror=True).on_grid(4).round(2) + 0
    array([ 0.02, -1.31,  0.02, -1.31])
    >>> VonMisesPrior(2.0, mirror=False).on_grid(4).round(2) + 0
    array([ 2.,  0., -2.,  0.])
    """

    eta: complex
    mirror: bool
    _grids: dict[int, Float] = field(default_factory=dict, init=False, repr=False)

    @property
    def concentration(self) -> float:
        """κ."""
        return abs(self.eta)

    def on_grid(self, n_points: int) -> Float:
        """Return ln p at 2π i / n_points, remembered."""
        if n_points not in self._grids:
            self._grids[n_points] = self.at(2 * np.pi * np.arange(n_points) / n_points)
        return self._grids[n_points]

    def at(self, theta: Float) -> Float:
        """Return ln p, or ln [p(θ) + p(π - θ)]."""
        if self.eta == 0:
            return np.zeros(np.shape(theta))
        along, across = self.eta.real * np.cos(theta), self.eta.imag * np.sin(theta)
        if not self.mirror:
            return np.asarray(along + across)
        return np.asarray(across + np.logaddexp(along, -along) - abs(self.eta))


@dataclass(frozen=True, eq=False)
class SeriesPrior:
    """A density given by its moments ⟨exp(jiθ)⟩, i = 0, 1, ..., with a uniform floor.

    Parameters
    ----------
    moments : ndarray, shape (n_moments,)
    concentration : float
        That of the step that blurred it.

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
        """Return ln(max(p, 0) + floor) of a density scaled to mean 1, remembered."""
        if n_points not in self._grids:
            n = min(len(self.moments), n_points // 2)
            density = np.fft.irfft(self.moments[:n].conj(), n_points, norm="forward")
            self._grids[n_points] = np.log(np.maximum(density, 0) + DENSITY_FLOOR)
        return self._grids[n_points]

    def at(self, theta: Float) -> Float:
        """Return ln p between the points of a grid fine enough for straight lines."""
        n = 1 << (32 * len(self.moments)).bit_length()
        known = self.on_grid(n)
        where = np.asarray(theta) % (2 * np.pi) * (n / (2 * np.pi))
        return np.asarray(np.interp(where, np.arange(n + 1), np.append(known, known[0])))


def grid_moments(
    c: Complex, prior: CirclePrior, weights: Float, n_moments: int, *, mirror: bool = False
) -> tuple[Complex, complex]:
    """Return moments ⟨exp(jiθ) 1ₛ⟩ and the mean of exp(jθ), of a mirrored angle's front half.

    Parameters
    ----------
    c : ndarray, shape (n_nuisance, D + 1)
        One-sided coefficients of the log likelihood, constants included.
    prior : CirclePrior
    weights : ndarray, shape (n_nuisance,)
        Prior of the second unknown.
    n_moments : int
    mirror : bool
        Whether θ and π - θ are the same direction.

    Returns
    -------
    moments : ndarray, shape (n_nuisance, n_moments)
        Those of order zero are the posterior of the second unknown.
    mean : complex

    Examples
    --------
    >>> c = np.array([[0.0, 4.0], [0.0, 0.0]])
    >>> E, mean = grid_moments(c, VonMisesPrior(0.0, False), np.array([0.5, 0.5]), 2)
    >>> E[:, 0].real.round(4), float((E[0, 1] / E[0, 0]).real.round(6))  # I0(4):1, I1(4)/I0(4)
    (array([0.9187, 0.0813]), 0.863523)
    """
    with np.errstate(divide="ignore"):
        log_weights = np.log(weights)
    sharpness = float((np.abs(c) @ np.arange(c.shape[1]) ** 2).max()) + prior.concentration
    wanted = min(2 * math.pi * 1.2 * math.sqrt(1 + sharpness), FINEST_GRID)
    if wanted > LARGEST_GRID:
        found = _in_windows(c, prior, log_weights, n_moments, mirror)
        if found is not None:
            return found
    n_points = 1 << max(8, int(max(wanted, 2 * c.shape[1], 2 * n_moments)).bit_length())
    log_q = _on_grid(c, n_points, prior, log_weights)
    log_q -= log_q.max()
    q = np.exp(log_q, out=log_q)
    F = np.fft.rfft(q, axis=1)
    moments = F[:, :n_moments].conj() / F[:, 0].real.sum()
    return moments, _front(q.sum(axis=0)) if mirror else complex(moments[:, 1].sum())


def _on_grid(c: Complex, n_points: int, prior: CirclePrior, log_weights: Float) -> Float:
    """Return ln q at 2π i / n_points, (n_nuisance, n_points)."""
    log_q = np.fft.irfft(c, n_points, axis=1, norm="forward")  # twice, but for the constant
    log_q += c[:, :1].real
    log_q *= 0.5
    log_q += prior.on_grid(n_points)
    log_q += log_weights[:, None]
    return log_q


def _front(q: Float) -> complex:
    """Return the mean of exp(jθ) over cos θ ≥ 0."""
    half = len(q) // 4
    front = np.concatenate([q[-half:], q[: half + 1]])
    theta = 2 * np.pi * np.arange(-half, half + 1) / len(q)
    return complex(front @ np.exp(1j * theta) / front.sum())


def _in_windows(
    c: Complex, prior: CirclePrior, log_weights: Float, n_moments: int, mirror: bool
) -> tuple[Complex, complex] | None:
    """Integrate about each mode near the top, 37 points over 8.1 std; None where that fails.

    The modes are the likelihood's: where windows are wanted, the prior is much wider.
    """
    s, centres, curvature = _modes(c, prior, log_weights)
    if len(s) > MOST_WINDOWS or not (curvature > 0).all() or _overlap(s, centres, curvature):
        return None
    std = 1 / np.sqrt(curvature)
    theta = centres[:, None] + 0.45 * std[:, None] * np.arange(-18, 19)
    n = max(n_moments, c.shape[1])
    d = np.empty((*theta.shape, n), dtype=np.complex128)
    d[..., 0], d[..., 1:] = 1, np.exp(1j * theta)[..., None]
    np.cumprod(d, axis=-1, out=d)
    log_q = (d[..., : c.shape[1]] @ c[s][..., None])[..., 0].real
    log_q += prior.at(theta) + log_weights[s][:, None]
    log_q -= log_q.max()
    if log_q[:, [0, -1]].max() > -22:
        return None
    weight = std[:, None] * np.exp(log_q)
    moments = np.zeros((len(c), n_moments), dtype=np.complex128)
    np.add.at(moments, s, np.einsum("wp,wpi->wi", weight / weight.sum(), d[..., :n_moments]))
    if not mirror:
        return moments, complex(moments[:, 1].sum())
    front = weight * (np.cos(theta) >= 0)
    return moments, complex((front * np.exp(1j * theta)).sum() / front.sum())


def _modes(c: Complex, prior: CirclePrior, log_weights: Float) -> tuple[Int, Float, Float]:
    """Return second unknown, place and curvature of the maxima within 30 nats of the top."""
    i = np.arange(c.shape[1])
    n_points = 1 << (8 * c.shape[1]).bit_length()
    log_q = _on_grid(c, n_points, prior, log_weights)
    left, right = np.roll(log_q, 1, axis=1), np.roll(log_q, -1, axis=1)
    # a peak between grid points may stand above both by an eighth of their neighbours' drop
    headroom = np.maximum(2 * log_q - left - right, 0)
    top = (log_q >= left) & (log_q > right) & (log_q + headroom >= log_q.max() - NATS)
    s, place = np.nonzero(top)
    step = 2 * np.pi / n_points
    start = theta = np.asarray(place * step, dtype=np.float64)
    for _ in range(5):
        terms = np.exp(1j * np.multiply.outer(theta, i)) * c[s]
        slope, curvature = -terms.imag @ i, terms.real @ i**2
        newton = slope / np.where(curvature > 0, curvature, np.inf)
        theta = np.clip(theta + newton, start - step, start + step)
    height = terms.real.sum(axis=1) + prior.at(theta) + log_weights[s]
    near = height > height.max() - NATS
    return s[near], theta[near], np.asarray(curvature[near])


def _overlap(s: Int, centres: Float, curvature: Float) -> bool:
    """Tell whether the windows of one value of the second unknown overlap."""
    std = 1 / np.sqrt(curvature)
    gap = np.abs((centres[:, None] - centres + np.pi) % (2 * np.pi) - np.pi)
    near = (gap < 8.1 * (std[:, None] + std)) & (s[:, None] == s)
    return bool(np.count_nonzero(near) > len(s))
