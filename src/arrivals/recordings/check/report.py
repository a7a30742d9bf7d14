"""Report of a check: levels and wiring of each channel, faults and notes."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

CLIPPED, HUM, SHOWN_DB = 1e-4, 0.01, -199.0


@dataclass(frozen=True)
class Fault:
    """Fault of a recording or its array, in one line with the cure.

    Parameters
    ----------
    kind : str
        `channel count`, `silent`, `identical`, `clipped`, `hum`, `inverted`, `swapped`, `late`,
        `no agreement` or `scale`.
    channels : tuple of int
        Channels of the recording, counted from 1; empty if it concerns all.
    text : str
        Fault, a colon, and the cure.

    Examples
    --------
    >>> print(Fault("inverted", (5,), "channel 5 is inverted: swap its two wires"))
    channel 5 is inverted: swap its two wires
    """

    kind: str
    channels: tuple[int, ...]
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class ChannelCheck:
    """Levels and wiring of one channel.

    Parameters
    ----------
    channel : int
        Channel of the recording, counted from 1.
    rms_db : float
        Root of the mean square without the offset, dB of the unit of the samples (of full scale
        for WAV); -inf if constant.
    offset : float
        Mean.
    clipped, hum, missing : float
        Shares: of samples in flat tops, of mains hum in the power, of missing samples.
    agreement : float
        With the beam of the other channels, 1 to -1; NaN if not tested.
    state : str
        `ok`, kinds of faults, or `not tested`.

    Examples
    --------
    >>> ChannelCheck(1, -20.0, 0.0, 0.0, 0.0, 0.0, 0.81, "ok").state
    'ok'
    """

    channel: int
    rms_db: float
    offset: float
    clipped: float
    hum: float
    missing: float
    agreement: float
    state: str


@dataclass(frozen=True)
class CheckReport:
    """Levels, wiring and faults of a recording.

    Parameters
    ----------
    description : str
        Recording and array, in one line.
    channels : tuple of ChannelCheck
        One for each channel of the array, or of the recording if they do not fit.
    faults : tuple of Fault
        What is wrong; empty if nothing is known to be.
    notes : tuple of str
        What was not tested and why, and what may be right or wrong.
    alias_hz : float or None
        Frequency at which the smallest spacing is half the wavelength, Hz.
    scale : tuple of float or None
        Range of the size of the array from delays, relative to that of the array file.

    Examples
    --------
    >>> channel = ChannelCheck(1, -20.0, 0.0, 0.0, 0.0, 0.0, 0.81, "ok")
    >>> report = CheckReport("1 channel", (channel,))
    >>> print(report)
    1 channel
    channel  rms dB     offset  clipped %  hum %  agreement  state
          1   -20.0          0       0.00      0       0.81  ok
    no fault found
    >>> report.to_dict()["faults"], bool(report.faults)
    ([], False)
    """

    description: str
    channels: tuple[ChannelCheck, ...]
    faults: tuple[Fault, ...] = ()
    notes: tuple[str, ...] = ()
    alias_hz: float | None = None
    scale: tuple[float, float] | None = None

    def __str__(self) -> str:
        lines = [self.description]
        lines.append("channel  rms dB     offset  clipped %  hum %  agreement  state")
        lines += map(_row, self.channels)
        lines += [f"note: {note}" for note in self.notes]
        lines += [f"FAULT: {fault}" for fault in self.faults] or ["no fault found"]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain numbers, strings, lists and dictionaries; None for NaN."""
        return {str(key): _plain(value) for key, value in asdict(self).items()}

    def to_json(self) -> str:
        """Return the report as JSON."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False)


def _row(each: ChannelCheck) -> str:
    level = f"{each.rms_db:7.1f}" if each.rms_db > SHOWN_DB else "      -"
    agreement = f"{each.agreement:9.2f}" if np.isfinite(each.agreement) else "        -"
    return (
        f"{each.channel:7d} {level} {each.offset:10.3g} {100 * each.clipped:10.2f} "
        f"{100 * each.hum:6.0f}  {agreement}  {each.state}"
    )


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value
