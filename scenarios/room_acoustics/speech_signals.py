"""Speech-like wideband signals with pauses, and their activity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from arrivals.typing import Bool, Float
from arrivals.validation import count, positive

RATE = 16000.0  # Hz, of the signals
LEVEL = 1e-2  # of the mean power outside zeros, -20 dB: activity
SMOOTHING = 0.032  # s, of the power
VOWELS = ((730, 1090, 2440), (270, 2290, 3010), (300, 870, 2240), (530, 1840, 2480),
          (570, 840, 2410), (660, 1720, 2410))  # fmt: skip  # formants, Hz
Utterance = Callable[[int, np.random.Generator], Float]


def speech_like(
    n_samples: int, rng: np.random.Generator, *, pitch: float = 120.0, tract: float = 1.0
) -> Float:
    """Draw an utterance: syllables of a noisy part and a voiced part with formants, up to 8 kHz.

    Parameters
    ----------
    n_samples : int
        Number of samples, at 16 kHz.
    rng : numpy.random.Generator
        Source of random numbers.
    pitch : float
        Mean pitch, Hz.
    tract : float
        Formants relative to those of a grown man, 0.9 to 1.2.

    Returns
    -------
    ndarray, shape (n_samples,)
        Signal of power 1.

    Examples
    --------
    >>> x = speech_like(16000, np.random.default_rng(0))
    >>> x.shape, round(float(np.mean(x**2)), 6)
    ((16000,), 1.0)
    """
    pieces: list[Float] = []
    while sum(map(len, pieces)) < count("n_samples", n_samples):
        if rng.random() < 0.7:
            pieces.append(_consonant(int(RATE * rng.uniform(0.04, 0.1)), rng))
        formants = tract * np.array([*VOWELS[rng.integers(len(VOWELS))], 3500.0, 4800.0, 6500.0])
        glide = pitch * rng.uniform(0.85, 1.15) * np.array([1.0, rng.uniform(0.85, 1.1)])
        pieces.append(_vowel(int(RATE * rng.uniform(0.08, 0.2)), glide, formants, rng))
    signal = np.concatenate(pieces)[:n_samples]
    return np.asarray(signal / np.sqrt(np.mean(signal**2)))


def _vowel(n: int, pitch: Float, formants: Float, rng: np.random.Generator) -> Float:
    """Return pulses of a gliding pitch, with some noise, through resonances at the formants."""
    from scipy.signal import lfilter

    phase = np.cumsum(np.linspace(pitch[0], pitch[1], n)) / RATE
    pulses = np.diff(np.floor(phase), prepend=0.0) + 0.05 * rng.standard_normal(n)
    x = lfilter([1.0], [1.0, -0.9], pulses)
    for f in formants:
        radius = np.exp(-np.pi * (60 + 0.04 * f) / RATE)  # bandwidth 60 Hz + 4 %
        a1, a2 = -2 * radius * np.cos(2 * np.pi * f / RATE), radius**2
        x = lfilter([1 + a1 + a2], [1.0, a1, a2], x)  # gain 1 at 0 Hz
    x = np.hanning(n) ** 0.5 * np.diff(x, prepend=0.0)  # radiation
    return np.asarray(x / np.sqrt(np.mean(x**2)) * 10 ** (rng.uniform(-3, 3) / 20))


def _consonant(n: int, rng: np.random.Generator) -> Float:
    """Return a burst of noise with most power above 2 to 4 kHz, 5 to 15 dB below the vowels."""
    from scipy.signal import butter, sosfilt

    sos = butter(2, rng.uniform(2000, 4000), "high", fs=RATE, output="sos")
    x = np.hanning(n) * sosfilt(sos, rng.standard_normal(n))
    return np.asarray(x / np.sqrt(np.mean(x**2)) * 10 ** (rng.uniform(-15, -5) / 20))


def utterances(n_samples: int, start: float, utter: Utterance, rng: np.random.Generator) -> Float:
    """Draw utterances of 1.5 to 3 s, with pauses of 0.7 to 1.6 s, from `start`, s, on.

    Examples
    --------
    >>> x = utterances(64000, 0.5, speech_like, np.random.default_rng(0))
    >>> x.shape, x[:8000].any(), x[8000:].any()
    ((64000,), np.False_, np.True_)
    """
    signal = np.zeros(n_samples)
    at = int(start * RATE)
    while at < n_samples:
        piece = utter(int(RATE * rng.uniform(1.5, 3.0)), rng)[: n_samples - at]
        signal[at : at + len(piece)] = piece
        at += len(piece) + int(RATE * rng.uniform(0.7, 1.6))
    return signal


def activity(signal: Float, rate: float = RATE) -> Bool:
    """Return True where the power, smoothed over 32 ms, is within 20 dB of the signal's mean.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,)
        Signal of one source; zeros do not count for its mean power.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        Activity.

    Examples
    --------
    >>> x = np.concatenate([np.zeros(1000), np.ones(1000), np.zeros(1000)])
    >>> activity(x).nonzero()[0][[0, -1]]
    array([ 750, 2250])
    """
    n = int(SMOOTHING * positive("rate", rate))
    power = np.convolve(signal**2, np.ones(n) / n, "same")
    loud = signal[signal != 0]
    return np.asarray(power > (LEVEL * np.mean(loud**2) if loud.size else 0.0))
