"""Samples of an audio device, by sounddevice."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from arrivals.live.input.timed_input import TimedInput
from arrivals.messages import in_line, shown

DTYPE = "float32"
BLOCK = 0.02  # s that are read at once


@contextmanager
def device_input(
    name: str,
    n_channels: int,
    rate: float | None = None,
    report: Callable[[str], object] | None = None,
) -> Iterator[tuple[TimedInput, float]]:
    """Record from an audio device until the end of the context.

    Parameters
    ----------
    name : str
        Part of its name, or its number.
    n_channels : int
        Number of channels.
    rate : float, optional
        Samples per second, Hz; the usual one of the device if None.
    report : callable, optional
        Receives a message when samples are lost; it is printed on standard error if None.

    Yields
    ------
    source : TimedInput
        Interleaved float32 samples.
    rate : float
        Samples per second, Hz.

    Raises
    ------
    ValueError
        If the device does not exist, or does not have such channels or such a rate; if sounddevice,
        or the library PortAudio, is not installed.
    OSError
        If it fails while it records.
    """
    package = _sounddevice()
    device: int | str = int(name) if name.isascii() and name.isdigit() else name
    try:
        usual = package.query_devices(device, "input")["default_samplerate"]
        rate = float(usual if rate is None else rate)
        stream = package.RawInputStream(
            samplerate=rate, device=device, channels=n_channels, dtype=DTYPE
        )
        stream.start()
    except (ValueError, OverflowError, package.PortAudioError) as error:
        raise ValueError(
            f"--device must be an input with {n_channels} channels; got {shown(name)}: "
            f"{in_line(error)}"
        ) from error
    size = max(1, round(BLOCK * rate))
    source = TimedInput(_DeviceSamples(stream, size, report, package.PortAudioError))
    try:
        yield source, rate
    finally:
        source.close()
        source.join(1.0)
        with suppress(package.PortAudioError):  # of a device that is gone
            stream.stop()
            stream.close()


class _DeviceSamples:
    """Blocks of samples of a stream of sounddevice, with one message if some are lost."""

    def __init__(
        self,
        stream: Any,
        size: int,
        report: Callable[[str], object] | None,
        failure: type[Exception],
    ) -> None:
        self._stream, self._size, self._reported, self._failure = stream, size, False, failure
        self._report = report or (lambda text: print(f"arrivals: warning: {text}", file=sys.stderr))

    def read1(self, _: int) -> bytes:
        """Return the next block."""
        try:
            samples, overflowed = self._stream.read(self._size)
        except self._failure as error:
            raise OSError(f"the device has failed: {in_line(error)}") from error
        if overflowed and not self._reported:
            self._reported = True
            self._report("the device has lost samples: times are too early from here on")
        return bytes(samples)


def _sounddevice() -> Any:
    """Return sounddevice, or raise a ValueError with the cure."""
    try:
        import sounddevice
    except ImportError as error:
        raise ValueError('--device requires sounddevice: pip install "arrivals[device]"') from error
    except OSError as error:  # the library that it calls
        raise ValueError(f"--device requires the library PortAudio: {in_line(error)}") from error
    return sounddevice
