"""Check of a recording: levels, wiring and size of the array."""

from __future__ import annotations

import warnings
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import SensorArray
from arrivals.measurement_models.arrays.files import given_array
from arrivals.measurement_models.arrays.stations import StationArray
from arrivals.messages import similar
from arrivals.recordings.check.array_channels import ArrayChannels
from arrivals.recordings.check.faults import (
    level_faults,
    level_notes,
    scale_fault,
    wiring_faults,
    wiring_notes,
)
from arrivals.recordings.check.levels import (
    MAX_NUMBERS,
    SHORT_NUMBERS,
    ChannelLevels,
    hum_share,
    level_blocks,
)
from arrivals.recordings.check.report import ChannelCheck, CheckReport, Fault
from arrivals.recordings.check.wiring_result import SHORT, Effort
from arrivals.recordings.choice.limits import alias_frequency
from arrivals.recordings.readers import READING, read_channels
from arrivals.recordings.recording import Recording
from arrivals.typing import Float
from arrivals.validation import positive


def check(
    recording: str | PathLike[str] | Recording | ArrayLike,
    array: str | PathLike[str] | SensorArray | None = None,
    *,
    frequency: float | None = None,
    **reading: Any,
) -> CheckReport:
    """Check the channels of a recording, and the wiring and the size of its array.

    Parameters
    ----------
    recording : str, path, Recording or array_like
        File (as in `read`), recording, or samples (n_samples, n_channels).
    array : str, path or SensorArray, optional
        Array file, preset or array; that of the recording if None. Without, levels alone are
        checked.
    frequency : float, optional
        Frequency of complex snapshots, Hz; that of the recording if None.
    **reading : object
        `rate`, `variable`, `transpose`, `max_bytes` and `format` of `read`.

    Returns
    -------
    CheckReport
        Its text is a table; `faults` are empty if nothing is known to be wrong.

    Raises
    ------
    ValueError, TypeError, OSError
        If an argument or a file is invalid.

    Notes
    -----
    Each channel is compared with the beam of the others at the direction of each of 48 segments,
    where the channels are coherent. Channels are changed (sign, delay, exchange of two) as long as
    that makes the beams clearly stronger; the changes are the faults. What cannot be decided is
    not tested, and noted: no coherent source, or less than three channels. A reflection of the
    array onto itself exchanges channels without any effect on the data.

    Examples
    --------
    >>> array = SensorArray.uca(6, radius=0.05, speed=343.0)
    >>> source = np.fft.rfft(np.random.default_rng(0).standard_normal(16000))
    >>> wavelength = 343.0 / np.maximum(np.arange(8001), 1)
    >>> samples = np.fft.irfft(source[:, None] * array.steering_vector(1.0, wavelength), axis=0)
    >>> samples[:, 4] *= -1
    >>> print(*check(samples, array, rate=16000.0).faults)
    channel 5 is inverted: swap its two wires, or multiply its samples by -1
    """
    array = given_array(array)
    if not isinstance(recording, Recording):
        for name in reading:
            if name not in READING:
                raise TypeError(f"check has no argument {name!r}{similar(name, READING)}")
        recording = read_channels(recording, array, **reading)
    elif reading:
        raise TypeError(f"{', '.join(reading)} must be left out for a Recording, which has its own")
    if frequency is not None:
        positive("frequency", frequency)
        if not recording.is_narrowband:
            raise ValueError("frequency must be None for real samples, which contain it")
    if isinstance(array, StationArray):
        array = array.matched(recording.names)
    frequency = recording.frequency if frequency is None else frequency
    is_selected = array is None or array == recording.array
    return _report(recording, recording.array if is_selected else array, frequency, Effort())


LEVEL_FAULTS = ("channel count", "silent", "identical", "clipped", "hum")  # of any waves


def warn_of_faults(
    recording: Recording, frequency: float | None = None, *, plane_waves: bool = True
) -> None:
    """Warn of each fault of a recording with an array, by a short check.

    Parameters
    ----------
    recording : Recording
        With `array`.
    frequency : float, optional
        Frequency of complex snapshots, Hz.
    plane_waves : bool
        False if sources may be near: delays of curved waves are no fault of the wiring.

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal((4000, 3)) * [1.0, 1.0, 0.0]
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     warn_of_faults(Recording(noise, 8000.0, array=SensorArray.ula(3, 0.1, speed=343.0)))
    >>> print(caught[0].message)
    channel 3 is silent: connect its sensor, or add missing = [3] to the array file
    """
    faults = _report(recording, recording.array, frequency, SHORT).faults
    if not plane_waves:
        faults = tuple(fault for fault in faults if fault.kind in LEVEL_FAULTS)
    n_silent = sum(fault.kind == "silent" for fault in faults)
    if n_silent < recording.n_channels:  # else there is nothing to track, which is an error
        for fault in faults:
            warnings.warn(fault.text, stacklevel=3)


def _report(
    recording: Recording, array: SensorArray | None, frequency: float | None, effort: Effort
) -> CheckReport:
    channels, rate = ArrayChannels(recording, array), recording.rate
    labels = channels.labels
    most = SHORT_NUMBERS if effort.is_short else MAX_NUMBERS
    blocks = level_blocks(channels.rows, len(recording.samples), most)
    levels, hum = ChannelLevels.of(blocks), (np.zeros(len(labels)), np.zeros(len(labels)))
    if not recording.is_narrowband and rate is not None and not effort.is_short:
        hum = hum_share(blocks, rate)
    faults, notes = level_faults(levels, hum, labels), level_notes(levels, hum, labels)
    if channels.fault is not None:  # other channels may be no sensors
        notes += [each.text.partition(":")[0] for each in faults]
        faults = [channels.fault]
    wiring, tested = channels.wiring(levels, frequency, effort)
    numbers = [labels[m] for m in tested]
    faults += wiring_faults(wiring, numbers)
    notes += wiring_notes(wiring, numbers)
    if wiring.scale is not None and array is not None:
        verdict = scale_fault(wiring.scale, array.dim, wiring.has_other_size)
        faults += [verdict] if isinstance(verdict, Fault) else []
        notes += [verdict] if isinstance(verdict, str) else []
    agreement = np.full(len(labels), np.nan)
    agreement[tested] = wiring.agreement
    alias = None
    if array is not None and array.speed is not None and array.n_sensors > 1:
        alias = alias_frequency(array)
    scale = None if wiring.scale is None else (float(wiring.scale[0]), float(wiring.scale[1]))
    description = _description(recording, array, alias, scale)
    rows = _channel_checks(labels, levels, hum[1], agreement, faults)
    return CheckReport(description, rows, tuple(faults), tuple(notes), alias, scale)


def _channel_checks(
    labels: list[int], levels: ChannelLevels, hum: Float, agreement: Float, faults: list[Fault]
) -> tuple[ChannelCheck, ...]:
    with np.errstate(divide="ignore"):
        level_db = 20 * np.log10(levels.rms)
    columns = {
        "rms_db": level_db, "offset": levels.offset, "clipped": levels.clipped, "hum": hum,
        "missing": levels.missing, "agreement": agreement,
    }  # fmt: skip
    is_tested = np.isfinite(agreement)
    return tuple(
        ChannelCheck(
            channel=label,
            state=_state(label, faults, bool(is_tested[m])),
            **{name: float(column[m]) for name, column in columns.items()},
        )
        for m, label in enumerate(labels)
    )


def _state(label: int, faults: list[Fault], is_tested: bool) -> str:
    kinds = dict.fromkeys(each.kind for each in faults if label in each.channels)
    return ", ".join(kinds) or ("ok" if is_tested else "not tested")


def _description(
    recording: Recording,
    array: SensorArray | None,
    alias: float | None,
    scale: tuple[float, float] | None,
) -> str:
    parts = [f"{recording.n_channels} channel{'s' * (recording.n_channels > 1)}"]
    if np.isfinite(recording.duration):
        parts.append(f"{recording.duration:.4g} s")
    if recording.rate is not None:
        parts.append(f"{recording.rate:g} Hz")
    if array is not None:
        parts.append(f"array of {array.n_sensors} sensors")
    if alias is not None:
        parts.append(f"alias limit {alias:.4g} Hz")
    if scale is not None:
        parts.append(f"delays {scale[0]:.2g} to {scale[1]:.2g} of those of horizontal waves")
    return ", ".join(parts)
