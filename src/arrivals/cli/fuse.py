"""`arrivals fuse`: positions from several arrays on one map, as a table and a map."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

from arrivals.cli.outputs import check_different, draw, write_table
from arrivals.cli.reading import add_file_options
from arrivals.files import check_output
from arrivals.live.fused import watch_fused
from arrivals.live.options import LiveOptions, add_views
from arrivals.live.views import LiveViews
from arrivals.recordings.fusion.fusing import fuse
from arrivals.recordings.fusion.stations_file import read_stations

# options whose names are those of arguments of `fuse`
NAMES = (
    "tracker", "frequency", "frequencies", "band", "window", "hop", "snapshots", "reduce",
    "follow", "rate", "center", "format", "channels", "variable", "transpose", "area", "speed", "q",
    "step", "wave_speed", "alpha", "sigma", "floor", "r_min", "power", "power_std", "missing",
)  # fmt: skip


def add_fuse(
    commands: Any,
    bar: Callable[[bool], Callable[..., Any]],
    setting: Callable[[str], tuple[str, Any]],
) -> None:
    """Add `arrivals fuse` to the subparsers of the command line.

    Parameters
    ----------
    commands : object
        Subparsers.
    bar : callable
        Returns tqdm, or a disabled one if True is given.
    setting : callable
        Returns name and value of NAME=VALUE.
    """
    add = commands.add_parser(
        "fuse",
        help="locate sources by several arrays on one map",
        description="Locate and track sources by the directions at several arrays, and by signal "
        "strength. The stations file has places, headings, arrays and recordings, and options of "
        "this command by their names. Frequencies, windows and tracker are chosen as `arrivals "
        "track` does unless they are given; a line on standard error has the choice.",
        allow_abbrev=False,
    )
    option = add.add_argument
    option("stations", metavar="STATIONS", help="stations file, TOML")
    option("files", metavar="FILE", nargs="*",
           help="recording of each station with an array, in the order of the stations file (those "
                "named there)")  # fmt: skip
    option("--bearings", metavar="CSV", nargs="+",
           help="tables of ready-made bearings: time_s, station, bearing_deg, std_deg (3 degrees); "
                "or logs of KrakenSDR's app")  # fmt: skip
    option("--step", type=float, metavar="S",
           help="duration of a step of bearings (from the times)")  # fmt: skip
    option("--rss", metavar="CSV", help="readings of signal strength, as of `arrivals locate`")
    option("--sensors", metavar="CSV", help="table of their sensors: name, x_m, y_m or lat, lon")
    _add_tracking(option, setting)
    _add_sources(option)
    add_file_options(option)
    option("--out", metavar="CSV", help="tracks file (standard output)")
    option("--plot", metavar="PNG", help="map with 95 %% error ellipses")
    add_views(option)
    option("--quiet", action="store_true", help="no progress bar, no line about the choice")
    add.set_defaults(
        command=lambda arguments: run_fuse(arguments, bar(arguments.quiet or arguments.live))
    )


def _add_tracking(option: Any, setting: Callable[[str], tuple[str, Any]]) -> None:
    """Add the options of the trackers of directions, those of `arrivals track`."""
    option("--frequency", type=float, metavar="HZ", help="frequency of narrowband sources")
    option("--frequencies", nargs="+", type=float, metavar="HZ", help="frequencies of the bins")
    option("--band", nargs=2, type=float, metavar=("F1", "F2"), help="all bins in a band, Hz")
    option("--window", type=int, metavar="N", help="length of a window, samples")
    option("--hop", type=int, metavar="N", help="samples between windows (the window)")
    option("--snapshots", type=int, metavar="N", help="successive windows, or snapshots, in a step")
    option("--follow", type=float, metavar="HZ", help="largest shift of tones at --frequency")
    option("--reduce", action="store_true", default=None,
           help="replace the complex samples of a step by eight a channel")  # fmt: skip
    option("--tracker", metavar="NAME", help="tracker of directions, in `arrivals list`")
    option("--set", action="append", default=[], type=setting, metavar="NAME=VALUE",
           help="parameter of the fusion, such as detection__clutter=0.5, or of the trackers of "
                "directions; repeatable")  # fmt: skip


def _add_sources(option: Any) -> None:
    """Add the options of sources, and of signal strength, those of `arrivals locate`."""
    option("--area", nargs=4, type=float, metavar=("X0", "Y0", "X1", "Y1"),
           help="area of the sources, m (around the stations)")  # fmt: skip
    option("--speed", type=float, metavar="M/S",
           help="standard deviation of the speed (a hundredth of the area a second)")  # fmt: skip
    option("--q", type=float, metavar="Q", help="acceleration noise, m²/s³ (speed² / 100 s)")
    option("--wave-speed", type=float, metavar="M/S",
           help="speed of waves whose travel time counts (none)")  # fmt: skip
    option("--alpha", type=float, metavar="A", help="loss exponent (2)")
    option("--sigma", type=float, metavar="DB", help="shadowing (6)")
    option("--floor", type=float, metavar="DB", help="noise floor, required with --rss")
    option("--r-min", type=float, metavar="M", help="floor of the range")
    option("--power", type=float, metavar="DB", help="level of a source at 1 m (from readings)")
    option("--power-std", type=float, metavar="DB", help="its standard deviation (3, or 10)")
    option("--missing", type=float, nargs="+", metavar="DB",
           help="levels that stand for a missing reading")  # fmt: skip


def run_fuse(arguments: argparse.Namespace, bar: Callable[..., Any]) -> None:
    """Locate sources by the stations of a file and write the results.

    Parameters
    ----------
    arguments : argparse.Namespace
        Arguments of `arrivals fuse`.
    bar : callable
        Wraps the steps with a progress bar, as tqdm does.

    Raises
    ------
    ValueError, TypeError, OSError
        If the arguments or the files are invalid; nothing has been written then.
    """
    stations = read_stations(arguments.stations)
    _check_outputs(arguments, stations.files)
    given = {name: getattr(arguments, name) for name in NAMES}
    options = {name: value for name, value in given.items() if value is not None and value != []}
    if arguments.transpose is False:
        options.pop("transpose")
    settings = dict(arguments.set)
    doubled = [name for name in NAMES if name in settings]
    if doubled:
        option = doubled[0].replace("_", "-")
        raise ValueError(f"--set must not have options; got {doubled[0]}: pass --{option}")
    with LiveViews(LiveOptions.of(arguments)) as views:
        fused = fuse(
            stations,
            arguments.files or None,
            bearings=arguments.bearings,
            rss=arguments.rss,
            sensors=arguments.sensors,
            progress=bar,
            watch=lambda tracker, steps: watch_fused(views, arguments.stations, tracker, steps),
            **options,
            **settings,
        )
        if not arguments.quiet:
            print(f"arrivals: {fused.understood}", file=sys.stderr)
        write_table(fused, arguments.out, printed=not views.replaces_table)
        draw(arguments.plot, fused)
        views.close()


def _check_outputs(arguments: argparse.Namespace, files: tuple[str, ...]) -> None:
    """Raise an error before the computation if an output cannot be written, or is an input."""
    from arrivals.plots.bearing_time import picture_format

    lines = None if arguments.jsonl == "-" else arguments.jsonl
    outputs = [each for each in (arguments.out, arguments.plot, lines) if each]
    inputs = [*files, *arguments.files, *(arguments.bearings or ())]
    inputs += [each for each in (arguments.rss, arguments.sensors) if each]
    words = "outputs, and the files that are read,"
    check_different(words, *outputs)
    for one in outputs:
        for other in inputs:
            check_different(words, one, other)
        check_output(one)
    if arguments.plot:
        picture_format(arguments.plot)
