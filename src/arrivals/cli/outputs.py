"""Outputs of the subcommands: checks before the work, tables, pictures, live lines."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from itertools import combinations
from typing import Any, TypeAlias

from arrivals.cli.separated_signals import check_suffix
from arrivals.files import check_output, open_live
from arrivals.trackers.run import Run, text

Bar: TypeAlias = Callable[..., Any]


def check_outputs(arguments: argparse.Namespace) -> None:
    """Raise an error for outputs that cannot be written, before the work begins."""
    from arrivals.plots.bearing_time import picture_format

    outputs = arguments.out, arguments.plot, arguments.signals, arguments.jsonl
    check_different("FILE, --array, --out, --plot, --signals and --jsonl",
                    arguments.array, *input_files(arguments), *outputs)  # fmt: skip
    for name in outputs:
        if name and (name != "-" or name != arguments.jsonl):
            check_output(name)
    if arguments.plot:
        picture_format(arguments.plot)
    elif arguments.normalize:
        raise ValueError("--normalize requires --plot: it sets the beam power of the picture")
    if arguments.signals:
        check_suffix(arguments.signals)


def input_files(arguments: argparse.Namespace) -> list[str]:
    """Return the names of the recording's files."""
    return [arguments.file] if isinstance(arguments.file, str) else list(arguments.file or ())


def check_different(words: str, *names: str | None) -> None:
    """Raise a ValueError if two of the names, but for None and `-`, are those of one file."""
    files = [name for name in names if name and name != "-"]
    if any(same_file(one, other) for one, other in combinations(files, 2)):
        raise ValueError(f"{words} must be different files")


def same_file(one: str | os.PathLike[str], other: str | os.PathLike[str]) -> bool:
    """Return True if two names, of files that may not exist, are those of one file.

    Examples
    --------
    >>> same_file("a.csv", "./a.csv"), same_file("a.csv", "b.csv")
    (True, False)
    """
    try:
        return os.path.samefile(one, other)
    except OSError:
        return os.path.realpath(one) == os.path.realpath(other)


def refuse(arguments: argparse.Namespace, names: Iterable[str], reason: str) -> None:
    """Raise a ValueError if one of these arguments is set."""
    for name in names:
        if getattr(arguments, name):
            raise ValueError(f"--{name} {reason}")


def write_table(result: Run, path: str | None, *, printed: bool = True) -> None:
    """Write the tracks file, or print it without a path; say so if it has no row."""
    if next(iter(result.rows()), None) is None:
        print(f"arrivals: no source was found in {len(result)} steps", file=sys.stderr)
    if path:
        result.to_csv(path)
    if path or not printed:
        return
    sys.stdout.write(",".join(result.header) + "\n")
    for row in result.rows():
        sys.stdout.write(",".join(text(row)) + "\n")


def draw(path: str | None, result: Run, **picture: Any) -> None:
    """Draw the tracks to a file, if there is a path: over time, or on the sky."""
    if path:
        from arrivals.plots.bearing_time import save
        from arrivals.plots.runs import plot

        save(plot(result, **picture), path)


@contextmanager
def live_output(path: str | None, *, printed: bool = True) -> Iterator[Callable[[str], object]]:
    """Return a function that writes lines at once, or prints them; the first create the file."""
    if path is None:
        printing = lambda lines: (sys.stdout.write(lines), sys.stdout.flush())  # noqa: E731
        yield printing if printed else len
        return
    with ExitStack() as stack:
        opened = cache(lambda: stack.enter_context(open_live(path)))
        yield lambda lines: (opened().write(lines.encode()), opened().flush())
