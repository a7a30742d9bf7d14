"""What an array has recorded, and its narrowband snapshots at one frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arrivals.measurement_models import SensorArray
from arrivals.typing import Complex, Float
from arrivals.validation import count, positive, shaped

Samples: TypeAlias = NDArray[np.floating[Any] | np.complexfloating[Any, Any]]

BLOCK = 2**21  # complex numbers that one call of the STFT may return: 32 MB


def default_window(rate: float, frequency: float) -> int:
    """Return a length of window, in samples, that suits a frequency in Hz.

    The next power of two that holds 256 samples and eight periods.

    Examples
    --------
    >>> default_window(48000.0, 5000.0), default_window(48000.0, 100.0)
    (256, 4096)
    """
    return int(2 ** math.ceil(math.log2(max(256.0, 8 * rate / frequency))))


def narrowband(
    samples: ArrayLike,
    rate: float,
    frequency: float,
    window: int,
    hop: int,
    first_sample: int = 0,
) -> Complex:
    """Find the complex amplitude of every channel at one frequency, window by window.

    With the Hann window w, which begins at the samples s = 0, hop, 2 hop, ... of the block:

        y(s) = 2 / Σ w(k) · Σ w(k) x(s + k) exp(-j 2π f (first_sample + s + k) / rate)

    Parameters
    ----------
    samples : array_like, shape (n_samples, n_channels)
        Real samples; one that is NaN or infinite spoils its own channel and window only.
    rate : float
        Samples per second, Hz.
    frequency : float
        Between 0 and rate / 2, Hz. It need not fall on a bin.
    window, hop : int
        Length of a window and the way from one to the next, in samples.
    first_sample : int
        Index of the first row of `samples` in a stream, to which all phases refer.

    Returns
    -------
    ndarray, shape (n_steps, n_channels)
        Snapshots, of the windows that lie fully inside; there may be none. The channel
        A cos(2π f t + φ) gives A exp(jφ) in every window: the sign is that of `numpy.fft`, and a
        channel that lags by τ has its phase lowered by 2π f τ.

    Raises
    ------
    ValueError
        If a number is out of range or `samples` is not two-dimensional.
    TypeError
        If samples are not real numbers.

    Notes
    -----
    A stream gives the same numbers chunk by chunk: of each chunk, n_steps · hop samples are used
    up, and the rest goes in front of the next. Tones less than two bins (2 rate / window) away
    from 0 or rate / 2 overlap with their own image. Long blocks are worked off piece by piece.

    Examples
    --------
    >>> t = np.arange(3000) / 1000
    >>> y = narrowband(3 * np.cos(2 * np.pi * 123.4 * t + 0.5)[:, None], 1000, 123.4, 1000, 1000)
    >>> np.abs(y[:, 0]).round(3), np.angle(y[:, 0]).round(3)
    (array([3., 3., 3.]), array([0.5, 0.5, 0.5]))
    """
    from scipy.signal import ShortTimeFFT
    from scipy.signal.windows import hann

    samples = np.asarray(samples)
    if samples.ndim != 2 or samples.dtype.kind not in "iuf":
        got = f"{samples.dtype} of shape {samples.shape}"
        kind = ValueError if samples.ndim != 2 else TypeError
        raise kind(f"samples must be real numbers of shape (n_samples, n_channels); got {got}")
    frequency = _below_nyquist(frequency, positive("rate", rate))
    window, hop = count("window", window, 2), count("hop", hop)
    n_steps = max(0, (len(samples) - window) // hop + 1)
    cycles = (count("first_sample", first_sample, 0) + hop * np.arange(n_steps)) * frequency / rate

    taper = hann(window, sym=False)
    tone = taper * np.exp(2j * np.pi * frequency / rate * np.arange(window))
    stft = ShortTimeFFT(tone, hop, rate, fft_mode="twosided", phase_shift=None)
    y = np.empty((n_steps, samples.shape[1]), complex)
    n_block = max(1, BLOCK // (max(window, hop) * max(1, samples.shape[1])))
    for i in range(0, n_steps, n_block):
        n = min(n_block, n_steps - i)
        with np.errstate(invalid="ignore"):  # signalling NaN, in bytes that are no floats
            block = samples[i * hop : (i + n - 1) * hop + window].astype(np.float64)
        block[np.isinf(block)] = np.nan
        y[i : i + n] = stft.stft(block, 0, n, k_offset=stft.m_num_mid, axis=0)[0].T
    return np.asarray(y * (2 / taper.sum() * np.exp(-2j * np.pi * (cycles % 1)))[:, None])


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Narrowband snapshots over time.

    Parameters
    ----------
    values : ndarray, shape (n_steps, n_channels)
        Complex amplitudes; NaN where a channel is missing.
    time : ndarray, shape (n_steps,)
        Centres of the windows in s, from the first sample; NaN where the time is not known.
    frequency : float or None
        In Hz; None if it is not known.
    """

    values: Complex
    time: Float
    frequency: float | None


@dataclass(frozen=True, eq=False)
class Recording:
    """What the channels of an array recorded: real samples, or complex snapshots.

    Parameters
    ----------
    samples : array_like, shape (n_samples, n_channels)
        Real samples, kept as float32 if they are, else as float64; or complex ones (complex128),
        each row of which is a narrowband snapshot already. One channel may come as (n_samples,).
        Infinite samples become NaN, which means missing.
    rate : float, optional
        Rows per second, Hz.
    time : array_like, shape (n_samples,), optional
        Time of each snapshot in s; only for complex ones.
    array : SensorArray, optional
        The sensors whose channels these are, in its order.

    Raises
    ------
    ValueError
        If there is nothing finite, a shape does not fit, or `rate` is not positive.
    TypeError
        If samples are not numbers.

    Examples
    --------
    >>> t = np.arange(1000) / 1000
    >>> tone = np.cos(2 * np.pi * 100 * t)
    >>> recording = Recording(np.stack([tone, 2 * tone], axis=1), rate=1000.0)
    >>> recording.n_channels, recording.duration
    (2, 1.0)
    >>> y = recording.snapshots(100.0, window=500)
    >>> y.values.real.round(6), y.time
    (array([[1., 2.],
           [1., 2.]]), array([0.25, 0.75]))
    """

    samples: Samples
    rate: float | None = None
    time: Float | None = None
    array: SensorArray | None = None

    def __post_init__(self) -> None:
        samples = _cleaned(np.asarray(self.samples))
        object.__setattr__(self, "samples", samples)
        if self.rate is not None:
            object.__setattr__(self, "rate", positive("rate", self.rate))
        if self.time is not None:
            if not self.is_narrowband:
                raise ValueError("time goes with complex snapshots; real samples have a rate")
            object.__setattr__(self, "time", shaped("time", self.time, len(samples)))
        if self.array is not None and self.array.n_sensors != samples.shape[1]:
            raise ValueError(
                f"the array has {self.array.n_sensors} sensors, the recording {samples.shape[1]} "
                "channels: pass array.select(samples)"
            )

    @property
    def is_narrowband(self) -> bool:
        """Whether the samples are complex snapshots already."""
        return bool(np.iscomplexobj(self.samples))

    @property
    def n_channels(self) -> int:
        """Number of channels."""
        return int(self.samples.shape[1])

    @property
    def duration(self) -> float:
        """Length in s; NaN if neither rate nor time is known."""
        if self.rate is not None:
            return len(self.samples) / self.rate
        return float(np.nan if self.time is None else self.time[-1] - self.time[0])

    def snapshots(
        self,
        frequency: float | None = None,
        *,
        window: int | None = None,
        hop: int | None = None,
        start: int = 0,
    ) -> Snapshots:
        """Return narrowband snapshots at one frequency.

        Parameters
        ----------
        frequency : float
            In Hz, below rate / 2. May be None where the recording holds complex snapshots, which
            are given as they are.
        window : int, optional
            Length of the Hann window in samples; `default_window` if None.
        hop : int, optional
            Samples from one window to the next. By default they do not overlap, so that the noise
            of two snapshots is independent.
        start : int
            Sample (or complex snapshot) to begin with. Phases and times refer to the first sample
            of the recording all the same.

        Returns
        -------
        Snapshots
            Values (n_steps, n_channels) as `narrowband` defines them, and times (n_steps,).

        Raises
        ------
        ValueError
            If the rate is not known, the frequency does not lie in (0, rate / 2), less than one
            window is left after `start`, or a window is asked of complex snapshots.
        """
        start = count("start", start, 0)
        if self.is_narrowband:
            if window is not None or hop is not None:
                raise ValueError("the recording holds complex snapshots: it takes no window or hop")
            if start >= len(self.samples):
                raise ValueError(f"start must be below {len(self.samples)}; got {start}")
            values = np.asarray(self.samples[start:], complex)
            return Snapshots(values, self._snapshot_times()[start:], frequency)
        if self.rate is None:
            raise ValueError("the recording has no rate, which a frequency needs: pass rate= in Hz")
        if frequency is None:
            raise ValueError("the recording holds real samples: pass a frequency in Hz")
        frequency = _below_nyquist(frequency, self.rate)
        window = window if window is not None else default_window(self.rate, frequency)
        hop = hop if hop is not None else window
        self._check_length(count("window", window, 2), start)
        values = narrowband(self.samples[start:], self.rate, frequency, window, hop, start)
        centres = start + hop * np.arange(len(values)) + window / 2
        return Snapshots(values, np.asarray(centres / self.rate, np.float64), frequency)

    def _snapshot_times(self) -> Float:
        if self.time is not None:
            return self.time
        return np.arange(len(self.samples)) / np.float64(self.rate or np.nan)

    def _check_length(self, window: int, start: int) -> None:
        n_samples, n_channels = self.samples.shape
        if n_samples - start < window:
            after = f" after sample {start}" if start else ""
            rows = " (if its rows are channels, transpose it)" if n_samples < n_channels else ""
            raise ValueError(
                f"the recording has {max(0, n_samples - start)} samples{after}{rows}; "
                f"one window takes {window}: pass a shorter window="
            )


def _below_nyquist(frequency: float, rate: float) -> float:
    if positive("frequency", frequency) >= rate / 2:
        raise ValueError(
            f"frequency must lie below half the rate, {rate / 2:g} Hz; got {frequency:g} Hz"
        )
    return float(frequency)


def _cleaned(samples: NDArray[Any]) -> Samples:
    """Return samples (n_samples, n_channels) of one of our types, NaN where not finite."""
    if samples.dtype.kind not in "iufc":
        raise TypeError(f"samples must be numbers; got {samples.dtype}")
    if samples.ndim not in (1, 2):
        raise ValueError(f"samples must have shape (n_samples, n_channels); got {samples.shape}")
    if samples.size == 0:
        raise ValueError(f"the recording is empty; its shape is {samples.shape}")
    single = samples.dtype.kind == "f" and samples.dtype.itemsize == 4
    kind: Any = np.complex128 if samples.dtype.kind == "c" else np.float32 if single else np.float64
    cleaned: NDArray[Any] = samples.reshape(len(samples), -1).astype(kind, copy=False)
    finite = np.isfinite(cleaned)
    if not finite.any():
        raise ValueError("no sample of the recording is finite")
    return cleaned if finite.all() else np.where(finite, cleaned, kind(np.nan))
