"""Phases of short segments of a recording, weighted by the coherence of the channels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.choice.limits import power_of_two
from arrivals.typing import Complex, Float, Int

N_WINDOWS = 4  # half-overlapping windows of a segment of real samples
N_ROWS = 8  # complex snapshots of a segment
MAX_NUMBERS = 2**21  # samples that are read: 16 MB
MAX_EXAMINED = 128  # segments that are read, spread over the recording
NOISE_COHERENCE = 0.47  # mean of a pair with independent noise, 4 windows; of 8 snapshots 0.31
NOISE_SPREAD = 0.9  # over the number of channels: four deviations of the mean over pairs
MIN_CELLS = 4.0  # least weight of a segment: fewer cells fit some direction by chance
MAX_PAIRS = 32
MIN_BANDWIDTH = 0.1  # deviation of the frequencies, of their mean: 0.3 or more for speech
LINE_BINS = 3  # neighbouring bins over which a tone extends
Rows = Callable[[int, int], NDArray[Any]]  # samples of the rows from the first to before the last


@dataclass(frozen=True, eq=False)
class PhaseSegments:
    """Phase factors of the channels, with one weight for each segment and frequency.

    Parameters
    ----------
    phasors : ndarray, shape (n_segments, n_bins, n_windows, n_channels)
        Factors of absolute value one; zero where a channel is missing.
    weight : ndarray, shape (n_segments, n_bins)
        0 for incoherent channels to 1 for coherent ones, whatever their delays and signs.
    frequency : ndarray, shape (n_bins,)
        Hz.
    window : int
        Samples of a window; 1 for complex snapshots.

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal((4000, 3))
    >>> segments = PhaseSegments.of_samples(lambda a, b: noise[a:b], 4000, 1000.0, 64)
    >>> segments.phasors.shape, bool(segments.weight.mean() < 0.2)
    ((49, 27, 4, 3), True)
    """

    phasors: Complex
    weight: Float
    frequency: Float
    window: int

    @classmethod
    def of_samples(
        cls, rows: Rows, n_rows: int, rate: float, window: int, most: int = MAX_EXAMINED
    ) -> PhaseSegments:
        """Return at most so many segments of real samples, at bins of 2 % to 45 % of the rate."""
        length = window * (N_WINDOWS + 1) // 2
        x = _spread(rows, n_rows, length, most).astype(np.float32)
        frames = np.lib.stride_tricks.sliding_window_view(x, window, axis=1)[:, :: window // 2]
        taper = np.hanning(window + 2)[1:-1].astype(np.float32)
        y = np.fft.rfft((frames - frames.mean(axis=-1, keepdims=True)) * taper, axis=-1)
        frequency: Float = np.fft.rfftfreq(window, 1 / rate).astype(np.float64)
        inside = (frequency >= 0.02 * rate) & (frequency <= 0.45 * rate)
        phasors = _phasors(np.moveaxis(y[..., inside], (1, 2, 3), (2, 3, 1)))
        return cls(phasors, coherence_weight(phasors), frequency[inside], window)

    @classmethod
    def of_snapshots(
        cls, rows: Rows, n_rows: int, frequency: float, most: int = MAX_EXAMINED
    ) -> PhaseSegments:
        """Return at most so many segments of complex snapshots of one frequency."""
        phasors = _phasors(_spread(rows, n_rows, N_ROWS, most)[:, None])
        return cls(phasors, coherence_weight(phasors), np.array([frequency]), 1)

    @property
    def n_channels(self) -> int:
        """Number of channels."""
        return int(self.phasors.shape[-1])

    @property
    def is_narrowband(self) -> bool:
        """True for phases of one frequency, or of a band so narrow that they have no delay."""
        weight = self.weight.sum(axis=0)
        total = max(float(weight.sum()), 1e-12)
        middle = float(weight @ self.frequency) / total
        variance = float(weight @ (self.frequency - middle) ** 2) / total
        return self.window == 1 or variance < (MIN_BANDWIDTH * middle) ** 2

    def lines(self, rate: float) -> Int:
        """Return the number of the line of each bin: of some neighbouring bins, as a tone has."""
        return np.asarray(np.round(self.frequency * self.window / rate)).astype(int) // LINE_BINS

    def n_lines(self, rate: float) -> float:
        """Return the effective number of lines: few for a recording of some tones."""
        weight = np.bincount(self.lines(rate), self.weight.sum(axis=0))
        return float(weight.sum() ** 2 / max(float((weight**2).sum()), 1e-12))

    def strongest(self, low: float, high: float, n_segments: int, n_bins: int) -> PhaseSegments:
        """Return the segments, and the bins between two frequencies, of the largest weights."""
        bins = np.flatnonzero((self.frequency >= low) & (self.frequency <= high))
        weight = self.weight[:, bins]
        by_bin = np.sort(np.argsort(-weight.sum(axis=0), kind="stable")[:n_bins])
        weight = weight[:, by_bin]
        least = 0.0 if self.window == 1 else MIN_CELLS
        order = np.argsort(-weight.sum(axis=1), kind="stable")[:n_segments]
        kept = np.sort(order[weight[order].sum(axis=1) > least])
        bins = bins[by_bin]
        phasors = self.phasors[kept][:, bins]
        return PhaseSegments(phasors, weight[kept], self.frequency[bins], self.window)

    def only(self, channels: Int) -> PhaseSegments:
        """Return the segments of some channels, with the same weights."""
        return PhaseSegments(self.phasors[..., channels], self.weight, self.frequency, self.window)

    def with_phasors(self, phasors: Complex) -> PhaseSegments:
        """Return the segments with other phase factors."""
        return PhaseSegments(phasors, self.weight, self.frequency, self.window)


def window_length(rate: float, lowest: float) -> int:
    """Return the length of a window: 64 ms, or six periods of the lowest frequency if longer.

    Examples
    --------
    >>> window_length(16000.0, 300.0), window_length(25.0, 1.0)
    (1024, 128)
    """
    return max(16, power_of_two(max(0.064, 6 / lowest) * rate))


def channel_pairs(n_channels: int) -> Int:
    """Return pairs of channels, (n_pairs, 2): all, or the nearest in order if they are many.

    Examples
    --------
    >>> channel_pairs(3).tolist()
    [[0, 1], [0, 2], [1, 2]]
    """
    if n_channels * (n_channels - 1) // 2 <= MAX_PAIRS:
        return np.array(list(combinations(range(n_channels), 2))).reshape(-1, 2)
    first = np.arange(n_channels)
    apart = range(1, 1 + max(1, MAX_PAIRS // n_channels))
    return np.concatenate([np.stack([first, (first + k) % n_channels], axis=1) for k in apart])


def coherence_weight(phasors: Complex) -> Float:
    """Return weights (n_segments, n_bins) of phase factors: mean coherence over that of noise.

    Examples
    --------
    >>> coherence_weight(np.ones((1, 1, 4, 3), complex))
    array([[1.]])
    """
    n_channels = phasors.shape[-1]
    one, other = channel_pairs(n_channels).T
    total = np.zeros(phasors.shape[:2])
    for i, j in zip(one, other, strict=True):
        product = np.einsum("tfn,tfn->tf", phasors[..., i], phasors[..., j].conj())
        total += np.abs(product) / phasors.shape[2]
    coherence, least = total / max(1, len(one)), NOISE_COHERENCE + NOISE_SPREAD / max(2, n_channels)
    return np.asarray(np.clip((coherence - least) / (1 - least), 0.0, 1.0))


def _spread(rows: Rows, n_rows: int, length: int, most: int) -> NDArray[Any]:
    """Return segments spread over a recording, (n_segments, length, n_channels)."""
    length = min(length, n_rows)
    numbers = length * rows(0, 1).shape[1]
    n = min(most, max(8, MAX_NUMBERS // numbers), 2 * n_rows // length - 1)
    starts = np.linspace(0, n_rows - length, n).astype(int)
    return np.stack([rows(start, start + length) for start in starts])


def _phasors(y: Complex) -> Complex:
    size = np.abs(y)
    valid = size > 0  # false for NaN
    return np.where(valid, y / np.where(valid, size, 1.0), 0.0).astype(np.complex64)
