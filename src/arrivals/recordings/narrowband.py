"""Complex amplitudes of channels at one frequency, window by window."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Complex
from arrivals.validation import count, positive

MAX_WINDOW = 2**30  # samples
MAX_BLOCK = 2**21  # complex numbers of one result of the STFT: 32 MB


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
    from scipy.signal import ShortTimeFFT
    from scipy.signal.windows import hann

    samples = np.asarray(samples)
    if samples.ndim != 2 or samples.dtype.kind not in "iuf":
        got = f"{samples.dtype} of shape {samples.shape}"
        kind = ValueError if samples.ndim != 2 else TypeError
        raise kind(f"samples must be real numbers of shape (n_samples, n_channels); got {got}")
    frequency = check_frequency(frequency, positive("rate", rate))
    window, hop = count("window", window, 2), count("hop", hop)
    n_steps = max(0, (len(samples) - window) // hop + 1)
    cycles = (count("first_sample", first_sample, 0) + hop * np.arange(n_steps)) * frequency / rate

    taper = hann(window, sym=False)
    tone = taper * np.exp(2j * np.pi * frequency / rate * np.arange(window))
    stft = ShortTimeFFT(tone, hop, rate, fft_mode="twosided", phase_shift=None)
    y = np.empty((n_steps, samples.shape[1]), complex)
    n_block = max(1, MAX_BLOCK // (max(window, hop) * max(1, samples.shape[1])))
    for i in range(0, n_steps, n_block):
        n = min(n_block, n_steps - i)
        with np.errstate(invalid="ignore"):  # signalling NaN
            block = samples[i * hop : (i + n - 1) * hop + window].astype(np.float64)
        block[np.isinf(block)] = np.nan
        y[i : i + n] = stft.stft(block, 0, n, k_offset=stft.m_num_mid, axis=0)[0].T
    return np.asarray(y * (2 / taper.sum() * np.exp(-2j * np.pi * (cycles % 1)))[:, None])


def check_frequency(frequency: float, rate: float) -> float:
    """Return a frequency between 0 and half the rate, Hz."""
    if positive("frequency", frequency) >= rate / 2:
        raise ValueError(
            f"frequency must lie below half the rate, {rate / 2:g} Hz; got {frequency:g} Hz"
        )
    return float(frequency)
