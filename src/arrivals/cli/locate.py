"""`arrivals locate`: positions from readings of signal strength, as a table and a map."""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable
from typing import Any

from arrivals.cli.outputs import check_different
from arrivals.files import check_output
from arrivals.recordings.networks.locating import locate

# arguments of `locate` that are fields of its settings, and their options
SETTINGS = {
    "tracker": "tracker", "alpha": "alpha", "sigma_db": "sigma", "floor_db": "floor",
    "r_min": "r_min", "correlation_time": "tau", "power_db": "power", "power_std_db": "power_std",
    "speed": "speed", "q": "q",
}  # fmt: skip


def add_locate(commands: Any, bar: Callable[[bool], Callable[..., Any]]) -> None:
    """Add `arrivals locate` to the subparsers of the command line."""
    add = commands.add_parser(
        "locate",
        help="locate sources from readings of signal strength",
        description="Locate and track sources by readings of signal strength: a table with one row "
        "a reading (time, sensor, level) or one row a step (time and a column for each sensor), of "
        "one or of several devices; an npz file; or a log of WiGLE or Kismet. Columns are "
        "recognised by their usual names; a line on standard error has what was understood.",
        allow_abbrev=False,
    )
    option = add.add_argument
    option("file", metavar="READINGS", help="file with levels in dB or dBm")
    option("--sensors", metavar="CSV",
           help="table of sensors: name, x_m, y_m or name, lat, lon; not needed if each reading "
                "has a position")  # fmt: skip
    option("--sources", type=_number_of_sources, metavar="K",
           help="number of sources, of each device, or auto to estimate it (1 with one row a "
                "reading or with devices, else auto)")  # fmt: skip
    option("--group-by", metavar="COLUMN", help="column of the devices (device, station, tag ...)")
    option("--window", type=float, metavar="S",
           help="length of a step of a table with one row a reading (from the times)")  # fmt: skip
    option("--missing", type=_level, nargs="+", action="extend", default=[], metavar="DB",
           help="levels that stand for a missing reading, such as 100")  # fmt: skip
    option("--tracker", default="rss_vb", choices=("rss_vb", "rss_ml"), help="(rss_vb)")
    option("--alpha", type=float, metavar="A",
           help="loss exponent (from the readings; 2 if the number of sources is "
                "estimated)")  # fmt: skip
    option("--sigma", type=float, default=6.0, metavar="DB", help="shadowing (6)")
    option("--floor", type=float, metavar="DB", help="noise floor (none)")
    option("--power", type=float, metavar="DB", help="level of a source at 1 m (from readings)")
    option("--power-std", type=float, metavar="DB", help="its standard deviation (3, or 10)")
    option("--r-min", type=float, metavar="M", help="floor of the range")
    option(
        "--speed",
        type=float,
        default=1.5,
        metavar="M/S",
        help="standard deviation of the speed (1.5)",
    )
    option("--q", type=float, default=0.1, metavar="Q", help="acceleration noise, m²/s³ (0.1)")
    option("--tau", type=float, metavar="S", help="correlation time of the shadowing (none)")
    option("--out", metavar="CSV", help="positions file (standard output)")
    option("--plot", metavar="PNG", help="map with 95 %% error ellipses")
    option("--quiet", action="store_true", help="no progress bar, no line about the table")
    add.set_defaults(command=lambda arguments: run_locate(arguments, bar(arguments.quiet)))


def _level(argument: str) -> float:
    try:
        return float(argument)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be numbers; got {argument!r}: write READINGS before --missing"
        ) from None


def _number_of_sources(argument: str) -> int | str:
    try:
        return argument if argument == "auto" else int(argument)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number or auto; got {argument!r}") from None


def run_locate(arguments: argparse.Namespace, bar: Callable[..., Any]) -> None:
    """Locate sources by the readings of a file and write the results.

    Raises
    ------
    ValueError, TypeError, OSError
        If the arguments or the files are invalid; nothing has been written then.
    """
    _check_outputs(arguments)
    located = locate(
        arguments.file,
        arguments.sensors,
        group_by=arguments.group_by,
        window=arguments.window,
        missing=arguments.missing,
        n_sources=arguments.sources,
        progress=bar,
        **{name: getattr(arguments, option) for name, option in SETTINGS.items()},
    )
    if not arguments.quiet:
        print(f"arrivals: {located.understood}", file=sys.stderr)
    if arguments.out:
        located.to_csv(arguments.out)
    else:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(located.header)
        writer.writerows(located.rows())
    if arguments.plot:
        from arrivals.plots.bearing_time import save
        from arrivals.plots.runs import plot

        save(plot(located), arguments.plot)


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Raise an error before the computation if an output cannot be written."""
    from arrivals.plots.bearing_time import picture_format

    outputs = arguments.out, arguments.plot
    check_different("READINGS, --sensors, --out and --plot",
                    arguments.file, arguments.sensors, *outputs)  # fmt: skip
    for name in filter(None, outputs):
        check_output(name)
    if arguments.plot:
        picture_format(arguments.plot)
