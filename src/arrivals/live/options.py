"""Options of the command line about live views and live input."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

from arrivals.live.input.lag import LATE
from arrivals.live.page.server import LOOPBACK, PORT, server_address

Add = Callable[..., object]


@dataclass(frozen=True)
class LiveOptions:
    """Views of a run.

    Parameters
    ----------
    serve : str, optional
        PORT or HOST:PORT of a page; none if None.
    browser : bool
        True to open the page in a browser.
    terminal : bool
        True to draw in the terminal.
    json_lines : str, optional
        File of JSON lines, or `-` for standard output.

    Raises
    ------
    ValueError
        If they contradict each other.

    Examples
    --------
    >>> LiveOptions(serve="8080").address
    ('127.0.0.1', 8080)
    """

    serve: str | None = None
    browser: bool = False
    terminal: bool = False
    json_lines: str | None = None

    def __post_init__(self) -> None:
        self.address  # noqa: B018  (refuses another form)
        if self.browser and not self.serve:
            raise ValueError("--browser requires --serve")

    @classmethod
    def of(cls, arguments: argparse.Namespace) -> LiveOptions:
        """Return the options of parsed arguments.

        Parameters
        ----------
        arguments : argparse.Namespace
            With the options of `add_views`.

        Returns
        -------
        LiveOptions
        """
        return cls(arguments.serve, arguments.browser, arguments.live, arguments.jsonl)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port of the page."""
        return (LOOPBACK, PORT) if self.serve is None else server_address(self.serve)


def add_views(option: Add) -> None:
    """Add the options of views.

    Parameters
    ----------
    option : callable
        Adds an argument, as `argparse.ArgumentParser.add_argument`.
    """
    option("--serve", nargs="?", const=str(PORT), metavar="[HOST:]PORT",
           help="show the tracks as they come on a page of this computer, "
                f"http://{LOOPBACK}:{PORT} without a port")  # fmt: skip
    option("--browser", action="store_true", help="open that page in a browser")
    option("--live", action="store_true",
           help="draw coarsely in the terminal, on standard error")  # fmt: skip
    option("--jsonl", metavar="FILE",
           help="write a JSON object for each step; - for standard output, without the "
                "table")  # fmt: skip


def add_live_input(option: Add) -> None:
    """Add the options of live input.

    Parameters
    ----------
    option : callable
        Adds an argument, as `argparse.ArgumentParser.add_argument`.
    """
    option("--device", metavar="NAME",
           help="record from an audio device, by its name or number, in place of FILE")  # fmt: skip
    option("--late", choices=LATE,
           help="what is done with steps that are half a second behind a live source: wait "
                "(track them all), or drop (count as missing)")  # fmt: skip
