"""`arrivals check`: check the channels, the wiring and the size of the array of a recording."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from arrivals.cli.models import printed_warnings
from arrivals.cli.outputs import check_different, input_files
from arrivals.cli.reading import add_reading, read_recording
from arrivals.files import atomic_write, check_output
from arrivals.measurement_models.arrays.files import given_array
from arrivals.recordings.check import check


def add_check(commands: Any) -> None:
    """Add the subcommand `check`.

    Parameters
    ----------
    commands : object
        Subparsers of the command line.
    """
    add = commands.add_parser(
        "check",
        help="check channels, wiring and size of the array of a recording",
        description="Check a recording: level, clipping, silence and hum of each channel; with "
        "an array, agreement of each channel with the beam of the others, inverted, swapped and "
        "late channels, and the size of the array. The exit status is 1 if there is a fault.",
        allow_abbrev=False,
    )
    option = add.add_argument
    add_reading(option)
    option("--array", metavar="ARRAY", help="array file, or name of a preset (none: levels alone)")
    option("--json", action="store_true", help="print numbers, faults and notes as JSON")
    option("--out", metavar="FILE", help="write the report to a file (standard output)")
    option("--frequency", type=float, metavar="HZ", help="frequency of complex snapshots")
    add.set_defaults(command=check_recording)


def check_recording(arguments: argparse.Namespace) -> int:
    """Check the recording of the arguments, and return the exit status.

    Parameters
    ----------
    arguments : argparse.Namespace
        Arguments of `arrivals check`.

    Returns
    -------
    int
        1 if there is a fault, else 0.
    """
    if arguments.out:
        check_different("--out, the recording and the array file", arguments.out, arguments.array,
                        *input_files(arguments))  # fmt: skip
        check_output(arguments.out)
    if arguments.file == "-":
        raise ValueError("FILE must be a file, not standard input: write the samples to one")
    if arguments.frequency is not None and arguments.center is not None:
        raise ValueError("pass only one of --frequency and --center")
    frequency = arguments.frequency if arguments.center is None else arguments.center
    array = given_array(arguments.array)
    recording = read_recording(arguments, array, every_channel=True)
    with printed_warnings():
        report = check(recording, array, frequency=frequency)
    text = (report.to_json() if arguments.json else str(report)) + "\n"
    if arguments.out:
        with atomic_write(arguments.out) as file:
            file.write(text)
    else:
        sys.stdout.write(text)
    return int(bool(report.faults))
