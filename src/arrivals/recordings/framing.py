"""Several looks a step: the frequencies and windows of a recording, or a stream, in groups."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from arrivals.recordings.recording import Recording, default_window
from arrivals.recordings.stream import live_snapshots
from arrivals.typing import Complex, Float
from arrivals.validation import count, positive

MOST_BINS = 16


@dataclass(frozen=True, eq=False)
class Framing:
    """What was heard in each step.

    Parameters
    ----------
    values : ndarray, shape (n_steps, n_bins, n_snapshots, n_channels)
        Without the axes of length one in the middle, as in `ArraySnapshot.shape`.
    time : ndarray, shape (n_steps,)
        Middle of each step, s; NaN where the time is not known.
    """

    values: Complex
    time: Float


def looks(
    recording: Recording,
    frequencies: Sequence[float],
    *,
    window: int | None = None,
    hop: int | None = None,
    n_snapshots: int = 1,
    stride: int | None = None,
) -> Framing:
    """Return the snapshots of a recording at several frequencies, so many windows a step.

    Parameters
    ----------
    recording : Recording
        Of real samples; or of complex snapshots, whose one frequency is known already.
    frequencies : sequence of float
        Hz.
    window, hop : int, optional
        As in `Recording.snapshots`; one window for all frequencies, that of the lowest if None.
    n_snapshots : int
        Successive windows in one step.
    stride : int, optional
        Windows from one step to the next; by default steps do not overlap.

    Raises
    ------
    ValueError
        If a frequency lies outside the recording's band, or less than one step is left.

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> recording = Recording(np.cos(2 * np.pi * 100 * t)[:, None] * np.ones(3), rate=1000.0)
    >>> heard = looks(recording, [100.0, 120.0], window=500, n_snapshots=4)
    >>> heard.values.shape, abs(heard.values[0, :, 0, 0]).round(2), heard.time
    ((2, 2, 4, 3), array([1., 0.]), array([1., 3.]))
    """
    if recording.is_narrowband and len(frequencies) > 1:
        raise ValueError("the recording holds complex snapshots, at one frequency")
    if recording.rate is not None and not recording.is_narrowband and window is None:
        _in_band(frequencies, recording.rate)
        window = default_window(recording.rate, min(frequencies))
    found = [recording.snapshots(f, window=window, hop=hop) for f in frequencies]
    values = np.stack([each.values for each in found], axis=1)
    n, every = count("n_snapshots", n_snapshots), n_snapshots if stride is None else stride
    n_steps = (len(values) - n) // count("stride", every) + 1
    if n_steps < 1:
        raise ValueError(f"the recording has {len(values)} snapshots; one step takes {n}")
    rows = every * np.arange(n_steps)[:, None] + np.arange(n)
    steps = np.swapaxes(values[rows], 1, 2)  # (n_steps, n_bins, n_snapshots, n_channels)
    return Framing(_squeezed(steps), np.asarray(found[0].time[rows].mean(axis=1)))


def _in_band(frequencies: Sequence[float], rate: float) -> None:
    for frequency in frequencies:
        if not 0 < positive("frequency", frequency) < rate / 2:
            raise ValueError(
                f"frequency must lie below half the rate, {rate / 2:g} Hz; got {frequency:g} Hz"
            )


def _squeezed(steps: Complex) -> Complex:
    """Leave out the axes of bins and snapshots, (..., F, N, M), where there is one."""
    single = tuple(axis for axis in (-3, -2) if steps.shape[axis] == 1)
    return np.asarray(np.squeeze(steps, axis=single))


def frequencies_in(band: Sequence[float], rate: float, window: int | None = None) -> list[float]:
    """Return frequencies, Hz, that fill a band: two bins of a Hann window apart, 16 at most.

    Raises
    ------
    ValueError
        If the band does not lie between 0 and half the rate.

    Examples
    --------
    >>> frequencies_in((600.0, 700.0), rate=4000.0)
    [600.0, 633.3333333333334, 666.6666666666666, 700.0]
    """
    low, high = (float(edge) for edge in band)
    if not 0 < low < high < rate / 2:
        raise ValueError(
            f"band must lie between 0 and half the rate, {rate / 2:g} Hz; got {low:g} and {high:g}"
        )
    apart = 2 * rate / (default_window(rate, low) if window is None else count("window", window, 2))
    n = min(int((high - low) / apart) + 1, MOST_BINS)
    return [(low + high) / 2] if n == 1 else np.linspace(low, high, n).tolist()


def live_looks(
    source: BinaryIO,
    n_channels: int,
    frequencies: Sequence[float],
    *,
    n_snapshots: int = 1,
    **live: Any,
) -> Iterator[tuple[float, Complex]]:
    """Yield the looks of each step of a stream, as soon as it is complete.

    Parameters
    ----------
    source, n_channels
        As in `live_snapshots`.
    frequencies : sequence of float
        Hz.
    n_snapshots : int
        Successive windows in one step; a part of a step at the end is dropped.
    **live
        Other arguments of `live_snapshots`.

    Yields
    ------
    float
        Middle of the step, s.
    ndarray, shape (n_bins, n_snapshots, n_channels)
        Without the first two axes where they have length one.
    """
    if len(frequencies) > 1 and np.dtype(live.get("dtype", "int16")).kind == "c":
        raise ValueError("complex frames are snapshots already, at one frequency")
    steps: list[tuple[float, Complex]] = []
    complete = False
    for time, z in live_snapshots(source, n_channels, frequency=list(frequencies), **live):
        steps.append((time, z.reshape(len(frequencies), n_channels)))
        if len(steps) == count("n_snapshots", n_snapshots):
            values: NDArray[Any] = np.stack([each for _, each in steps], axis=1)
            yield float(np.mean([at for at, _ in steps])), _squeezed(values[None])[0]
            steps, complete = [], True
    if not complete:
        raise ValueError(
            f"the stream ended after {len(steps)} windows; one step takes {n_snapshots}"
        )
