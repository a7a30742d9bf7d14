"""Mean spectrum of a recording, and the lines that stand out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from arrivals.recordings.narrowband import WindowedSpectrum
from arrivals.recordings.stored_samples import StoredSamples
from arrivals.typing import Float

LONGEST, MOST_WINDOWS, MOST_CHANNELS = 4096, 256, 8
LINE_DB = 12.0  # least height of a line over the smoothed spectrum
LINE_SHARE = 0.25  # least share of the lines in the power of the band
BURST_RATIO = 3.0  # least, of mean to median power; that of noise is 1 / ln 2 = 1.44
BURST_SHARE = 0.01  # most that sounds that come and go may have of the power
MOST_LINES = 16
SMOOTHING = 41  # bins of the running median


@dataclass(frozen=True, eq=False)
class MeanSpectrum:
    """Power of each frequency over time, averaged over the channels.

    Parameters
    ----------
    frequency : ndarray, shape (n_bins,)
        Hz, evenly spaced.
    power : ndarray, shape (n_bins,)
        Mean square of the amplitudes.
    steady : ndarray, shape (n_bins,)
        Median over time, which a sound of less than half of the time does not raise.

    Examples
    --------
    >>> t = np.arange(8000) / 1000
    >>> noise = 0.1 * np.random.default_rng(0).standard_normal((8000, 2))
    >>> x = np.cos(2 * np.pi * 123.4 * t)[:, None] + noise
    >>> MeanSpectrum.of(x, rate=1000.0).lines(10.0, 450.0).round(1)
    array([123.4])
    """

    frequency: Float
    power: Float
    steady: Float

    @classmethod
    def of(cls, samples: ArrayLike | StoredSamples, rate: float) -> MeanSpectrum:
        """Return the spectrum of at most 256 windows of at most 8 channels.

        Parameters
        ----------
        samples : array_like or StoredSamples, shape (n_samples, n_channels)
            Real samples, of which only the windows are loaded.
        rate : float
            Samples per second, Hz.

        Returns
        -------
        MeanSpectrum
            Empty for less than 16 samples.
        """
        x = samples if isinstance(samples, StoredSamples) else np.asarray(samples)
        n = 2 ** int(np.log2(max(16, min(LONGEST, len(x) // 8))))
        if len(x) < n:
            return cls.empty()
        hop = max(n // 2, len(x) // MOST_WINDOWS)
        channels = np.unique(np.linspace(0, x.shape[1] - 1, MOST_CHANNELS).astype(int))
        frequency = np.arange(1, n // 2) * rate / n
        spectrum = WindowedSpectrum(rate, frequency.tolist(), n)
        powers = []
        for i in range(0, len(x) - n + 1, hop):
            y = spectrum.amplitudes(x[i : i + n][:, channels], n, i)[0]  # (n_bins, n_channels)
            valid = ~np.isnan(y)
            if valid.any():
                powers.append(np.where(valid, y.real**2 + y.imag**2, 0.0).sum(axis=1))
        power = np.array(powers) / max(1, len(channels))  # (n_windows, n_bins)
        if not len(power):
            return cls.empty()
        return cls(frequency, np.asarray(power.mean(axis=0)), np.asarray(np.median(power, axis=0)))

    @classmethod
    def empty(cls) -> MeanSpectrum:
        """Return a spectrum without frequencies, and so without lines."""
        return cls(*np.zeros((3, 0)))

    def snr_db(self, frequencies: ArrayLike, low: float, high: float) -> float:
        """Return the mean power at frequencies over the floor, 10 to 20 dB.

        The floor is the lowest decile of the spectrum between two limits.
        """
        power = self.power[(self.frequency >= low) & (self.frequency <= high)]
        if not power.any():
            return 20.0
        floor = max(float(np.quantile(power, 0.1)), 1e-30 * float(power.max()))
        at = np.argmin(np.abs(self.frequency[:, None] - np.asarray(frequencies)), axis=0)
        return round(float(np.clip(10 * np.log10(self.power[at].mean() / floor), 10.0, 20.0)), 1)

    def lines(self, low: float, high: float) -> Float:
        """Return the frequencies, Hz, of lines between two limits, at most 16, in ascending order.

        A line is a peak of the steady spectrum, 12 dB over its running median. There is none
        unless they have together a quarter of the mean power between the limits, nor if more than
        1 % of it comes and goes between the lines, as speech over a machine does.
        """
        from scipy.ndimage import median_filter

        inside = (self.frequency >= low) & (self.frequency <= high)
        if not inside.any() or not self.steady[inside].any():
            return np.zeros(0)
        level = 10 * np.log10(np.maximum(self.steady, 1e-30 * self.steady.max()))
        excess = level - median_filter(level, size=min(SMOOTHING, len(level)), mode="nearest")
        raised = inside & (excess >= LINE_DB)
        total, between = self.power[inside].sum(), inside & ~raised
        bursts = (self.power[between] - BURST_RATIO * self.steady[between]).sum()
        if self.power[raised].sum() < LINE_SHARE * total or bursts > BURST_SHARE * total:
            return np.zeros(0)
        neighbours = np.pad(level, 2, constant_values=-np.inf)
        highest = np.max([neighbours[i : i + len(level)] for i in (0, 1, 3, 4)], axis=0)
        peaks = np.flatnonzero(raised & (level > highest))
        peaks = np.sort(peaks[np.argsort(-excess[peaks])][:MOST_LINES])
        left, middle, right = (neighbours[peaks + i] for i in (1, 2, 3))
        curvature = left - 2 * middle + right  # of the parabola through three levels
        shift = np.where(np.isfinite(curvature), 0.5 * (left - right) / curvature, 0.0)
        return np.asarray(self.frequency[peaks] + shift * (self.frequency[1] - self.frequency[0]))
