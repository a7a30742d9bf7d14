"""Frames of several frequencies and windows per step, from recordings and streams."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from arrivals.recordings.narrowband import default_window
from arrivals.recordings.recording import Recording
from arrivals.recordings.stream import live_snapshots
from arrivals.typing import Complex, Float
from arrivals.validation import count


@dataclass(frozen=True, eq=False)
class FramedSnapshots:
    """Snapshots of each step.

    Parameters
    ----------
    values : ndarray, shape (n_steps, n_bins, n_snapshots, n_channels)
        Without the axes of length one in the middle, as in `ArraySnapshot.shape`; a view that is
        not writeable where steps overlap.
    time : ndarray, shape (n_steps,)
        Centre of each step, s; NaN if unknown.
    """

    values: Complex
    time: Float


def frame_recording(
    recording: Recording,
    frequencies: Sequence[float],
    *,
    window: int | None = None,
    hop: int | None = None,
    n_snapshots: int = 1,
    stride: int | None = None,
    start: int = 0,
    stop: int | None = None,
) -> FramedSnapshots:
    """Return snapshots of a recording at several frequencies, several windows per step.

    Parameters
    ----------
    recording : Recording
        Real samples, or complex snapshots of one frequency.
    frequencies : sequence of float
        Frequencies, Hz.
    window : int, optional
        As in `Recording.snapshots`, for all frequencies; that of the lowest if None.
    hop : int, optional
        As in `Recording.snapshots`.
    n_snapshots : int
        Number of successive windows in one step.
    stride : int, optional
        Windows between steps; by default steps do not overlap.
    start, stop : int
        As in `Recording.snapshots`.

    Returns
    -------
    FramedSnapshots
        Snapshots and times of the steps.

    Raises
    ------
    ValueError
        If a frequency lies outside the recording's band, or the recording is shorter than one step.

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> recording = Recording(np.cos(2 * np.pi * 100 * t)[:, None] * np.ones(3), rate=1000.0)
    >>> frames = frame_recording(recording, [100.0, 120.0], window=500, n_snapshots=4)
    >>> frames.values.shape, abs(frames.values[0, :, 0, 0]).round(2), frames.time
    ((2, 2, 4, 3), array([1., 0.]), array([1., 3.]))
    """
    snapshots = recording.snapshots(
        list(frequencies), window=window, hop=hop, start=start, stop=stop
    )
    values, time = snapshots.values, snapshots.time
    values = values[:, None] if recording.is_narrowband else values
    n, every = count("n_snapshots", n_snapshots), n_snapshots if stride is None else stride
    n_steps = (len(values) - n) // count("stride", every) + 1
    if n_steps < 1:
        raise ValueError(f"the recording has {len(values)} snapshots; one step requires {n}")
    overlap = every < n
    rows = sliding_window_view(values, n, axis=0, writeable=not overlap)[::every]
    steps = np.moveaxis(rows, -1, 2)  # (n_steps, n_bins, n_snapshots, n_channels)
    centres = sliding_window_view(time, n)[::every].mean(axis=1)
    return FramedSnapshots(_squeeze(steps), np.asarray(centres))


def _squeeze(steps: Complex) -> Complex:
    """Remove the axes of bins and snapshots, (..., F, N, M), of length one."""
    single = tuple(axis for axis in (-3, -2) if steps.shape[axis] == 1)
    return np.asarray(np.squeeze(steps, axis=single))


def frequencies_in(band: Sequence[float], rate: float, window: int | None = None) -> list[float]:
    """Return the bins of a window that lie in a band.

    Parameters
    ----------
    band : (float, float)
        Lower and upper edge, Hz.
    rate : float
        Samples per second, Hz.
    window : int, optional
        Length of the window; `default_window` at the lower edge if None.

    Returns
    -------
    list of float
        Frequencies, Hz: multiples of rate / window; the middle of a band without one.

    Raises
    ------
    ValueError
        If the band does not lie between 0 and half the rate.

    Examples
    --------
    >>> frequencies_in((600.0, 650.0), rate=4000.0, window=256)
    [609.375, 625.0, 640.625]
    """
    low, high = (float(edge) for edge in band)
    if not 0 < low < high < rate / 2:
        raise ValueError(
            f"band must lie between 0 and half the rate, {rate / 2:g} Hz; got {low:g} and {high:g}"
        )
    n = default_window(rate, low) if window is None else count("window", window, 2)
    first, last = math.ceil(low * n / rate * (1 - 1e-12)), int(high * n / rate * (1 + 1e-12))
    return [k * rate / n for k in range(first, last + 1)] or [(low + high) / 2]


def frame_stream(
    source: BinaryIO,
    n_channels: int,
    frequencies: Sequence[float],
    *,
    n_snapshots: int = 1,
    **live: Any,
) -> Iterator[tuple[float, Complex]]:
    """Yield the snapshots of each step of a stream as soon as it is complete.

    Parameters
    ----------
    source : binary file
        As in `live_snapshots`.
    n_channels : int
        As in `live_snapshots`.
    frequencies : sequence of float
        Frequencies, Hz.
    n_snapshots : int
        Number of successive windows in one step; an incomplete last step is dropped.
    **live : object
        Other arguments of `live_snapshots`.

    Yields
    ------
    float
        Centre of the step, s.
    ndarray, shape (n_bins, n_snapshots, n_channels)
        Snapshots, without the first two axes where they have length one.
    """
    if len(frequencies) > 1 and live.get("dtype", "int16").startswith("complex"):
        raise ValueError("frequencies must be one for a stream of complex frames")
    blocks = live_snapshots(source, n_channels, frequency=list(frequencies),
                            n_snapshots=n_snapshots, **live)  # fmt: skip
    for time, z in blocks:
        yield time, _squeeze(z.reshape(len(frequencies), n_snapshots, n_channels))
