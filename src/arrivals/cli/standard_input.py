"""Streams: raw samples and WAV on standard input, audio devices; other formats are copied."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any, BinaryIO, cast

from arrivals.cli.models import n_stream_channels
from arrivals.cli.outputs import refuse
from arrivals.live.input.device import DTYPE, device_input
from arrivals.live.input.timed_input import TimedInput
from arrivals.measurement_models import SensorArray
from arrivals.messages import shown
from arrivals.recordings.formats.registry import READERS
from arrivals.recordings.formats.wav import is_wav, wav_header
from arrivals.recordings.raw_numbers import DTYPES, Replay

HEAD = 128  # bytes by which a format is recognised
NAME = "standard input"


@contextmanager
def stream_input(arguments: argparse.Namespace, array: SensorArray) -> Iterator[None]:
    """Set the source of arguments with `-` for the file, or a device, while the command runs.

    The header of a WAV stream sets `rate`, `channels` and `dtype`; `source` begins with the
    samples. Other formats are copied to a temporary file, whose name replaces `-`. Anything else
    is raw samples.

    Parameters
    ----------
    arguments : argparse.Namespace
        Arguments of `arrivals track`; gets `source`, and `received`, the input that knows when its
        bytes were received; None for files.
    array : SensorArray
        The array, which has as many channels as the stream unless `--channels` is given.

    Raises
    ------
    ValueError
        If arguments contradict the header, or are for standard input alone; or if it is text.
    """
    arguments.source = arguments.received = None
    if arguments.device is not None:
        with _device(arguments, array):
            yield
        return
    if arguments.file is None:
        raise ValueError("FILE must be given, or - for standard input, or --device NAME; got none")
    if arguments.file != "-":
        refuse(arguments, ("dtype",), "requires samples from standard input")
        refuse(arguments, ("late",), "requires standard input or --device")
        yield
        return
    with closing(TimedInput(sys.stdin.buffer)) as received, _stream(arguments, received):
        yield


@contextmanager
def _stream(arguments: argparse.Namespace, received: TimedInput) -> Iterator[None]:
    """Set the source of the arguments to standard input, or copy it to a file."""
    arguments.received = received
    head = received.read(HEAD)
    source = cast(BinaryIO, Replay(head, cast(BinaryIO, received)))
    known = next((reader for reader in READERS if reader.takes(head)), None)
    if known is None and len(head) == HEAD and head.isascii() and _is_text(head.decode("ascii")):
        raise ValueError(f"{NAME} is text, not samples: write it to a file, and pass its name")
    if known is None:
        arguments.source = source
        yield
        return
    seen = _Recorder(source)
    if is_wav(head) and _takes_header(arguments, seen):
        yield
        return
    left_out = f"must be left out: {NAME} is a {known.name} file"
    refuse(arguments, ("dtype", "channels", "late"), left_out)
    with tempfile.TemporaryDirectory() as folder:
        arguments.source_name = NAME  # the copy's own is of no use to a reader
        arguments.file = os.path.join(folder, f"input{known.suffixes[0]}")
        with open(arguments.file, "wb") as copy:
            shutil.copyfileobj(cast(BinaryIO, Replay(seen.bytes, source)), copy)
        try:
            yield
        except (ValueError, OSError) as error:
            raise ValueError(str(error).replace(arguments.file, NAME)) from error


@contextmanager
def _device(arguments: argparse.Namespace, array: SensorArray) -> Iterator[None]:
    """Set the source of the arguments to a device, as if it were standard input."""
    if arguments.file is not None:
        raise ValueError(f"FILE must be left out with --device; got {shown(arguments.file)}")
    refuse(arguments, ("dtype", "center"), "requires samples from standard input")
    n_channels = n_stream_channels(arguments.channels, array)
    with device_input(arguments.device, n_channels, arguments.rate) as (source, rate):
        arguments.file, arguments.dtype, arguments.rate = "-", DTYPE, rate
        arguments.channels = n_channels
        arguments.source = arguments.received = source
        yield


def _is_text(head: str) -> bool:
    return "".join(head.split()).isprintable()


class _Recorder:
    """Source that keeps the bytes that were read."""

    def __init__(self, source: BinaryIO) -> None:
        self.source, self.bytes = source, b""

    def read(self, size: int) -> bytes:
        """Return the next bytes."""
        block = self.source.read(size)
        self.bytes += block
        return block


def _takes_header(arguments: argparse.Namespace, source: Any) -> bool:
    """Set rate, channels, type and source from a WAV header; False if they cannot be live."""
    try:
        form, _, size = wav_header(source)
    except ValueError as error:
        raise ValueError(f"{NAME}: {error}") from error
    dtype = next((name for name, kind in DTYPES.items() if kind == form.kind), None)
    if dtype is None:
        return False
    for name, value in {"rate": form.rate, "channels": form.n_channels, "dtype": dtype}.items():
        given = getattr(arguments, name)
        if given not in (None, value):
            raise ValueError(
                f"--{name} must be {value}, as in the header of {NAME}; got {given}: leave it out"
            )
        setattr(arguments, name, value)
    arguments.source = Replay(b"", source.source, size)
    return True
