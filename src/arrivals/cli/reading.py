"""Recordings of the command line: options that concern their files, and how they are read."""

from __future__ import annotations

import argparse
from typing import Any

from arrivals.cli.models import printed_warnings
from arrivals.measurement_models import SensorArray
from arrivals.recordings.readers import read, read_channels
from arrivals.recordings.recording import Recording


class _Files(argparse.Action):
    """One file by its name, several by a list."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option: Any = None) -> None:
        if not values:
            return
        if len(values) > 1 and "-" in values:
            raise ValueError("standard input (-) must be the only file")
        setattr(namespace, self.dest, values[0] if len(values) == 1 else values)


def add_reading(option: Any, stream: str = "") -> None:
    """Add the files of a recording, and the options that concern them.

    Parameters
    ----------
    option : callable
        Adds an argument, as `argparse.ArgumentParser.add_argument`.
    stream : str
        Help about standard input, if it is read.
    """
    option("file", metavar="FILE", nargs="*" if stream else "+", action=_Files,
           help=f"recording; several files have the channels of one{stream}")  # fmt: skip
    add_file_options(option, "standard input or a raw file" if stream else "a raw file")


def add_file_options(option: Any, files: str = "a raw file") -> None:
    """Add the options that concern the files of recordings.

    Parameters
    ----------
    option : callable
        Adds an argument, as `argparse.ArgumentParser.add_argument`.
    files : str
        Files without a header, of which the number of channels is given.
    """
    option("--format", metavar="NAME",
           help="format of a file, in place of its suffix, such as cs16 of raw IQ")  # fmt: skip
    option("--rate", type=float, metavar="HZ",
           help="samples per second, if the file does not contain it")  # fmt: skip
    option("--center", type=float, metavar="HZ",
           help="centre frequency of complex samples (IQ), if the file does not contain "
                "it")  # fmt: skip
    option("--channels", type=int, metavar="N",
           help=f"number of channels of {files} (those of the array)")  # fmt: skip
    option("--variable", metavar="NAME", help="name of the array in a file of several")
    option("--transpose", action="store_true", help="rows of the file are channels")


def read_recording(
    arguments: argparse.Namespace, array: SensorArray | None, *, every_channel: bool = False
) -> Recording:
    """Return the recording of the files of the arguments.

    Parameters
    ----------
    arguments : argparse.Namespace
        With the options of `add_reading`.
    array : SensorArray or None
        Selects the channels of its sensors; the rate of real samples is required then.
    every_channel : bool
        True to return all channels, whether they fit the array or not.

    Returns
    -------
    Recording
    """
    form = arguments.format
    if arguments.channels is not None:
        form = f"{form or ''}:{arguments.channels}"
    given: dict[str, Any] = {
        "rate": arguments.rate, "variable": arguments.variable,
        "transpose": arguments.transpose, "format": form,
    }  # fmt: skip
    with printed_warnings():
        if every_channel:
            recording = read_channels(arguments.file, array, **given)
        else:
            recording = read(arguments.file, array=array, rate_required=True, **given)
    if arguments.center is not None and not recording.is_narrowband:
        raise ValueError("--center requires complex samples; got real ones: leave it out")
    return recording
