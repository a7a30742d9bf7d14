"""Recording of an array: real samples or complex snapshots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.stations import StationArray
from arrivals.measurements import numbers
from arrivals.recordings.narrowband import WindowedSpectrum, check_frequency, default_window
from arrivals.recordings.stored_samples import StoredSamples, cleaned, row_type
from arrivals.typing import Complex, Float
from arrivals.validation import count, positive, shaped

Samples: TypeAlias = NDArray[np.floating[Any] | np.complexfloating[Any, Any]]


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Narrowband snapshots over time.

    Parameters
    ----------
    values : ndarray, shape (n_steps, n_channels) or (n_steps, n_frequencies, n_channels)
        Complex amplitudes; NaN where a channel is missing.
    time : ndarray, shape (n_steps,)
        Centres of the windows, s from the first sample; NaN if unknown.
    frequency : float, tuple of float or None
        Frequency, Hz, or several; None if unknown.
    """

    values: Complex
    time: Float
    frequency: float | tuple[float, ...] | None


@dataclass(frozen=True, eq=False)
class Recording:
    """Recording of the channels of an array: real samples, or complex snapshots.

    Parameters
    ----------
    samples : array_like, shape (n_samples, n_channels)
        Real samples, stored as float32 if they are, else as float64; or complex ones (complex128),
        each row a narrowband snapshot. One channel may have the shape (n_samples,). Masked,
        infinite and missing samples become NaN, as in `arrivals.measurements.numbers`.
        `StoredSamples` stay in their file: `samples[start:stop]` loads rows.
    rate : float, optional
        Rows per second, Hz.
    time : array_like, shape (n_samples,), optional
        Time of each snapshot, s; only for complex snapshots.
    array : SensorArray, optional
        Sensors of the channels, in the same order.
    frequency : float, optional
        Centre frequency of complex samples, Hz.
    names : tuple of str, optional
        Names of the channels.

    Raises
    ------
    ValueError
        If no sample is finite, a shape does not fit, or `rate` is not positive.
    TypeError
        If samples are not numbers.

    Examples
    --------
    >>> t = np.arange(1000) / 1000
    >>> tone = np.cos(2 * np.pi * 100 * t)
    >>> recording = Recording(np.stack([tone, 2 * tone], axis=1), rate=1000.0)
    >>> recording.n_channels, recording.duration
    (2, 1.0)
    >>> y = recording.snapshots(100.0, window=500)
    >>> y.values.real.round(6), y.time
    (array([[1., 2.],
           [1., 2.]]), array([0.25, 0.75]))
    """

    samples: Samples | StoredSamples
    rate: float | None = None
    time: Float | None = None
    array: SensorArray | None = None
    frequency: float | None = None
    names: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        samples = _cleaned(self.samples)
        object.__setattr__(self, "samples", samples)
        if self.rate is not None:
            object.__setattr__(self, "rate", positive("rate", self.rate))
        if self.frequency is not None:
            object.__setattr__(self, "frequency", positive("frequency", self.frequency))
        if self.names is not None and len(self.names) != samples.shape[1]:
            raise ValueError(
                f"names must have {samples.shape[1]} entries, one a channel; got {len(self.names)}"
            )
        if self.time is not None:
            if not self.is_narrowband:
                raise ValueError("time requires complex snapshots: real samples have a rate")
            object.__setattr__(self, "time", shaped("time", self.time, len(samples)))
        if self.array is not None and self.array.n_sensors != samples.shape[1]:
            raise ValueError(
                f"samples must have {self.array.n_sensors} channels, the sensors of the array; got "
                f"{samples.shape[1]}: pass array.select(samples)"
            )

    @property
    def is_narrowband(self) -> bool:
        """True if the samples are complex snapshots."""
        return bool(np.iscomplexobj(self.samples))

    @property
    def n_channels(self) -> int:
        """Number of channels."""
        return int(self.samples.shape[1])

    @property
    def duration(self) -> float:
        """Length, s; NaN if neither rate nor time is known."""
        if self.rate is not None:
            return len(self.samples) / self.rate
        return float(np.nan if self.time is None else self.time[-1] - self.time[0])

    def select(self, array: SensorArray) -> Recording:
        """Return the channels of an array's sensors, in its order, with the array.

        Parameters
        ----------
        array : SensorArray
            The array; a `StationArray` is matched by the names of the channels.

        Returns
        -------
        Recording

        Raises
        ------
        ValueError
            If the recording has too few channels, or too many.

        Examples
        --------
        >>> recording = Recording(np.ones((10, 4)), rate=8.0)
        >>> recording.select(SensorArray.ula(4, spacing=0.5, missing=[1])).n_channels
        3
        """
        if isinstance(array, StationArray):
            array = array.matched(self.names)
        channels = [int(channel) for channel in array.select(np.arange(self.n_channels))]
        if isinstance(self.samples, StoredSamples):
            samples: Samples | StoredSamples = self.samples.select(channels)
        else:
            samples = array.select(self.samples)
        names = self.names and tuple(self.names[channel] for channel in channels)
        return replace(self, samples=samples, array=array, names=names)

    def snapshots(
        self,
        frequency: float | Sequence[float] | None = None,
        *,
        window: int | None = None,
        hop: int | None = None,
        start: int = 0,
        stop: int | None = None,
    ) -> Snapshots:
        """Return narrowband snapshots at one frequency, or at several.

        Parameters
        ----------
        frequency : float or sequence of float
            Frequency, Hz, below rate / 2, or several; None for a recording of complex snapshots,
            which are returned unchanged.
        window : int, optional
            Length of the Hann window in samples; `default_window` of the lowest frequency if None.
        hop : int, optional
            Samples between windows. By default windows do not overlap, so that the noise of two
            snapshots is independent.
        start, stop : int
            First sample (or complex snapshot) and the one after the last; the end if None. Phases
            and times refer to the first sample of the recording.

        Returns
        -------
        Snapshots
            Values as `narrowband` defines them, and times (n_steps,).

        Raises
        ------
        ValueError
            If the rate is not known, the frequency does not lie in (0, rate / 2), less than one
            window remains after `start`, or a window is given for complex snapshots.
        """
        start = count("start", start, 0)
        if self.is_narrowband:
            given: Any = frequency
            if np.size(given) > 1:
                raise ValueError("frequencies must be one for a recording of complex snapshots")
            if window is not None or hop is not None:
                raise ValueError("window and hop must be None for a recording of complex snapshots")
            if start >= len(self.samples):
                raise ValueError(f"start must be below {len(self.samples)}; got {start}")
            values = np.asarray(self.samples[start:stop], complex)
            known = given[0] if np.ndim(given) else given
            return Snapshots(values, self._snapshot_times(start, len(values)), known)
        if self.rate is None:
            raise ValueError("a frequency requires the rate of the recording: pass rate= in Hz")
        if frequency is None:
            raise ValueError("frequency must be a number for a recording of real samples; got None")
        bins = [check_frequency(each, self.rate) for each in np.atleast_1d(frequency)]
        window = window if window is not None else default_window(self.rate, min(bins))
        hop = hop if hop is not None else window
        self._check_length(count("window", window, 2), start)
        spectrum = WindowedSpectrum(self.rate, bins, window)
        values = spectrum.amplitudes(self.samples[start:stop], hop, start)
        centres = start + hop * np.arange(len(values)) + window / 2
        time = np.asarray(centres / self.rate, np.float64)
        if isinstance(frequency, Sequence | np.ndarray):
            return Snapshots(values, time, tuple(bins))
        return Snapshots(values[:, 0], time, bins[0])

    def _snapshot_times(self, start: int, n: int) -> Float:
        if self.time is not None:
            return self.time[start : start + n]
        return np.arange(start, start + n) / np.float64(self.rate or np.nan)

    def _check_length(self, window: int, start: int) -> None:
        n_samples, n_channels = self.samples.shape
        if n_samples - start < window:
            after = f" after sample {start}" if start else ""
            rows = " (if its rows are channels, transpose it)" if n_samples < n_channels else ""
            raise ValueError(
                f"the recording has {max(0, n_samples - start)} samples{after}{rows}; "
                f"one window requires {window}: pass a shorter window="
            )


def _cleaned(value: Any) -> Samples | StoredSamples:
    """Return samples (n_samples, n_channels) of type `Samples`, NaN where missing."""
    if isinstance(value, StoredSamples):
        _check_shape(value.shape)
        return value
    is_plain = type(value) is np.ndarray and value.dtype.kind in "iufc"
    samples = value if is_plain else numbers("samples", value)
    _check_shape(samples.shape)
    rows = cleaned(samples.reshape(len(samples), -1), row_type(samples.dtype))
    if not (np.isfinite(rows)).any():
        raise ValueError("no sample of the recording is finite")
    return rows


def _check_shape(shape: tuple[int, ...]) -> None:
    if len(shape) not in (1, 2):
        raise ValueError(f"samples must have shape (n_samples, n_channels); got {shape}")
    if 0 in shape:
        raise ValueError(f"the recording is empty; its shape is {shape}")
