"""A sensor's sample from its neighbour's, by interpolation at the delay between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from arrivals.entry_names import checked_names
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.delays.band_filter import BandFilter
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation
from arrivals.parameters import FrozenModel
from arrivals.typing import Float, Int
from arrivals.validation import count, instance, items, not_negative, positive, real


def window(reach: float) -> tuple[int, ...]:
    """Return the offsets of the taps that interpolate well at every delay within ±reach.

    Examples
    --------
    >>> window(2.0)
    (-3, -2, -1, 0, 1, 2, 3, 4)
    """
    return tuple(range(math.floor(1e-9 - reach) - 1, math.ceil(reach - 1e-9) + 3))


WHITE = 0.01  # of filtered noise, share that stays white: without it, many taps are singular


@dataclass(frozen=True)
class DelayInterpolator(FrozenModel):
    """The linear least-squares estimate of s(k - τ) from s(k - o₁), ..., s(k - o_L).

    Parameters
    ----------
    correlation : SourceCorrelation
        Correlation of the source over time.
    offsets : sequence of int
        o, samples; negative ones are later samples. (0, 1) are the paper's two.
    loading : float
        ε_c, noise power over source power that the taps are taken to carry. 0 gives the paper's
        coefficients; with the true ratio the noise biases no delay.
    noise_filter : BandFilter, optional
        Filter that the taps have passed, so that their noise is correlated; ε is the ratio of the
        white noise in front of it.

    Raises
    ------
    ValueError
        If the offsets repeat, or so many taps are singular without loading.

    Notes
    -----
    Shapes: delays (...), coefficients (..., n_taps). Units: samples.

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, (4), after Pridham and Mucci, Proc. IEEE 67(6),
    1979. In (3) and (11) the same coefficients stand at an index one too high, which would bias
    the delay by one sample; they are used here as (4) defines them.

    Examples
    --------
    A tone delayed by a quarter of a period equals its previous sample:

    >>> from arrivals.measurement_models import Tones
    >>> DelayInterpolator(Tones(0.25)).coefficients(1.0).round(6) + 0.0
    array([0., 1.])
    """

    correlation: SourceCorrelation
    offsets: Sequence[int] = (0, 1)
    loading: float = 0.0
    noise_filter: BandFilter | None = None
    r0: Float = field(init=False, repr=False, compare=False)
    noise: Float | float = field(init=False, repr=False, compare=False)
    G: Float = field(init=False, repr=False, compare=False)
    shifts: Int = field(init=False, repr=False, compare=False)  # `offsets` as an array
    delays: Float = field(init=False, repr=False, compare=False)  # the same as floats

    def __post_init__(self) -> None:
        instance("correlation", self.correlation, SourceCorrelation)  # type: ignore[type-abstract]  # any
        not_negative("loading", self.loading)
        offsets = tuple(count("offsets", o, -10_000) for o in items("offsets", self.offsets))
        if not offsets or len(set(offsets)) < len(offsets):
            raise ValueError(f"offsets must be different whole numbers; got {self.offsets}")
        object.__setattr__(self, "offsets", offsets)
        lags = np.subtract.outer(offsets, offsets)
        r0, noise = self.correlation.rho(lags), np.eye(len(offsets))
        if self.noise_filter is not None:
            noise = self.noise_filter.autocorrelation(lags) + WHITE * noise
        r = r0 + self.loading * noise
        if np.linalg.cond(r) > 1e12:
            raise ValueError(
                f"loading must be at least 1e-9 for {len(offsets)} taps on this source; got "
                f"{self.loading}: the correlation matrix is singular"
            )
        arrays = (r0, noise, np.linalg.inv(r), np.array(offsets), np.array(offsets, np.float64))
        for name, matrix in zip(("r0", "noise", "G", "shifts", "delays"), arrays, strict=True):
            matrix.setflags(write=False)
            object.__setattr__(self, name, matrix)

    @property
    def n_taps(self) -> int:
        """Number of taps."""
        return len(self.offsets)

    def coefficients(self, tau: ArrayLike) -> Float:
        """Return c(τ) = G p(τ), p = ρ(τ - o): (...) -> (..., n_taps)."""
        return self._solved(self.correlation.rho(self._lags(tau)))

    def jacobian(self, tau: ArrayLike) -> Float:
        """Return dc/dτ = G p'(τ): (...) -> (..., n_taps)."""
        return self._solved(self.correlation.drho(self._lags(tau)))

    def error_variance(self, tau: ArrayLike, noise_ratio: float = 0.0) -> Float:
        """Return 1 - 2cᵀp + cᵀ(r₀ + εI)c, the power of the error over that of the source.

        It holds the interpolation error, and the noise of taps with the ratio ε.
        """
        p = self.correlation.rho(self._lags(tau))
        return self._error(self._solved(p), p, noise_ratio)

    def linearise(self, tau: ArrayLike, noise_ratio: float = 0.0) -> tuple[Float, Float]:
        """Return coefficients with their derivatives, (..., 2, n_taps), and the error variance."""
        lags = self._lags(tau)
        both = np.empty((*lags.shape[:-1], 2, lags.shape[-1]))
        both[..., 0, :] = p = self.correlation.rho(lags)
        both[..., 1, :] = self.correlation.drho(lags)
        both = both.dot(self.G) if lags.ndim == 1 else both @ self.G
        return both, self._error(both[..., 0, :], p, noise_ratio)

    def _lags(self, tau: ArrayLike) -> Float:
        return np.asarray(np.asarray(tau, dtype=np.float64)[..., None] - self.delays)

    def _solved(self, p: Float) -> Float:
        return np.asarray(p @ self.G)

    def _error(self, c: Float, p: Float, noise_ratio: float) -> Float:
        mixed = c.dot(self.r0) - 2 * p
        noise = c if self.noise_filter is None else c.dot(self.noise)
        mixed += noise_ratio * noise
        return np.asarray(1 + (mixed.dot(c) if c.ndim == 1 else (mixed * c).sum(axis=-1)))


@dataclass(frozen=True, eq=False)
class InterpolationDelay(MeasurementModel):
    """Samples of a line's sensors predicted from their neighbours: z = X c(mΔ), of variance R(mΔ).

    The samples X of the neighbours are known inputs: bind them by `replace(regressors=X)`, or
    pass them to `h` and `H`, as filterpy's filters do. The delay Δ is element 0 of the state,
    whatever follows it.

    Parameters
    ----------
    interpolator : DelayInterpolator
        Interpolator of the source's waveform.
    n_sensors : int
        Sensors j = 0, 1, ... in the order of growing delay.
    noise_ratio : float
        ε, noise power over source power; the data are scaled to a source of power 1.
    baseline : int
        m: sensor j is predicted from j - m; a negative one runs backwards along the array.
    inflation : float
        Factor on R, for residuals that share samples with those of other baselines.
    regressors : ndarray, shape (..., n_sensors - abs(m), n_taps), optional
        X, the samples of the present snapshot.

    Notes
    -----
    Shapes: states (..., dim_x), measurements (..., n_sensors - abs(m)). Units: samples.

    References
    ----------
    Radhakrishnan, Unnikrishnan and Balakrishnan, (9)-(11), with the state reduced to Δ: the
    noise of the regressors is in R, and H holds the slope of the coefficients, which the paper's
    H leaves out.

    Examples
    --------
    >>> from arrivals.measurement_models import Tones
    >>> model = InterpolationDelay(DelayInterpolator(Tones(0.25)), n_sensors=3, noise_ratio=0.1)
    >>> frames = np.cos(np.pi / 2 * (np.arange(2)[:, None] - 0.5 * np.arange(3)))
    >>> z, X = model.split(frames)
    >>> model.residual(z, model.h([0.5], X)).round(6) + 0.0
    array([0., 0.])
    """

    interpolator: DelayInterpolator
    n_sensors: int
    noise_ratio: float
    baseline: int = 1
    inflation: float = 1.0
    regressors: Float | None = None

    def __post_init__(self) -> None:
        instance("interpolator", self.interpolator, DelayInterpolator)
        not_negative("noise_ratio", self.noise_ratio)
        positive("inflation", self.inflation)
        n_sensors = count("n_sensors", self.n_sensors, minimum=2, maximum=10_000)
        if not 1 <= abs(count("baseline", self.baseline, minimum=-n_sensors)) < n_sensors:
            wanted = f"a number of steps from 1 to {n_sensors - 1}, or its negative"
            raise ValueError(f"baseline must be {wanted}; got {self.baseline}")

    @property
    def dim_z(self) -> int:
        """Number of sensors that have a neighbour to be predicted from."""
        return self.n_sensors - abs(self.baseline)

    @property
    def latency(self) -> int:
        """Number of snapshots after its own that a measurement waits for."""
        return max(0, -min(self.interpolator.offsets))

    @property
    def memory(self) -> int:
        """Number of snapshots before its own that a measurement needs."""
        return max(0, *self.interpolator.offsets)

    def split(self, frames: ArrayLike, k: int | None = None) -> tuple[Float, Float]:
        """Return measurement and regressors of snapshot k, (n,) and (n, n_taps).

        Parameters
        ----------
        frames : array_like, shape (..., n_snapshots, n_sensors)
        k : int, optional
            Number of a snapshot; the last one with all taps if None.
        """
        if type(frames) is not np.ndarray or frames.dtype != np.float64 or frames.ndim < 2:
            frames = np.atleast_2d(real("frames", frames))
        k = frames.shape[-2] - 1 - self.latency if k is None else k
        if not self.memory <= k < frames.shape[-2] - self.latency:
            raise ValueError(
                f"k must have all taps within the {frames.shape[-2]} snapshots; got {k}"
            )
        n, m = self.dim_z, self.baseline
        first, source = max(m, 0), max(-m, 0)
        taps = frames[..., source : source + n].take(k - self.interpolator.shifts, axis=-2)
        return frames[..., k, first : first + n], np.swapaxes(taps, -1, -2)

    def linearise(self, delay: ArrayLike) -> tuple[Float, Float]:
        """Return c(mΔ) with c'(mΔ), (..., 2, n_taps), and R(mΔ), (...), for delays (...)."""
        tau = self.baseline * np.asarray(delay)
        taps, error = self.interpolator.linearise(tau, self.noise_ratio)
        if (noise_filter := self.interpolator.noise_filter) is not None:
            # residuals are correlated: those of 1 / share samples count as one
            error = error / noise_filter.noise_share
        return taps, self.inflation * (self.noise_ratio + error)

    @property
    def needs(self) -> tuple[str, ...]:
        """Delay."""
        return ("delay",)

    def for_state(self, names: Sequence[str]) -> MeasurementModel:
        """Return this model for states with these names; itself where the delay comes first."""
        return self if checked_names(names)[:1] == self.needs else super().for_state(names)

    def h(self, x: ArrayLike, regressors: ArrayLike | None = None) -> Float:
        """Return the samples predicted for states: X c(mΔ), (..., dim_x) -> (..., dim_z)."""
        c = self.interpolator.coefficients(self.baseline * _delay(x))
        return np.asarray((self._inputs(regressors) @ c[..., None])[..., 0])

    def H(self, x: ArrayLike, regressors: ArrayLike | None = None) -> Float:
        """Return the Jacobian of `h` at one state: m X c'(mΔ) in column 0, (dim_z, dim_x)."""
        dc = self.interpolator.jacobian(self.baseline * _delay(x))
        slope = np.zeros((self.dim_z, np.shape(x)[-1]))
        slope[:, 0] = self.baseline * self._inputs(regressors) @ dc
        return slope

    def variance(self, x: ArrayLike) -> Float:
        """Return the variance of each residual at states, R(mΔ): (..., dim_x) -> (...)."""
        return self.linearise(_delay(x))[1]

    @property
    def R(self) -> Float:
        """Covariance of the residuals at broadside; `variance` gives it at any state."""
        return float(self.variance(np.zeros(1))) * np.eye(self.dim_z)

    def _inputs(self, regressors: ArrayLike | None) -> Float:
        X = self.regressors if regressors is None else regressors
        if X is None:
            raise ValueError("regressors must be set, samples of the neighbours; got None")
        X, m, n = real("regressors", X), self.dim_z, self.interpolator.n_taps
        if X.shape[-2:] != (m, n):
            raise ValueError(f"regressors must have shape (..., {m}, {n}); got {X.shape}")
        return X


def _delay(x: ArrayLike) -> Float:
    """Return element 0 of states (..., dim_x)."""
    x = real("x", x)
    if x.ndim == 0 or x.shape[-1] == 0:
        raise ValueError(f"states must have shape (..., dim_x); got {x.shape}")
    return x[..., 0]
