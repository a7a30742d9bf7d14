"""Measurement of all sensors of a line by the waveform of one source at the array's centre."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from arrivals.entry_names import checked_names
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.delays.interpolation import DelayInterpolator
from arrivals.measurement_models.delays.source_correlation import SourceCorrelation
from arrivals.typing import Float
from arrivals.validation import count, instance, number, positive, real


@dataclass(frozen=True)
class SourceAtCentre(MeasurementModel):
    """Base of two models with the source's waveform at the array's centre in the state.

    The delay Δ is element 0 of the state, the source's elements are the last `dim_source`;
    other elements of the motion of the delay lie between them. A sensor lags the centre by
    τ_j = (j - (N-1)/2) Δ. The data are scaled to a source of power 1.
    """

    renamed: ClassVar[dict[str, str]] = {"drive": "process_noise"}

    @property
    @abstractmethod
    def dim_source(self) -> int:
        """Number of elements that hold the source."""

    @property
    @abstractmethod
    def source_names(self) -> tuple[str, ...]:
        """Names of these elements."""

    @property
    @abstractmethod
    def transition(self) -> Float:
        """Transition matrix of these elements over one snapshot, (dim_source, dim_source)."""

    @property
    @abstractmethod
    def innovation(self) -> Float:
        """Covariance of their innovation in one snapshot, (dim_source, dim_source)."""

    @property
    @abstractmethod
    def covariance(self) -> Float:
        """Their covariance before the first measurement, (dim_source, dim_source)."""

    @abstractmethod
    def linearise(self, x: Float) -> tuple[Float, Float, Float]:
        """Return h (..., N), H (..., N, dim_x) and the variances R_j (..., N) at states."""

    n_sensors: int
    noise_ratio: float

    @property
    def dim_z(self) -> int:
        """One sample of every sensor."""
        return self.n_sensors

    @cached_property
    def centred(self) -> Float:
        """Steps from the array's centre, j - (N-1)/2, (n_sensors,)."""
        return np.arange(self.n_sensors, dtype=np.float64) - (self.n_sensors - 1) / 2

    @property
    def needs(self) -> tuple[str, ...]:
        """delay, then the names of the source's elements."""
        return ("delay", *self.source_names)

    def for_state(self, names: Sequence[str]) -> MeasurementModel:
        """Return this model; itself if the delay comes first and the source's elements last."""
        n, names = self.dim_source, checked_names(names)
        return self if (*names[:1], *names[-n:]) == self.needs else super().for_state(names)

    def h(self, x: ArrayLike) -> Float:
        """Return the samples expected of states: (..., dim_x) -> (..., n_sensors)."""
        return self.linearise(self._states(x))[0]

    def H(self, x: ArrayLike) -> Float:
        """Return the Jacobian of `h` at one state, (n_sensors, dim_x)."""
        return self.linearise(self._states(x))[1]

    @property
    def R(self) -> Float:
        """Covariance of the noise at broadside."""
        return np.diag(self.linearise(np.zeros(1 + self.dim_source))[2])

    def _states(self, x: ArrayLike) -> Float:
        x = real("x", x)
        if x.ndim == 0 or x.shape[-1] <= self.dim_source:
            wanted = f"(..., n), n > {self.dim_source}: the delay, then the source"
            raise ValueError(f"states must have shape {wanted}; got {x.shape}")
        return x


@dataclass(frozen=True)
class DelayLine(SourceAtCentre):
    """A line of sensors, with some consecutive samples of the source in the state.

    h_j = c(τ_j)ᵀ s, the interpolation of the delay line s at the sensor's lag; it moves as the
    autoregressive process that fits its correlation best.

    Parameters
    ----------
    n_sensors : int
        Number of sensors.
    noise_ratio : float
        ε, noise power over source power.
    correlation : SourceCorrelation
        Correlation of the source over time.
    kappa : float
        Largest delay between neighbours, samples: a band needs taps as far as ±κ(N-1)/2 and two
        more; tones need two taps each.
    process_noise : float, optional
        q_s, variance gained by the source at every snapshot beyond its correlation: 1e-2 for tones,
        1e-3 for a band if None. Sources that move need it: their phase at the centre drifts.

    Notes
    -----
    Shapes: states (..., dim_x), measurements (..., n_sensors). Units: samples.

    Examples
    --------
    >>> from arrivals.measurement_models import Tones
    >>> line = DelayLine(3, 0.1, Tones(0.25), kappa=2.0)
    >>> line.h([0.5, 1.0, 0.0]).round(3)
    array([0.707, 1.   , 0.707])
    """

    correlation: SourceCorrelation
    kappa: float
    process_noise: float | None = None

    def __post_init__(self) -> None:
        count("n_sensors", self.n_sensors, minimum=2, maximum=10_000)
        positive("noise_ratio", self.noise_ratio)
        instance("correlation", self.correlation, SourceCorrelation)  # type: ignore[type-abstract]  # any
        positive("kappa", self.kappa)
        if self.process_noise is not None:
            positive("process_noise", self.process_noise)

    @property
    def offsets(self) -> tuple[int, ...]:
        """Lags of the delay line, samples from the present one; negative ones lie ahead."""
        order = self.correlation.order
        if order is not None:
            return tuple(range(1 - order // 2, 1 + order - order // 2))
        h = math.ceil(self.kappa * (self.n_sensors - 1) / 2 - 1e-9) + 2
        return tuple(range(-h, h + 1))

    @property
    def interpolator(self) -> DelayInterpolator:
        """Interpolator over the delay line, with a little loading for the sake of the inverse."""
        return _interpolator(self.correlation, self.offsets)

    @property
    def dim_source(self) -> int:
        """Number of taps."""
        return len(self.offsets)

    @property
    def source_names(self) -> tuple[str, ...]:
        """waveform_lag_0, ... for the lags of `offsets`."""
        return tuple(f"waveform_lag_{offset}" for offset in self.offsets)

    @property
    def transition(self) -> Float:
        """Prediction of the newest sample in the first row, and a shift."""
        n = self.dim_source
        A = np.eye(n, k=-1)
        A[0] = self.interpolator.G @ self.correlation.rho(np.arange(1, n + 1))
        return A

    @property
    def innovation(self) -> Float:
        """Error of that prediction, and q_s, on the newest sample."""
        n = self.dim_source
        tones = self.correlation.order is not None
        process_noise = self.process_noise or (1e-2 if tones else 1e-3)
        Q = np.zeros((n, n))
        predicted = float(self.transition[0] @ self.correlation.rho(np.arange(1, n + 1)))
        Q[0, 0] = max(1 - predicted, 0.0) + process_noise
        return Q

    @property
    def covariance(self) -> Float:
        """r₀, the source's own."""
        return self.interpolator.r0.copy()

    def linearise(self, x: Float) -> tuple[Float, Float, Float]:
        """Return h (..., N), H (..., N, dim_x) and the variances R_j (..., N) at states."""
        s, j = x[..., -self.dim_source :], self.centred
        taps, error = self.interpolator.linearise(x[..., :1] * j)
        expected = (taps @ s[..., None, :, None])[..., 0]  # values and slopes, (..., N, 2)
        H = np.zeros((*x.shape[:-1], self.n_sensors, x.shape[-1]))
        H[..., 0] = j * expected[..., 1]
        H[..., -self.dim_source :] = taps[..., 0, :]
        return expected[..., 0], H, self.noise_ratio + np.maximum(error, 0.0)


@lru_cache(maxsize=64)
def _interpolator(source: SourceCorrelation, offsets: tuple[int, ...]) -> DelayInterpolator:
    loading = 1e-4 if source.order is None else 1e-9
    return DelayInterpolator(source, offsets, loading)


@dataclass(frozen=True)
class Phasor(SourceAtCentre):
    """A line of sensors that receives one tone; its quadratures at the centre are in the state.

    s(k - t) = u cos Ωt + v sin Ωt, and (u, v) turn by Ω per snapshot: what `DelayLine` is for one
    tone, in closed form.

    Parameters
    ----------
    n_sensors : int
        Number of sensors.
    noise_ratio : float
        ε, noise power over source power.
    frequency : float
        Cycles per sample.
    process_noise : float
        Variance gained by u and by v at every snapshot.

    Notes
    -----
    Shapes: states (..., dim_x), measurements (..., n_sensors). Units: samples.

    Examples
    --------
    >>> Phasor(3, 0.1, frequency=0.25).h([0.5, 1.0, 0.0]).round(3)
    array([0.707, 1.   , 0.707])
    """

    frequency: float
    process_noise: float = 1e-2

    def __post_init__(self) -> None:
        count("n_sensors", self.n_sensors, minimum=2, maximum=10_000)
        positive("noise_ratio", self.noise_ratio)
        positive("process_noise", self.process_noise)
        if not 0 < number("frequency", self.frequency) < 0.5:
            raise ValueError(
                "frequency must lie above 0 and below half the sampling rate, 0.5 cycles per "
                f"sample; got {self.frequency}"
            )

    @property
    def omega(self) -> float:
        """Ω, rad per sample."""
        return 2 * np.pi * self.frequency

    @property
    def dim_source(self) -> int:
        """The two quadratures."""
        return 2

    @property
    def source_names(self) -> tuple[str, ...]:
        """amplitude_re, amplitude_im: u and v."""
        return "amplitude_re", "amplitude_im"

    @property
    def transition(self) -> Float:
        """Rotation by Ω."""
        cos, sin = np.cos(self.omega), np.sin(self.omega)
        return np.array([[cos, -sin], [sin, cos]])

    @property
    def innovation(self) -> Float:
        """Process noise of both quadratures."""
        return self.process_noise * np.eye(2)

    @property
    def covariance(self) -> Float:
        """1 for each: a tone of power 1 and unknown phase."""
        return np.eye(2)

    def linearise(self, x: Float) -> tuple[Float, Float, Float]:
        """Return h (..., N), H (..., N, dim_x) and the variances R_j (..., N) at states."""
        u, v = x[..., -2, None], x[..., -1, None]
        step = self.omega * self.centred
        alpha = step * x[..., :1]
        cos, sin = np.cos(alpha), np.sin(alpha)
        H = np.zeros((*alpha.shape, x.shape[-1]))
        H[..., 0] = step * (v * cos - u * sin)
        H[..., -2], H[..., -1] = cos, sin
        return u * cos + v * sin, H, np.full(alpha.shape, self.noise_ratio)
