"""Complex amplitudes of channels at one frequency or several, window by window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import count, positive

MAX_WINDOW = 2**30  # samples
MAX_BLOCK = 2**21  # numbers of the windows, or of the tones, that are processed together: 16 MB
CACHED_BLOCK = 2**17  # numbers of windows that remain in the processor's cache: 1 MB
MIN_BINS = 8  # of one FFT; fewer take less time by products
MIN_SPAN = 8  # windows without overlap in a block: the samples of one are read twice


def default_window(rate: float, frequency: float) -> int:
    """Return the default window length at a frequency.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    frequency : float
        Frequency, Hz.

    Returns
    -------
    int
        The smallest power of two of at least 256 samples and eight periods.

    Examples
    --------
    >>> default_window(48000.0, 5000.0), default_window(48000.0, 100.0)
    (256, 4096)
    """
    eight_periods = 8 * positive("rate", rate) / positive("frequency", frequency)
    if eight_periods > MAX_WINDOW:
        most = f"{MAX_WINDOW / 8:.3g} times the frequency, {frequency:g} Hz"
        raise ValueError(f"rate must be at most {most}; got {rate:g} Hz")
    return int(2 ** math.ceil(math.log2(max(256.0, eight_periods))))


def narrowband(
    samples: ArrayLike,
    rate: float,
    frequency: float,
    window: int,
    hop: int,
    first_sample: int = 0,
) -> Complex:
    """Return the complex amplitude of every channel at one frequency, window by window.

    With the Hann window w at the samples s = 0, hop, 2 hop, ... of the block:

        y(s) = 2 / Σ w(k) · Σ w(k) x(s + k) exp(-j 2π f (first_sample + s + k) / rate)

    Parameters
    ----------
    samples : array_like, shape (n_samples, n_channels)
        Real samples; NaN or infinite ones make their own channel and window NaN.
    rate : float
        Samples per second, Hz.
    frequency : float
        Between 0 and rate / 2, Hz. It need not fall on a bin.
    window, hop : int
        Length of a window and distance between windows, samples.
    first_sample : int
        Index of the first row of `samples` in the stream; phases refer to sample 0.

    Returns
    -------
    ndarray, shape (n_steps, n_channels)
        Snapshots of the windows that lie fully inside. The channel A cos(2π f t + φ) has the
        amplitude A exp(jφ) in every window: the sign is that of `numpy.fft`, and a delay by τ
        lowers the phase by 2π f τ.

    Raises
    ------
    ValueError
        If a number is out of range or `samples` is not two-dimensional.
    TypeError
        If samples are not real numbers.

    Notes
    -----
    Chunks of a stream have the same results: each chunk consumes n_steps · hop samples, and the
    remainder precedes the next chunk. Tones less than two bins (2 rate / window) from 0 or
    rate / 2 overlap with their own image. Long blocks are processed in pieces.

    Examples
    --------
    >>> t = np.arange(3000) / 1000
    >>> y = narrowband(3 * np.cos(2 * np.pi * 123.4 * t + 0.5)[:, None], 1000, 123.4, 1000, 1000)
    >>> np.abs(y[:, 0]).round(3), np.angle(y[:, 0]).round(3)
    (array([3., 3., 3.]), array([0.5, 0.5, 0.5]))
    """
    kernel = WindowedSpectrum(rate, (frequency,), window)
    return kernel.amplitudes(samples, hop, first_sample)[:, 0]


@dataclass(frozen=True)
class WindowedSpectrum:
    """Amplitudes at several frequencies in Hann windows of one length, as `narrowband` has them.

    Bins of the window, if several, come from one real FFT a window, other frequencies from one
    product of windows and tones. Windows are processed in blocks of bounded memory.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    frequencies : sequence of float
        Each between 0 and rate / 2, Hz.
    window : int
        Length of a window, samples.

    Examples
    --------
    >>> x = 3 * np.cos(2 * np.pi * 125 * np.arange(32) / 1000)[:, None]
    >>> np.abs(WindowedSpectrum(1000, (125.0, 250.0), 16).amplitudes(x, hop=16)[:, :, 0]).round(6)
    array([[3., 0.],
           [3., 0.]])
    """

    rate: float
    frequencies: Sequence[float]
    window: int

    def __post_init__(self) -> None:
        rate = positive("rate", self.rate)
        checked = tuple(check_frequency(each, rate) for each in self.frequencies)
        object.__setattr__(self, "frequencies", checked)
        count("window", self.window, 2)

    def amplitudes(self, samples: ArrayLike, hop: int, first_sample: int = 0) -> Complex:
        """Return the amplitudes of the windows that lie fully inside.

        Parameters
        ----------
        samples : array_like, shape (n_samples, n_channels)
            As in `narrowband`.
        hop : int
            Distance between windows, samples.
        first_sample : int
            As in `narrowband`.

        Returns
        -------
        ndarray, shape (n_windows, n_frequencies, n_channels)
        """
        samples = np.asarray(samples)
        if samples.ndim != 2 or samples.dtype.kind not in "iuf":
            got = f"{samples.dtype} of shape {samples.shape}"
            kind = ValueError if samples.ndim != 2 else TypeError
            raise kind(f"samples must be real numbers of shape (n_samples, n_channels); got {got}")
        hop, first_sample = count("hop", hop), count("first_sample", first_sample, 0)
        n_windows = max(0, (len(samples) - self.window) // hop + 1)
        y = np.empty((n_windows, len(self.frequencies), samples.shape[1]), complex)
        n_block = self._windows_of_block(hop, max(1, samples.shape[1]))
        for i in range(0, n_windows, n_block):
            n = min(n_block, n_windows - i)
            block = _finite(samples[i * hop : (i + n - 1) * hop + self.window])
            # 2 / Σ w(k) · Σ w(k) x(s + k) exp(-j 2π f k / rate)
            frames = self._taper * sliding_window_view(block, self.window, axis=1)[:, ::hop]
            self._transform(frames, y[i : i + n].transpose(2, 0, 1))
        # times exp(-j 2π f (first_sample + s) / rate)
        start = (first_sample + hop * np.arange(n_windows))[:, None]
        cycles = start * self._f / self.rate
        y *= np.exp(-2j * np.pi * (cycles % 1))[:, :, None]
        return y

    def _windows_of_block(self, hop: int, n_channels: int) -> int:
        """Return the number of windows that are processed together."""
        size = max(self.window, hop) * n_channels
        wanted = max(CACHED_BLOCK // size, MIN_SPAN * self.window // hop)
        return max(1, min(wanted, MAX_BLOCK // size))

    def _transform(self, frames: Float, out: Complex) -> None:
        """Write Σ x(k) exp(-j 2π f k / rate) of windows (..., window) to `out` (..., F)."""
        if self._is_bin.any():
            out[..., self._is_bin] = np.fft.rfft(frames)[..., self._bins]
        for i, group in enumerate(self._groups):
            tones = self._tones_at(group) if i else self._first_tones
            out[..., group] = (frames @ tones).view(complex)

    @cached_property
    def _f(self) -> Float:
        return np.array(self.frequencies)

    @cached_property
    def _taper(self) -> Float:
        """Hann window, 2 / Σ w(k) times."""
        w = 0.5 - 0.5 * np.cos(2 * np.pi / self.window * np.arange(self.window))
        return np.asarray(2 / w.sum() * w)

    @cached_property
    def _is_bin(self) -> Bool:
        """Where f window / rate is whole, but for rounding; nowhere if these are few."""
        k = self._f * self.window / self.rate
        is_bin = np.asarray(np.abs(k - np.round(k)) <= 2 * np.finfo(float).eps * k)
        return is_bin & (np.count_nonzero(is_bin) >= MIN_BINS)

    @cached_property
    def _bins(self) -> Int:
        return np.round(self._f[self._is_bin] * self.window / self.rate).astype(np.int64)

    @cached_property
    def _groups(self) -> list[Int]:
        """Indices of the frequencies between the bins, in groups whose tones fit into a block."""
        between, n = np.flatnonzero(~self._is_bin), max(1, MAX_BLOCK // (2 * self.window))
        return [between[i : i + n] for i in range(0, len(between), n)]

    @cached_property
    def _first_tones(self) -> Float:
        return self._tones_at(self._groups[0])

    def _tones_at(self, where: Int) -> Float:
        """Return cosine and sine tones, side by side: (window, 2 F)."""
        cycles = np.arange(self.window)[:, None] * self._f[where] / self.rate
        return np.asarray(np.exp(-2j * np.pi * (cycles % 1)).view(np.float64))


def _finite(samples: NDArray[Any]) -> Float:
    """Return samples as (n_channels, n_samples), NaN where infinite."""
    with np.errstate(invalid="ignore"):  # signalling NaN
        block = samples.T.astype(np.float64, order="C")
    block[np.isinf(block)] = np.nan
    return block


def check_frequency(frequency: float, rate: float) -> float:
    """Return a frequency between 0 and half the rate, Hz."""
    if positive("frequency", frequency) >= rate / 2:
        raise ValueError(
            f"frequency must lie below half the rate, {rate / 2:g} Hz; got {frequency:g} Hz"
        )
    return float(frequency)
