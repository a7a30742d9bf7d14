"""Levels of the channels: rms, offset, clipping, silence, hum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.recordings.check.segments import Rows
from arrivals.recordings.choice.limits import power_of_two
from arrivals.typing import Bool, Float

MAX_NUMBERS = 2**21  # samples that are read: 16 MB
SHORT_NUMBERS = 2**18  # of a short check
N_BLOCKS = 64  # into which they are divided in a longer recording
MIN_LEVELS = 32  # quantization steps of a peak below which tops are flat without clipping
MIN_DROP = 3.0  # quantization steps beside a flat top; a smooth crest has 2 at most
MAINS_HZ = (50.0, 60.0)
N_HARMONICS, MAINS_TOLERANCE_HZ = 8, 0.5
HUM_WINDOW_S = 1.0
LINE_RATIO = 10.0  # of a line to the median of its surroundings
NEIGHBOURHOOD_HZ = 12.0


@dataclass(frozen=True, eq=False)
class ChannelLevels:
    """Levels of the channels of a recording, from blocks spread over it.

    Parameters
    ----------
    rms : ndarray, shape (n_channels,)
        Root of the mean square; of real samples, without the offset.
    offset : ndarray, shape (n_channels,)
        Absolute value of the mean of complex samples, mean of real ones.
    clipped : ndarray, shape (n_channels,)
        Share of samples in flat tops at the extremes of the channel.
    peak : ndarray, shape (n_channels,)
        Largest absolute value.
    missing : ndarray, shape (n_channels,)
        Share of missing samples.
    twin : ndarray of int, shape (n_channels,)
        First channel with exactly the same samples; the channel itself if there is none.

    Examples
    --------
    >>> t = np.arange(1000) / 1000
    >>> tone = np.sin(2 * np.pi * 50.3 * t)
    >>> levels = ChannelLevels.of(np.stack([tone, np.clip(2 * tone, -1, 1)], axis=1)[None])
    >>> levels.rms.round(2), levels.clipped.round(2)
    (array([0.71, 0.88]), array([0.  , 0.67]))
    """

    rms: Float
    offset: Float
    clipped: Float
    peak: Float
    missing: Float
    twin: Float

    @classmethod
    def of(cls, blocks: Float) -> ChannelLevels:
        """Return the levels of blocks (n_blocks, n_rows, n_channels), real or complex."""
        flat = blocks.reshape(-1, blocks.shape[-1])
        valid = np.isfinite(flat)
        n = np.maximum(valid.sum(axis=0), 1)
        x = np.where(valid, flat, 0) if not valid.all() else flat
        offset = x.sum(axis=0, dtype=np.result_type(x, np.float64)) / n
        size, is_real = np.abs(x), not np.iscomplexobj(x)
        peak = size.max(axis=0)
        power = (size**2).sum(axis=0, dtype=np.float64) / n - is_real * np.abs(offset) ** 2
        rms = np.sqrt(np.maximum(power, 0.0))
        rms[rms <= 1e-7 * peak] = 0.0  # rounding of a constant
        clipped = clipped_share(blocks) if is_real else np.zeros(len(peak))
        return cls(rms, offset.real if is_real else np.abs(offset), clipped, peak.astype(float),
                   1 - valid.mean(axis=0), _twins(x, rms))  # fmt: skip


def level_blocks(rows: Rows, n_rows: int, most: int = MAX_NUMBERS) -> Float:
    """Return blocks (n_blocks, n_rows, n_channels) spread over a recording, or all of a short one.

    Examples
    --------
    >>> level_blocks(lambda a, b: np.zeros((b - a, 2)), 10).shape
    (1, 10, 2)
    """
    n_channels = rows(0, 1).shape[1]
    if n_rows * n_channels <= most:
        return np.asarray(rows(0, n_rows))[None]
    length = max(1, most // (N_BLOCKS * n_channels))
    starts = np.linspace(0, n_rows - length, N_BLOCKS).astype(int)
    return np.stack([rows(start, start + length) for start in starts])


def clipped_share(blocks: Float) -> Float:
    """Return the share of samples in flat tops: runs of equal samples at a channel's extremes.

    Crests of smooth waves, quantized, are flat too; beside them samples are at most two steps of
    the quantization lower.

    Parameters
    ----------
    blocks : ndarray, shape (n_blocks, n_rows, n_channels)
        Real samples.

    Returns
    -------
    ndarray, shape (n_channels,)

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal((1, 10000, 1))
    >>> clipped_share(noise), clipped_share(np.clip(noise, -1, 1)).round(1)
    (array([0.]), array([0.3]))
    """
    if blocks.shape[1] < 4:
        return np.zeros(blocks.shape[2])
    share = np.zeros(blocks.shape[2])
    step = _quantization(blocks)
    for sign in (1, -1):
        x = sign * blocks
        top = np.nanmax(x, axis=(0, 1))
        at_top = x >= top
        run = at_top[:, 1:-2] & at_top[:, 2:-1]  # two equal samples
        first = run & ~at_top[:, :-3]
        drop = np.where(first, top - x[:, :-3], 0.0).sum(axis=(0, 1))
        n_runs = first.sum(axis=(0, 1))
        is_steep = drop > MIN_DROP * step * n_runs
        is_fine = top >= MIN_LEVELS * step
        share += np.where(is_steep & is_fine & (n_runs >= 3), at_top.mean(axis=(0, 1)), 0.0)
    return share


def _quantization(blocks: Float) -> Float:
    """Return the smallest difference of successive samples that differ, (n_channels,)."""
    steps = np.abs(np.diff(blocks, axis=1))
    smallest = np.where(steps > 0, steps, np.inf).min(axis=(0, 1))
    return np.where(np.isfinite(smallest), smallest, 0.0)


def _twins(x: Float, rms: Float) -> Float:
    first: dict[bytes, int] = {}
    return np.array([
        first.setdefault(np.ascontiguousarray(x[:, m]).tobytes(), m) if rms[m] else m
        for m in range(x.shape[1])
    ])  # fmt: skip


def hum_share(blocks: Float, rate: float) -> tuple[Float, Float]:
    """Return the power of mains hum, and its share in the power of each channel.

    Hum are lines at 50 or 60 Hz and two of their next seven multiples at least, present most of
    the time; whichever has more power.

    Parameters
    ----------
    blocks : ndarray, shape (n_blocks, n_rows, n_channels)
        Real samples.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    power, share : ndarray, shape (n_channels,)
        Zero where there is none, and if the rate or the length is too low.

    Examples
    --------
    >>> t = np.arange(8000)[None, :, None] / 1000
    >>> hum = sum(np.cos(2 * np.pi * 50 * k * t) for k in (1, 2, 3))
    >>> hum_share(hum + 0.1 * np.random.default_rng(0).standard_normal(t.shape), 1000.0)[1].round(1)
    array([1.])
    """
    n, n_channels = power_of_two(HUM_WINDOW_S * rate), blocks.shape[2]
    none = np.zeros(n_channels), np.zeros(n_channels)
    if blocks.shape[1] < n or rate < 8 * MAINS_HZ[0]:
        return none
    frames = np.lib.stride_tricks.sliding_window_view(blocks, n, axis=1)[:, ::n]
    frames = frames.reshape(-1, n_channels, n)[:64]
    frames = np.nan_to_num(frames - np.nanmean(frames, axis=-1, keepdims=True))
    spectrum = np.abs(np.fft.rfft(frames * np.hanning(n), axis=-1)) ** 2
    total = np.maximum(spectrum.mean(axis=0).sum(axis=-1), 1e-300)
    steady = np.median(spectrum, axis=0)  # (n_channels, n_bins)
    best = np.max([_lines(steady, mains * n / rate, rate / n) for mains in MAINS_HZ], axis=0)
    return best / total * (np.nanvar(blocks, axis=(0, 1))), best / total


def _lines(steady: Float, fundamental: float, resolution: float) -> Float:
    """Return the power of the lines at multiples of a frequency, in bins."""
    power, found = np.zeros(len(steady)), []
    reach = int(NEIGHBOURHOOD_HZ / resolution)
    for harmonic in range(1, N_HARMONICS + 1):
        centre = round(harmonic * fundamental)
        wide = steady[:, max(0, centre - reach) : centre + reach + 1]
        line = steady[:, max(0, centre - 2) : centre + 3]
        if centre + reach >= steady.shape[1]:
            break
        off = np.abs(line.argmax(axis=1) + centre - 2 - harmonic * fundamental) * resolution
        is_line = line.max(axis=1) > LINE_RATIO * np.median(wide, axis=1)
        is_line &= off <= harmonic * MAINS_TOLERANCE_HZ + resolution
        found.append(is_line)
        power += np.where(is_line, line.sum(axis=1), 0.0)
    if len(found) < 3:
        return np.zeros(len(steady))
    lines: Bool = np.array(found)
    return np.where(lines[0] & (lines.sum(axis=0) >= 3), power, 0.0)
