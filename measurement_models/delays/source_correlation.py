"""Correlation of a source's waveform over time, known in advance."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.typing import Float
from arrivals.validation import items, number, positive, real

N_GRID = 1024  # cells of the band, for spectra without a closed form


class SourceCorrelation(FrozenModel, ABC):
    """The normalised correlation ρ(τ) of a real waveform, at lags that need not be whole.

    Notes
    -----
    Lags are in samples, frequencies in cycles per sample; ρ(0) = 1.
    """

    @abstractmethod
    def rho(self, tau: ArrayLike) -> Float:
        """Return the correlation at lags of any shape."""

    @abstractmethod
    def drho(self, tau: ArrayLike) -> Float:
        """Return its derivative with respect to the lag."""

    @property
    @abstractmethod
    def highest(self) -> float:
        """Highest frequency of the source, cycles per sample."""

    @property
    def order(self) -> int | None:
        """Number of samples from which all others follow: two for each tone; None for a band."""
        return None


@dataclass(frozen=True)
class FlatBand(SourceCorrelation):
    """A waveform whose spectrum is flat between two frequencies.

    Parameters
    ----------
    low, high : float
        Edges of the band, cycles per sample: 0 <= low < high <= 0.5.

    Raises
    ------
    ValueError
        If the edges are in the wrong order or beyond half the sampling rate.

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, "Performance evaluation of an algorithm for
    estimation of DOA using model estimation technique", text under (4).

    Examples
    --------
    >>> band = FlatBand(0.15, 0.35)
    >>> band.rho([0.4, 1.0]).round(4), band.drho([0.4]).round(4)
    (array([0.8005, 0.    ]), array([-0.9559]))
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        low, high = number("low", self.low), number("high", self.high)
        if not 0 <= low < high <= 0.5:
            raise ValueError(
                "low and high must satisfy 0 <= low < high <= 0.5 cycles per sample, half the "
                f"sampling rate; got {self.low} and {self.high}"
            )

    @property
    def highest(self) -> float:
        """Upper edge of the band."""
        return self.high

    def rho(self, tau: ArrayLike) -> Float:
        """Return cos(ω₁τ) sin(ωτ)/ωτ, ω half the width of the band and ω₁ its middle, rad."""
        tau = np.asarray(tau, dtype=np.float64)
        return np.asarray(np.cos(self._middle * tau) * np.sinc(self._width * tau))

    def drho(self, tau: ArrayLike) -> Float:
        """Return the derivative of `rho`."""
        tau = np.asarray(tau, dtype=np.float64)
        u, phase = np.pi * self._width * tau, self._middle * tau
        turning = -self._middle * np.sin(phase) * np.sinc(self._width * tau)
        return np.asarray(turning + np.pi * self._width * np.cos(phase) * dsinc(u))

    @property
    def _width(self) -> float:
        return self.high - self.low

    @property
    def _middle(self) -> float:
        return np.pi * (self.high + self.low)


def dsinc(u: ArrayLike) -> Float:
    """Return the derivative of sin(u)/u.

    Examples
    --------
    >>> dsinc([1e-9, 1.0]).round(4) + 0.0
    array([ 0.    , -0.3012])
    """
    u = np.asarray(u, dtype=np.float64)
    small = np.abs(u) < 1e-4
    v = np.where(small, 1.0, u)
    return np.asarray(np.where(small, -u / 3, (v * np.cos(v) - np.sin(v)) / (v * v)))


@dataclass(frozen=True)
class Tones(SourceCorrelation):
    """A waveform that is a sum of tones.

    Parameters
    ----------
    frequencies : float or sequence of float
        Cycles per sample, above 0 and below 0.5.
    powers : sequence of float, optional
        Powers of the tones, scaled to the sum 1; equal if None.

    Attributes
    ----------
    omega, shares : ndarray, shape (n_tones,)
        Angular frequencies, rad per sample, and shares of the tones in the power.

    Raises
    ------
    ValueError
        If a frequency is out of range (at half the sampling rate the samples of a tone do not
        determine its phase), or the powers do not fit.

    Examples
    --------
    >>> Tones(0.25).rho([0.0, 1.0, 2.0]).round(6) + 0.0
    array([ 1.,  0., -1.])
    """

    frequencies: Sequence[float] | float
    powers: Sequence[float] | None = None
    omega: Float = field(init=False, repr=False, compare=False)
    shares: Float = field(init=False, repr=False, compare=False)
    slopes: Float = field(init=False, repr=False, compare=False)  # -p ω

    def __post_init__(self) -> None:
        frequencies = tuple(np.ravel(real("frequencies", self.frequencies)).tolist())
        if not frequencies or not all(0 < f < 0.5 for f in frequencies):
            raise ValueError(
                "frequencies must lie above 0 and below half the sampling rate, 0.5 cycles per "
                f"sample, where a tone is singular; got {list(frequencies)}"
            )
        object.__setattr__(self, "frequencies", frequencies)
        if self.powers is not None:
            powers = tuple(positive("powers", power) for power in items("powers", self.powers))
            if len(powers) != len(frequencies):
                raise ValueError(
                    f"powers must be {len(frequencies)}, one for each tone; got {len(powers)}"
                )
            object.__setattr__(self, "powers", powers)
        shares = np.ones(len(frequencies)) if self.powers is None else np.asarray(self.powers)
        object.__setattr__(self, "omega", 2 * np.pi * np.asarray(frequencies))
        object.__setattr__(self, "shares", shares / shares.sum())
        object.__setattr__(self, "slopes", -self.shares * self.omega)

    @property
    def highest(self) -> float:
        """Highest of the frequencies."""
        return float(np.max(self.frequencies))

    @property
    def order(self) -> int:
        """Two for each tone."""
        return 2 * len(self.omega)

    def rho(self, tau: ArrayLike) -> Float:
        """Return Σ p cos ωτ."""
        return spectral_sum(np.cos, tau, self.omega, self.shares)

    def drho(self, tau: ArrayLike) -> Float:
        """Return -Σ p ω sin ωτ."""
        return spectral_sum(np.sin, tau, self.omega, self.slopes)


@dataclass(frozen=True)
class Autoregressive(SourceCorrelation):
    """A waveform with the spectrum of an autoregressive process, s(k) = Σ aᵢ s(k-i) + w(k).

    Parameters
    ----------
    coefficients : sequence of float
        a₁, a₂, ..., of a stable process.

    Raises
    ------
    ValueError
        If the process is not stable.

    Notes
    -----
    Between the samples the waveform is the band-limited one. Its correlation is the cosine
    transform of the spectrum on a fine grid, good for lags up to some hundreds of samples.

    Examples
    --------
    >>> Autoregressive([0.9]).rho([0, 1, 2]).round(4)
    array([1.  , 0.9 , 0.81])
    """

    coefficients: Sequence[float]

    def __post_init__(self) -> None:
        a = tuple(np.ravel(real("coefficients", self.coefficients)).tolist())
        if (
            not np.abs(a).max(initial=0.0) < 1e6
            or np.abs(np.roots([1.0, *np.negative(a)])).max(initial=0.0) >= 1
        ):
            raise ValueError(f"coefficients must be those of a stable process; got {shown(a)}")
        object.__setattr__(self, "coefficients", a)

    @property
    def highest(self) -> float:
        """Frequency under which 99 % of the power lies, cycles per sample."""
        omega, shares = self._spectrum()
        return float(omega[np.searchsorted(np.cumsum(shares), 0.99)] / (2 * np.pi))

    def rho(self, tau: ArrayLike) -> Float:
        """Return ∫ S(ω) cos ωτ dω, S = 1/|A|² scaled to the power 1."""
        return spectral_sum(np.cos, tau, *self._spectrum())

    def drho(self, tau: ArrayLike) -> Float:
        """Return -∫ S(ω) ω sin ωτ dω."""
        omega, shares = self._spectrum()
        return spectral_sum(np.sin, tau, omega, -shares * omega)

    def _spectrum(self) -> tuple[Float, Float]:
        omega = np.pi * (np.arange(N_GRID) + 0.5) / N_GRID
        lags = np.arange(1, len(np.atleast_1d(self.coefficients)) + 1)
        A = 1 - np.exp(-1j * np.multiply.outer(omega, lags)) @ np.asarray(self.coefficients)
        density = 1 / np.abs(A) ** 2
        return omega, density / density.sum()


def spectral_sum(wave: np.ufunc, tau: ArrayLike, omega: Float, weights: Float) -> Float:
    """Return Σ w cos ωτ, or of another wave, for lags of any shape.

    Examples
    --------
    >>> spectral_sum(np.cos, [0.0, 1.0], np.array([np.pi]), np.array([2.0]))
    array([ 2., -2.])
    """
    tau = np.asarray(tau, dtype=np.float64)
    if len(omega) == 1:
        return np.asarray(weights.item() * wave(omega.item() * tau))
    return np.asarray((wave(tau[..., None] * omega) * weights).sum(axis=-1))
