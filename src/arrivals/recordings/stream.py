"""Snapshots of a stream of samples, and a tracker on them, step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, BinaryIO, cast

import numpy as np

from arrivals.measurements import is_missing
from arrivals.recordings.narrowband import (
    MAX_WINDOW,
    WindowedSpectrum,
    check_frequency,
    default_window,
)
from arrivals.recordings.raw_numbers import DTYPES, Replay, decoded, item_size
from arrivals.recordings.stored_samples import cleaned
from arrivals.trackers import Tracker
from arrivals.trackers.run import header, text
from arrivals.typing import Complex, Float
from arrivals.validation import count, one_of, positive


def live_snapshots(
    source: BinaryIO,
    n_channels: int,
    *,
    dtype: str = "int16",
    frequency: float | Sequence[float] | None = None,
    rate: float | None = None,
    window: int | None = None,
    hop: int | None = None,
    n_snapshots: int = 1,
) -> Iterator[tuple[float, Complex]]:
    """Yield the snapshots of a stream of interleaved samples as soon as they are complete.

    Parameters
    ----------
    source : binary file
        Frames of one number per channel, little-endian; `read(n)` must wait for n bytes or the end.
    n_channels : int
        Number of channels.
    dtype : str
        int16, int24 (of three bytes) or int32 (scaled to [-1, 1)), float32, float64; or complex64,
        complex128: every frame is a snapshot.
    frequency : float or sequence of float, optional
        Frequencies, Hz; not for complex frames.
    rate : float, optional
        Frames per second, Hz.
    window : int, optional
        As in `Recording.snapshots`, at the lowest frequency; not for complex frames.
    hop : int, optional
        As in `Recording.snapshots`; not for complex frames.
    n_snapshots : int
        Number of successive windows, or complex frames, that are yielded together.

    Yields
    ------
    float
        Centre of the windows, s from the first sample; numbers of frames for complex frames
        without a rate.
    ndarray, shape ([n_bins,] [n_snapshots,] n_channels)
        Snapshots; NaN where a channel has no finite number. The first axis is there if `frequency`
        is a sequence, the second if `n_snapshots` is above 1.

    Raises
    ------
    ValueError
        If the stream ends before its first windows are complete, or contains no finite number; or
        if an argument is out of range. Incomplete frames and windows at the end are dropped.

    Examples
    --------
    >>> import io
    >>> source = io.BytesIO(np.array([1j, 2, 3, 4j, 5], "<c8").tobytes())
    >>> [(time, z.tolist()) for time, z in live_snapshots(source, 2, dtype="complex64")]
    [(0.0, [1j, (2+0j)]), (1.0, [(3+0j), 4j])]
    """
    kind = DTYPES[one_of("dtype", dtype, tuple(DTYPES))]
    frame = item_size(kind) * count("n_channels", n_channels)
    if kind[1] == "c":
        if window is not None or hop is not None:
            raise ValueError("window and hop must be None for complex frames")
        bins: list[float] = []
        window, hop, half = 1, 1, 0.0
        rate = 1.0 if rate is None else positive("rate", rate)
    else:
        if rate is None or frequency is None:
            raise ValueError("real samples require a rate and a frequency, Hz")
        rate = positive("rate", rate)
        bins = [check_frequency(each, rate) for each in np.atleast_1d(frequency)]
        window = default_window(rate, min(bins)) if window is None else count("window", window, 2)
        hop, half = window if hop is None else count("hop", hop), window / 2
    if max(window, hop) > MAX_WINDOW:
        raise ValueError(f"window and hop must be at most {MAX_WINDOW}; got {window} and {hop}")
    n = count("n_snapshots", n_snapshots, maximum=MAX_WINDOW // hop)
    spectrum = WindowedSpectrum(rate, bins, window) if bins else None
    any_finite, centre = False, ((n - 1) * hop / 2 + half) / rate
    for step, block in enumerate(_steps(source, frame, window, hop, n)):
        samples = decoded(block, kind).reshape(-1, n_channels)
        first = step * n * hop
        if spectrum is None:
            z = cleaned(samples, np.dtype(complex))
        else:
            z = spectrum.amplitudes(samples, hop, first).swapaxes(0, 1)
            z = z if isinstance(frequency, Sequence | np.ndarray) else z[0]
        any_finite = any_finite or bool(np.isfinite(z).any())
        yield first / rate + centre, z if n > 1 else z[..., 0, :]
    if not any_finite:
        raise ValueError("no sample of the stream is finite")


def _steps(source: BinaryIO, frame: int, window: int, hop: int, n: int) -> Iterator[bytes]:
    """Yield the bytes of n successive windows, `hop` frames apart, as soon as they are complete."""
    size, step, complete = (window + (n - 1) * hop) * frame, n * hop * frame, False
    buffer = source.read(size)
    while len(buffer) == size:
        complete = True
        yield buffer
        source.read(max(0, step - size))
        buffer = buffer[step:]
        buffer += source.read(size - len(buffer))
    if complete:
        return
    frames = len(buffer) // frame
    windows = max(0, (frames - window) // hop + 1)
    if windows:
        raise ValueError(f"the stream ended after {windows} windows; one step requires {n}")
    raise ValueError(
        f"the stream ended after {frames} frames of {frame} bytes; one window requires {window}"
    )


def read_ahead(
    source: BinaryIO, n_channels: int, duration: float, *, dtype: str = "int16", rate: float
) -> tuple[Float, BinaryIO]:
    """Return the first samples of a stream, and a source that begins with them.

    Parameters
    ----------
    source : binary file
        As in `live_snapshots`.
    n_channels : int
        Number of channels.
    duration : float
        Length to read, s; less if the stream ends before.
    dtype : str
        As in `live_snapshots`, real.
    rate : float
        Frames per second, Hz.

    Returns
    -------
    samples : ndarray, shape (n_samples, n_channels)
    source : binary file
        The whole stream.

    Examples
    --------
    >>> import io
    >>> raw = np.arange(6, dtype="<f4").tobytes()
    >>> samples, source = read_ahead(io.BytesIO(raw), 2, 1.0, dtype="float32", rate=2.0)
    >>> samples.tolist(), source.read(100) == raw
    ([[0.0, 1.0], [2.0, 3.0]], True)
    """
    kind = DTYPES[one_of("dtype", dtype, tuple(DTYPES))]
    frame = item_size(kind) * count("n_channels", n_channels)
    head = source.read(
        int(np.ceil(positive("duration", duration) * positive("rate", rate))) * frame
    )
    whole = len(head) // frame * frame
    samples = decoded(head[:whole], kind).reshape(-1, n_channels)
    return samples.astype(np.float64), cast(BinaryIO, Replay(head, source))


def track_live(
    tracker: Tracker,
    snapshots: Iterable[tuple[float, Complex]],
    write: Callable[[str], object],
    every: int = 1,
) -> int:
    """Run a tracker and write the lines of the tracks file, those of each step in one call.

    The heading precedes the first snapshot with valid data.

    Parameters
    ----------
    tracker : Tracker
        The tracker.
    snapshots : iterable of (float, ndarray)
        Time, s, and snapshot, (n_sensors,).
    write : callable
        Receives whole lines, ended by a newline.
    every : int
        Number of steps per written estimate.

    Returns
    -------
    int
        Number of steps.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers import CBF
    >>> model = ArraySnapshot(SensorArray.ula(4, spacing=0.5), wavelength=1.0)
    >>> track_live(CBF(model, threshold_db=3.0), [(0.5, np.ones(4))], print)
    step,time_s,label,doa_deg,std_deg,existence,level_db
    0,0.5,-1,0,,,0
    <BLANKLINE>
    1
    """
    has_header, n_steps = False, 0
    for n_steps, (time, z) in enumerate(snapshots, start=1):
        tracker.predict()
        tracker.update(z)
        if n_steps % every:
            continue
        estimate = tracker.estimate
        rows: list[tuple[Any, ...]] = (
            [] if has_header or is_missing(z) else [header(type(estimate))]
        )
        rows += [(n_steps // every - 1, time, *row) for row in estimate.rows()]
        if rows:
            has_header = True
            write("".join(f"{','.join(text(row))}\n" for row in rows))
    return n_steps
