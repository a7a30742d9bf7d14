"""Real samples of recordings and streams, and trackers of single samples."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySamples, FlatBand, SensorArray
from arrivals.measurement_models.delays.array_samples import checked_band
from arrivals.recordings.raw_numbers import DTYPES, decoded, item_size
from arrivals.trackers import Run, Tracker
from arrivals.trackers.run import RunRecorder
from arrivals.typing import Float
from arrivals.validation import count, one_of, positive


def band_samples(
    array: SensorArray, rate: float, band: Sequence[float], snr_db: float = 0.0
) -> ArraySamples:
    """Return the measurement model of a source that fills a band, and samples filtered to it.

    Parameters
    ----------
    array : SensorArray
        A line with a wave speed.
    rate : float
        Samples per second, Hz.
    band : (float, float)
        Lower and upper edge, Hz.
    snr_db : float
        Signal-to-noise ratio, dB.

    Returns
    -------
    ArraySamples
        The model.

    Raises
    ------
    ValueError
        If the band does not fit the rate, or the array.

    Examples
    --------
    >>> array = SensorArray.ula(8, spacing=0.2, speed=1500.0)
    >>> round(band_samples(array, 16000.0, (1000.0, 3000.0)).kappa, 3)
    2.133
    """
    low, high = checked_band(band, positive("rate", rate))
    return ArraySamples(array, rate, FlatBand(low / rate, high / rate), snr_db, band=(low, high))


def track_samples(
    tracker: Tracker, samples: Iterable[ArrayLike], rate: float, every: int = 1
) -> Run:
    """Run a tracker on every sample, and record every n-th estimate.

    Parameters
    ----------
    tracker : Tracker
        The tracker.
    samples : array_like, shape (n_samples, n_sensors), or any iterable
        Real samples.
    rate : float
        Samples per second, Hz.
    every : int
        n.

    Returns
    -------
    Run
        Recorded estimates; times in s.

    Examples
    --------
    >>> from arrivals.trackers import InterpolationEKF
    >>> array = SensorArray.ula(8, spacing=0.2, speed=1500.0)
    >>> tracker = InterpolationEKF(band_samples(array, 16000.0, (1000.0, 3000.0)))
    >>> track_samples(tracker, np.ones((100, 8)), 16000.0, every=40).time
    array([0.0024375, 0.0049375])
    """
    recorder = RunRecorder(type(tracker.estimate))
    every = count("every", every)
    stream = iter(samples)
    while block := list(islice(stream, every)):
        for z in block:
            tracker.predict()
            tracker.update(z)
        if len(block) == every:
            recorder.add(tracker.estimate, tracker.x)
    run = recorder.run(dt=1.0, elapsed=np.nan).made_by(tracker)
    return run.at((every * np.arange(1, len(run) + 1) - 1) / positive("rate", rate))


def live_samples(source: BinaryIO, n_channels: int, *, dtype: str = "int16") -> Iterator[Float]:
    """Yield the frames of a stream of interleaved real samples, one number per channel.

    Parameters
    ----------
    source : binary file
        Little-endian; `read(n)` must wait for n bytes or the end.
    n_channels : int
        Number of channels.
    dtype : str
        int16, int24 or int32 (scaled to [-1, 1)), float32, float64.

    Yields
    ------
    ndarray, shape (n_channels,)
        A frame.

    Examples
    --------
    >>> import io
    >>> [z.tolist() for z in live_samples(io.BytesIO(np.array([0, 16384], "<i2").tobytes()), 2)]
    [[0.0, 0.5]]
    """
    kinds = tuple(name for name in DTYPES if not name.startswith("complex"))
    kind = DTYPES[one_of("dtype", dtype, kinds)]
    size = item_size(kind) * count("n_channels", n_channels)
    while len(block := source.read(size)) == size:
        yield decoded(block, kind).astype(np.float64)
