"""Outputs of the subcommands: checks before the work, tables, pictures, live lines."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

from arrivals.cli.separated_signals import check_suffix
from arrivals.trackers.run import Run, header, text

Bar: TypeAlias = Callable[..., Any]


def check_outputs(arguments: argparse.Namespace) -> None:
    """Raise an error for outputs that cannot be written, before the work begins."""
    from arrivals.plots.bearing_time import picture_format

    outputs = arguments.out, arguments.plot, arguments.signals
    files = [name for name in (arguments.array, arguments.file, *outputs) if name and name != "-"]
    if len({Path(name).resolve() for name in files}) < len(files):
        raise ValueError("FILE, --array, --out, --plot and --signals must be different files")
    for name in filter(None, outputs):
        folder = Path(name).parent
        if not folder.is_dir():
            raise FileNotFoundError(2, "the folder does not exist", str(folder))
        if Path(name).is_dir():
            raise IsADirectoryError(21, "this is a folder", name)
        if not os.access(folder, os.W_OK):
            raise PermissionError(13, "the folder may not be written to", str(folder))
    if arguments.plot:
        picture_format(arguments.plot)
    if arguments.signals:
        check_suffix(arguments.signals)


def refuse(arguments: argparse.Namespace, names: Iterable[str], reason: str) -> None:
    """Raise a ValueError if one of these arguments is set."""
    for name in names:
        if getattr(arguments, name):
            raise ValueError(f"--{name} {reason}")


def write_table(result: Run, path: str | None) -> None:
    """Write the tracks file, to standard output without a path."""
    if path:
        result.to_csv(path)
        return
    sys.stdout.write(",".join(header(result.kind)) + "\n")
    for row in result.rows():
        sys.stdout.write(",".join(text(row)) + "\n")


def draw(path: str | None, result: Run, **picture: Any) -> None:
    """Draw the tracks over time to a file, if there is a path."""
    if path:
        from arrivals.plots.bearing_time import plot_bearing_time, save

        save(plot_bearing_time(result, **picture), path)


@contextmanager
def live_output(path: str | None) -> Iterator[Callable[[str], object]]:
    """Return a function that writes lines at once; the first ones create the file."""
    if path is None:
        yield lambda lines: (sys.stdout.write(lines), sys.stdout.flush())
        return
    with ExitStack() as stack:
        opened = cache(lambda: stack.enter_context(open(path, "wb", buffering=0)))
        yield lambda lines: opened().write(lines.encode())
