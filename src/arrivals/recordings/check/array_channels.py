"""Channels of a recording that belong to the sensors of an array."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arrivals.measurement_models import SensorArray
from arrivals.recordings.check.faults import is_silent
from arrivals.recordings.check.levels import ChannelLevels
from arrivals.recordings.check.report import Fault
from arrivals.recordings.check.wiring_result import (
    Effort,
    WiringResult,
    wiring_of_samples,
    wiring_of_snapshots,
)
from arrivals.recordings.recording import Recording


@dataclass(frozen=True, eq=False)
class ArrayChannels:
    """Channels of a recording in the order of the sensors; all of them if they do not fit.

    Parameters
    ----------
    recording : Recording
        The recording.
    array : SensorArray or None
        The array; its channels are selected already if it is that of the recording.

    Examples
    --------
    >>> array = SensorArray([0.0, 0.1, 0.2], 343.0, channels=[1, 2, 0])
    >>> channels = ArrayChannels(Recording(np.arange(8.0).reshape(2, 4), 8000.0), array)
    >>> channels.labels, channels.rows(0, 1)
    ([2, 3, 1], array([[1., 2., 0.]]))
    """

    recording: Recording
    array: SensorArray | None

    @cached_property
    def labels(self) -> list[int]:
        """Numbers of the channels in the recording, counted from 1."""
        every = np.arange(1, self.recording.n_channels + 1)
        if self.array is None or self.fault is not None:
            return [int(each) for each in every]
        if self.array is self.recording.array:
            wired = self.array.channels
            return [int(each) for each in (every if wired is None else np.asarray(wired) + 1)]
        return [int(each) for each in self.array.select(every)]

    @cached_property
    def fault(self) -> Fault | None:
        """Fault of a number of channels that does not fit."""
        array, n = self.array, self.recording.n_channels
        if array is None or array is self.recording.array:
            return None
        try:
            array.select(np.zeros(n))
        except ValueError:
            m = array.n_sensors
            many = f"add channels = [...] to the array file, those of the {m} sensors in order"
            few = "use the array file of this recording, or add missing = [...] to it"
            text = f"the recording has {n} channels, the array {m} sensors"
            return Fault("channel count", (), f"{text}: {many if n > m else few}")
        return None

    def rows(self, start: int, stop: int) -> NDArray[Any]:
        """Return the samples of these rows, one column a channel."""
        rows = np.asarray(self.recording.samples[start:stop])
        if self.array is self.recording.array:
            return rows
        return rows[:, np.array(self.labels) - 1]

    def wiring(
        self, levels: ChannelLevels, frequency: float | None, effort: Effort
    ) -> tuple[WiringResult, list[int]]:
        """Test the channels that have a signal of their own.

        Parameters
        ----------
        levels : ChannelLevels
            Of the channels.
        frequency : float or None
            Frequency of complex snapshots, Hz.
        effort : Effort
            Amount of data that is used.

        Returns
        -------
        result : WiringResult
            Of the tested channels.
        tested : list of int
            Their indices.
        """
        is_own = levels.twin == np.arange(len(levels.rms))
        active = [int(m) for m in np.flatnonzero(~is_silent(levels) & is_own)]
        reason = self._missing(frequency)
        if not reason and len(active) < 2:
            reason = "less than 3 channels with a signal"
        array, n_rows = self.array, len(self.recording.samples)
        if reason or array is None:
            return WiringResult(np.full(len(active), np.nan), not_tested=reason), active
        part = SensorArray(array.positions[active], array.speed)

        def rows(start: int, stop: int) -> NDArray[Any]:
            return self.rows(start, stop)[:, active]

        if self.recording.is_narrowband:
            return wiring_of_snapshots(rows, n_rows, frequency or 1.0, part, effort), active
        rate = self.recording.rate or 1.0
        return wiring_of_samples(rows, n_rows, rate, part, effort), active

    def _missing(self, frequency: float | None) -> str:
        """Return what the test of the wiring lacks; empty if nothing."""
        if self.array is None or self.fault is not None:
            return "it requires an array with a sensor for each channel"
        if self.array.speed is None:
            return "the array has no wave speed"
        if self.recording.is_narrowband and frequency is None:
            return "complex snapshots require their frequency"
        if not self.recording.is_narrowband and self.recording.rate is None:
            return "the rate is unknown"
        return ""
