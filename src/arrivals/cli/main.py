"""Parser of the command line: track, check, demo, locate, fuse, reproduce, list."""

from __future__ import annotations

import argparse
import ast
import inspect
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NoReturn

import arrivals
from arrivals import scenarios
from arrivals.cli.check import add_check
from arrivals.cli.fuse import add_fuse
from arrivals.cli.locate import add_locate
from arrivals.cli.reading import add_reading
from arrivals.cli.track import track
from arrivals.live.options import add_live_input, add_views
from arrivals.measurement_models.arrays.presets import preset_names, preset_summary
from arrivals.messages import shown, similar
from arrivals.recordings.formats.iq import RAW_TYPES
from arrivals.recordings.raw_numbers import DTYPES
from arrivals.scenarios.demos.infrasound import infrasound
from arrivals.scenarios.demos.swellex96 import demo
from arrivals.scenarios.reproduce.studies import add_reproduce
from arrivals.trackers import available, find

DEMOS: dict[str, Callable[..., None]] = {"swellex96": demo, "brp2012": infrasound}


def run(argv: Sequence[str] | None = None) -> int:
    """Run the subcommand of the arguments, and return its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process if None.

    Returns
    -------
    int
        0, or 1 if `arrivals check` finds a fault.

    Raises
    ------
    ValueError, TypeError, OSError
        If an argument or a file is invalid.

    Examples
    --------
    >>> run(["track", "tow.wav"])
    Traceback (most recent call last):
    ValueError: the following arguments are required: --array (see arrivals track -h)
    """
    arguments = _parser().parse_args(argv)
    return int(arguments.command(arguments) or 0)


class _Parser(argparse.ArgumentParser):
    """Argument parser that raises errors as ValueError, with similar names."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(f"{message} (see {self.prog} -h)")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse unknown arguments where the options are known."""
        parsed, unknown = super().parse_known_args(args, namespace)
        if unknown:
            options = re.findall(r"--[a-z-]+", self.format_usage())
            hint = similar(unknown[0].partition("=")[0], options)
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
        return parsed, unknown

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        choices = [] if action.choices is None else list(action.choices)
        if choices and value not in choices:
            listed = f"must be one of {', '.join(map(str, choices))}; got {shown(value)}"
            raise argparse.ArgumentError(action, listed + similar(value, choices))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="arrivals",
        description="Track directions of arrival from the raw samples or snapshots of an array, "
        "or positions from signal strength.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"arrivals {arrivals.__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_track(commands)
    add_check(commands)
    _add_demo(commands)
    add_locate(commands, _bar)
    add_fuse(commands, _bar, _setting)
    add_reproduce(commands)
    listing = commands.add_parser("list", help="list trackers, arrays by name, and scenarios")
    listing.set_defaults(command=_list)
    return parser


def _add_track(commands: Any) -> None:
    add = commands.add_parser(
        "track",
        help="track directions through a recording or a stream",
        description="Track directions of arrival through a recording (WAV, FLAC and other audio, "
        "npy, npz, MATLAB, HDF5, CSV, SigMF and raw IQ, SIO, miniSEED), or through a WAV stream or "
        "raw interleaved samples from standard input. Frequencies, windows and tracker are chosen "
        "from array and recording (of a stream, its first 2 s) unless they are given; a line on "
        "standard error has the choice as options.",
        epilog="live: arecord -t wav -f S16_LE -r 48000 -c 8 | arrivals track - --array ARRAY.toml",
        allow_abbrev=False,
    )
    option = add.add_argument
    add_reading(option, "; - for samples from standard input, none with --device")
    option("--array", required=True, metavar="ARRAY",
           help="array file (TOML, JSON), or the name of a preset in `arrivals list`")  # fmt: skip
    option("--frequency", type=float, metavar="HZ", help="frequency of narrowband sources")
    option(
        "--frequencies",
        nargs="+",
        type=float,
        metavar="HZ",
        help="frequencies of the bins of each step",
    )
    option("--band", nargs=2, type=float, metavar=("F1", "F2"),
           help="Hz: all bins of the window in a band, or the band of a tracker of real "
                "samples")  # fmt: skip
    option("--snapshots", type=int, metavar="N",
           help="number of successive windows in one step (1 with --frequency)")  # fmt: skip
    option("--follow", type=float, metavar="HZ",
           help="largest shift of tones at --frequency, such as a Doppler shift: in each step "
                "the strongest frequency within it is used")  # fmt: skip
    option("--reduce", action="store_true",
           help="replace the complex samples of a step by eight a channel, of the same "
                "covariance")  # fmt: skip
    option("--unknowns", choices=("sphere", "range"),
           help="estimate azimuth and elevation, or direction and range")  # fmt: skip
    option("--nearest", type=float, metavar="M",
           help="distance of the nearest source, m, with --unknowns range")  # fmt: skip
    option(
        "--snr",
        type=float,
        default=0.0,
        metavar="DB",
        help="expected signal-to-noise ratio in the band (0)",
    )
    option("--tracker", metavar="NAME",
           help="name in `arrivals list` (wideband_mixture for speech and other wideband sources; "
                "svalse for narrowband ones, as with --frequency)")  # fmt: skip
    option("--set", action="append", default=[], type=_setting, metavar="NAME=VALUE",
           help="parameter of the tracker, such as motion__p_activate=0.2; repeatable")  # fmt: skip
    option("--out", metavar="CSV", help="write the tracks file (standard output)")
    option("--signals", metavar="WAV",
           help="write separated source signals (WAV or npy); needs a tracker that "
                "estimates signals")  # fmt: skip
    option("--plot", metavar="PNG", help="draw the tracks over the beam power")
    option("--normalize", choices=("run", "step"),
           help="beam power of --plot relative to the highest of the recording, or of each step, "
                "where quiet sources stay visible (run)")  # fmt: skip
    option("--window", type=int, metavar="N", help="length of a window, samples")
    option("--hop", type=int, metavar="N",
           help="samples between windows (the window), or between output lines of real "
                "samples (1)")  # fmt: skip
    option("--dtype", choices=(*DTYPES, *RAW_TYPES),
           help="sample type of raw standard input (int16)")  # fmt: skip
    add_live_input(option)
    add_views(option)
    option("--quiet", action="store_true", help="hide the progress bar")
    add.set_defaults(command=lambda arguments: track(arguments, _bar(_is_quiet(arguments))))


def _add_demo(commands: Any) -> None:
    texts = [(inspect.getdoc(show) or "").partition("\n\nParameters")[0] for show in DEMOS.values()]
    add = commands.add_parser(
        "demo",
        help="track shipped data by three methods: a towed source, or recorded infrasound",
        description="\n\n".join(f"{n}: {text}" for n, text in zip(DEMOS, texts, strict=True)),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add.add_argument("name", nargs="?", default="swellex96", choices=tuple(DEMOS),
                     help="(swellex96)")  # fmt: skip
    add.add_argument("--out", default="arrivals-demo", metavar="DIR", help="(arrivals-demo)")
    add.add_argument("--quiet", action="store_true", help="hide the progress bar")
    add.set_defaults(
        command=lambda arguments: DEMOS[arguments.name](arguments.out, _bar(arguments.quiet))
    )


def _setting(argument: str) -> tuple[str, Any]:
    """Return name and value of NAME=VALUE; a value that is not a Python literal is a string.

    Examples
    --------
    >>> _setting("motion__kappa=300"), _setting("reference=first")
    (('motion__kappa', 300), ('reference', 'first'))
    """
    name, equals, value = argument.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE; got {argument!r}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about escapes, as in a path of Windows
            return name, ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return name, value
    except (RecursionError, MemoryError):
        raise argparse.ArgumentTypeError(f"{name} must not be nested so deeply") from None


def _bar(quiet: bool) -> Callable[..., Any]:
    """Return tqdm on standard error, disabled if it is not a terminal."""
    from tqdm import tqdm

    return partial(tqdm, file=sys.stderr, disable=quiet or None, unit="step")


def _is_quiet(arguments: argparse.Namespace) -> bool:
    """Return True without a progress bar: on request, or with a live table on a terminal."""
    live = arguments.out is None and (arguments.file == "-" or arguments.device is not None)
    return bool(arguments.quiet or arguments.live or (live and sys.stdout.isatty()))


def _list(arguments: argparse.Namespace) -> None:
    kinds: list[tuple[str, Sequence[str], Callable[[str], str]]] = [
        ("trackers", available(), partial(_summary, find)),
        ("arrays", preset_names(), preset_summary),
        ("scenarios", scenarios.available(), partial(_summary, scenarios.find)),
    ]
    for noun, names, summary in kinds:
        if names:
            print(noun)
        for name in names:
            print(f"  {name:<{max(map(len, names))}}  {summary(name)}")


def _summary(find_kind: Callable[[str], type], name: str) -> str:
    """Return the first line of the docstring, or the error of an entry point that fails to load."""
    try:
        return (inspect.getdoc(find_kind(name)) or "").partition("\n")[0]
    except Exception as error:
        return f"(cannot be loaded: {error})"
