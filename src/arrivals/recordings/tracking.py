"""Track directions through a recording, by settings given or chosen from it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.files import given_array
from arrivals.messages import similar
from arrivals.recordings.check import warn_of_faults
from arrivals.recordings.choice import Choice, MeanSpectrum, TrackOptions, choose
from arrivals.recordings.choice.assembly import assembled, make_tracker, takes_samples
from arrivals.recordings.framing import FramedSnapshots, frame_recording
from arrivals.recordings.narrowband import check_frequency, default_window
from arrivals.recordings.readers import READING, read
from arrivals.recordings.recording import Recording
from arrivals.recordings.sample_stream import band_samples, track_samples
from arrivals.recordings.step_snapshots import (
    candidate_frequencies,
    reduced_snapshots,
    strongest_candidates,
)
from arrivals.trackers import find
from arrivals.trackers.run import Run
from arrivals.typing import Complex

TWO = ("unknowns", "nearest")  # arguments of measurement models with two unknowns a source
BLOCK = 2**20  # samples, or complex numbers of the steps, that are processed together: 16 MB


def track(
    recording: str | PathLike[str] | Recording | ArrayLike,
    array: str | PathLike[str] | SensorArray | None = None,
    *,
    tracker: str | None = None,
    frequencies: float | Sequence[float] | None = None,
    band: Sequence[float] | None = None,
    window: int | None = None,
    hop: int | None = None,
    snapshots: int | None = None,
    **more: Any,
) -> Run:
    """Track directions of arrival through a recording.

    Whatever is not given is chosen from the array and the recording, as `choose` says: talkers and
    other wideband sources are tracked by `wideband_mixture` at all usable bins, in steps of 64 ms;
    spectral lines, and sources below the frequencies of speech, by `svalse`. A fault of a channel
    or of the wiring, as in `check`, is a warning.

    Parameters
    ----------
    recording : str, path, Recording or array_like
        File (as in `read`), recording, or samples (n_samples, n_channels), which require `rate`.
    array : str, path or SensorArray, optional
        Array file, preset, or array; that of the recording if None.
    tracker : str, optional
        Registered name; see `arrivals.trackers.available()`.
    frequencies : float or sequence of float, optional
        Frequencies, Hz.
    band : (float, float), optional
        Edges, Hz, in place of frequencies: all bins of the window between them.
    window, hop : int, optional
        Samples of a window, and between windows.
    snapshots : int, optional
        Windows in a step.
    **more : object
        `rate`, `variable`, `transpose`, `max_bytes` and `format` of `read`; `reduce`, `follow`,
        `unknowns` and `nearest` as in `TrackOptions`, such as `unknowns="sphere"` for azimuth and
        elevation; other names are parameters of the tracker, as in `set_params`.

    Returns
    -------
    Run
        Estimates over time; times in s from the first sample.

    Raises
    ------
    ValueError, TypeError, OSError
        If an argument or a file is invalid, an array is missing, or no frequency is usable.

    Examples
    --------
    >>> array = SensorArray.ula(6, spacing=0.08, speed=343.0)
    >>> t = np.arange(8000)[:, None] / 8000
    >>> delay = array.positions[:, 0] * np.sin(0.3) / 343.0
    >>> noise = 0.1 * np.random.default_rng(0).standard_normal((8000, 6))
    >>> run = track(np.cos(2 * np.pi * 1500 * (t + delay)) + noise, array, rate=8000)
    >>> float(np.nanmedian(run.doa).round(2)), run.time[:2]
    (0.3, array([0.048, 0.112]))
    """
    from threadpoolctl import threadpool_limits

    reading = {name: more.pop(name) for name in READING if name in more}
    given = {name: more.pop(name) for name in ("reduce", "follow", *TWO) if name in more}
    options = TrackOptions(tracker, frequencies, band, window, hop, snapshots, more, **given)
    recording = _recording(recording, array, reading)
    if band is not None and takes_samples(tracker):
        return _track_band(recording, options)
    choice = choice_for(recording, options)
    _check_arguments(more, choice.tracker)
    _, made = assembled(_array_of(recording), choice, recording.rate)
    steps = RecordedSteps(recording, choice)
    warn_of_faults(recording, min(choice.frequencies), plane_waves=choice.unknowns != "range")
    with threadpool_limits(1, "blas"):  # matrices are small: more threads only wait
        run = made.run(steps)
    return run.at(steps.time) if np.isfinite(steps.time).all() else run


def _check_arguments(more: dict[str, Any], tracker: str) -> None:
    """Raise a TypeError for a misspelt argument of `track`."""
    parameters = inspect.signature(find(tracker)).parameters
    known = [*inspect.signature(track).parameters, *READING]
    for name in more:
        hint = similar(name, known)
        if hint and name.partition("__")[0] not in parameters:
            raise TypeError(f"track has no argument {name!r}{hint}")


def _track_band(recording: Recording, options: TrackOptions) -> Run:
    """Track by a tracker of single real samples."""
    array, rate = _array_of(recording), recording.rate
    if recording.is_narrowband or rate is None or options.band is None:
        raise ValueError("a band requires real samples with a rate")
    for name in ("window", "snapshots", *TWO):
        if getattr(options, name) not in (None, "azimuth"):
            raise ValueError(f"{name} must be left out for {options.tracker!r}, of real samples")
    measurement = band_samples(array, rate, options.band)
    made = make_tracker(options.tracker or "", measurement, options.settings)
    warn_of_faults(recording)
    return track_samples(made, recording.samples, rate, every=options.hop or 1)


def choice_for(recording: Recording, options: TrackOptions | None = None) -> Choice:
    """Return the choice for a recording that carries its array.

    Parameters
    ----------
    recording : Recording
        With `array`.
    options : TrackOptions, optional
        Given settings.

    Returns
    -------
    Choice
        Its text is one line: the choice as options of `arrivals track`.

    Examples
    --------
    >>> array = SensorArray.uca(6, radius=0.04, speed=343.0)
    >>> noise = np.random.default_rng(0).standard_normal((16000, 6))
    >>> choice = choice_for(Recording(noise, 16000.0, array=array))
    >>> choice.tracker, choice.window, choice.n_snapshots, len(choice.frequencies)
    ('wideband_mixture', 512, 4, 196)
    """
    array, rate = _array_of(recording), recording.rate
    options = options or TrackOptions()
    if recording.is_narrowband:
        spectrum = None
        if not options.has_frequencies and recording.frequency is not None:
            options = replace(options, frequencies=recording.frequency)
    elif options.has_frequencies or rate is None:
        spectrum = MeanSpectrum.empty()
    else:
        spectrum = MeanSpectrum.of(recording.samples, rate)
    return choose(array, rate, spectrum, options, len(recording.samples))


def followed(choice: Choice, rate: float | None, window: int) -> Sequence[float]:
    """Return the frequencies of a choice, or the candidates of those that are followed.

    Parameters
    ----------
    choice : Choice
        The choice.
    rate : float or None
        Samples per second, Hz.
    window : int
        Length of a window, samples.

    Returns
    -------
    sequence of float

    Examples
    --------
    >>> choice = Choice("a tone", "svalse", (100.0,), window=500, follow=0.5)
    >>> followed(choice, 1000.0, 500)
    [99.5, 100.0, 100.5]
    """
    if choice.follow is None or rate is None:
        return choice.frequencies
    return candidate_frequencies(choice.frequencies, choice.follow, rate / window)


class RecordedSteps:
    """Snapshots of the steps of a recording, computed in blocks as they are iterated over.

    Parameters
    ----------
    recording : Recording
        The recording.
    choice : Choice
        Frequencies, windows and number of windows in a step.

    Raises
    ------
    ValueError
        If the recording is shorter than a step; after the last step, if no sample was finite.

    Examples
    --------
    >>> choice = Choice("noise", "svalse", (100.0, 200.0), window=100, hop=50, n_snapshots=4)
    >>> steps = RecordedSteps(Recording(np.ones((1000, 3)), 1000.0), choice)
    >>> len(steps), next(iter(steps)).shape, steps.time
    (4, (2, 4, 3), array([0.125, 0.325, 0.525, 0.725]))
    """

    def __init__(self, recording: Recording, choice: Choice) -> None:
        self._recording, self._choice = recording, choice
        self._window = self._hop = 1
        if not recording.is_narrowband and recording.rate is not None:
            lowest = check_frequency(min(choice.frequencies), recording.rate)
            self._window = choice.window or default_window(recording.rate, lowest)
            self._hop = choice.hop or self._window
        self._frequencies = followed(choice, recording.rate, self._window)
        self._step = self._hop * choice.n_snapshots
        n_windows = (len(recording.samples) - self._window) // self._hop + 1
        self._n_steps = max(0, n_windows // choice.n_snapshots)
        first = self._part(0, 1)  # refuses invalid arguments
        if recording.time is not None:
            self.time = self._part(0, max(1, self._n_steps)).time
        else:
            at = np.arange(self._n_steps) * (self._step / (recording.rate or 1.0))
            self.time = np.asarray(first.time[0] + at)  # NaN without a rate

    def __len__(self) -> int:
        return self._n_steps

    def __iter__(self) -> Iterator[Complex]:
        any_finite = False
        size = max(self._step, self._choice.n_snapshots * len(self._frequencies))
        n = max(1, BLOCK // (size * self._recording.n_channels))
        for first in range(0, self._n_steps, n):
            values = self._reduced(self._part(first, min(n, self._n_steps - first)).values)
            any_finite = any_finite or bool(np.isfinite(values).any())
            yield from values
            del values  # before the next ones are computed
        if not any_finite:
            raise ValueError("no sample of the array's channels is finite")

    def framed(self) -> FramedSnapshots:
        """Return all steps at once."""
        if self._choice.reduce:
            return FramedSnapshots(np.array(list(self)), self.time)
        return self._part(0, max(1, self._n_steps))

    def _reduced(self, values: Complex) -> Complex:
        return reduced_snapshots(values) if self._choice.reduce else values

    def _part(self, first: int, n_steps: int) -> FramedSnapshots:
        choice, start = self._choice, first * self._step
        framed = frame_recording(
            self._recording, self._frequencies, window=choice.window, hop=choice.hop,
            n_snapshots=choice.n_snapshots, start=start,
            stop=start + n_steps * self._step - self._hop + self._window,
        )  # fmt: skip
        if choice.follow is None:
            return framed
        values = strongest_candidates(framed.values, len(choice.frequencies))
        return FramedSnapshots(values, framed.time)


def _recording(recording: Any, array: Any, reading: dict[str, Any]) -> Recording:
    """Return a recording of the sensors of an array."""
    array = given_array(array)
    if not isinstance(recording, Recording):
        if array is None:
            raise ValueError("array must be an array file, a preset or a SensorArray; got None")
        return read(recording, array=array, rate_required=True, **reading)
    if reading:
        raise TypeError(f"{', '.join(reading)} must be left out for a Recording, which has its own")
    if array is None or array == recording.array:
        return recording
    return recording.select(array)


def _array_of(recording: Recording) -> SensorArray:
    if recording.array is None:
        raise ValueError("the recording has no array: pass array, a file or a SensorArray")
    return recording.array
