"""Views of a run that is going on: page, terminal, JSON lines."""

from __future__ import annotations

import sys
import time
import webbrowser
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import cache, partial
from types import TracebackType
from typing import Any, Self, TextIO

import numpy as np

from arrivals.files import open_live
from arrivals.live.beam import StepBeam, channel_levels
from arrivals.live.input.lag import LagMeter
from arrivals.live.json_lines import json_line
from arrivals.live.options import LiveOptions
from arrivals.live.page.server import PageServer
from arrivals.live.steps import LiveScene, LiveStep, Rays, StepHistory
from arrivals.live.terminal import TerminalView, has_colours
from arrivals.measurement_models import ArraySnapshot
from arrivals.messages import in_line
from arrivals.trackers import Estimate, Tracker

SPACING = 0.02  # s between the steps that are drawn; JSON lines have all


class LiveViews:
    """Views of one run; they show its steps and change nothing in it.

    Parameters
    ----------
    options : LiveOptions
        What is to be shown, and where.
    errors : text file, optional
        For messages and the terminal view; standard error if None.
    """

    def __init__(self, options: LiveOptions, errors: TextIO | None = None) -> None:
        self.options = options
        self.server: PageServer | None = None
        self._errors = sys.stderr if errors is None else errors
        self._history = StepHistory()
        self._shows: list[Callable[[LiveStep], object]] = []  # every step
        self._draws: list[Callable[[LiveStep], object]] = []  # steps that are far enough apart
        self._beam: StepBeam | None = None
        self._lag: LagMeter | None = None
        self._stack = ExitStack()
        self._drawn_at, self._finished = -np.inf, np.nan

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self._stack.close()

    @property
    def are_shown(self) -> bool:
        """True if there is a view that shows steps."""
        return bool(self._shows or self._draws)

    @property
    def replaces_table(self) -> bool:
        """True if no table of tracks is printed: its place is taken by a view."""
        drawn = self.options.terminal and sys.stdout.isatty()
        return bool(drawn or self.options.json_lines == "-")

    def open(
        self,
        scene: LiveScene,
        tracker: Tracker,
        *,
        measurement: ArraySnapshot | None = None,
        lag: LagMeter | None = None,
    ) -> None:
        """Open the views before the first step; one that cannot be opened is left out with a line.

        Parameters
        ----------
        scene : LiveScene
            The run.
        tracker : Tracker
            Its estimates have the columns of the table.
        measurement : ArraySnapshot, optional
            Array and wavelengths of the beam power.
        lag : LagMeter, optional
            Lag behind a live source.

        """
        self._lag = lag
        if lag is not None:
            self._stack.callback(lag.close)
        if self.options.json_lines == "-":
            self._shows.append(lambda step: (sys.stdout.write(json_line(step)), sys.stdout.flush()))
        elif self.options.json_lines:
            # the first step creates the file
            path = self.options.json_lines
            file = cache(lambda: self._stack.enter_context(open_live(path)))
            self._shows.append(
                lambda step: (file().write(json_line(step).encode()), file().flush())
            )
        if measurement is not None and (self.options.serve or self.options.terminal):
            self._beam = StepBeam(measurement)
            degrees = tuple(np.rad2deg(self._beam.doa).tolist())
            scene = replace(scene, directions_deg=degrees)
        if self.options.terminal:
            write = partial(print, end="", file=self._errors, flush=True)
            self._draws.append(TerminalView(scene, write, has_colours(self._errors)).show)
        if self.options.serve:
            self._open_page(scene, type(tracker.estimate).columns)

    def watch(
        self, tracker: Tracker, steps: Iterable[tuple[float, Any]], every: int = 1
    ) -> Iterator[tuple[float, Any]]:
        """Yield steps, and show the estimate of each when the next one is asked for.

        Parameters
        ----------
        tracker : Tracker
            Has been updated by a step when the next one is asked for.
        steps : iterable of (float, object)
            Times, s, and measurements.
        every : int
            Number of steps per row of the table.

        Yields
        ------
        (float, object)
            The steps.
        """
        for n, (at, z) in enumerate(steps, start=1):
            yield at, z
            if n % every == 0:
                self.show(n // every - 1, at, tracker.estimate, z)

    def show(
        self, number: int, at: float, estimate: Estimate, z: Any = None, rays: Rays = ()
    ) -> None:
        """Show a step.

        Parameters
        ----------
        number : int
            Number of its row of the table, from 0.
        at : float
            Time, s.
        estimate : Estimate
            Estimate after the step.
        z : ndarray, optional
            Snapshots, for the beam power.
        rays : tuple of (float, float, float)
            Bearings, as in `LiveStep`.
        """
        if not self.are_shown:
            return
        now = time.monotonic()
        lag = np.nan if self._lag is None else self._lag.lag
        elapsed, self._finished = now - self._finished, now
        step = LiveStep(number, at, estimate, lag, elapsed, rays=rays)
        for show in self._shows:
            show(step)
        if not self._draws or at < self._drawn_at + SPACING:
            return
        self._drawn_at = at
        if self._beam is not None:
            beam_db, channel_db = self._beam.level_db(z), channel_levels(z)
            step = replace(step, beam_db=beam_db, channel_db=channel_db)
        for draw in self._draws:
            draw(step)

    def close(self) -> None:
        """Say that the run has ended; the page stays until an interrupt."""
        self._history.ended = True
        if self.server is None:
            return
        sys.stdout.flush()  # the table, which another program may wait for
        with suppress(KeyboardInterrupt):
            self._say(f"the run has ended; {self.server.url} stays until Ctrl-C")
            wait_for_interrupt()
        self._say("the page is closed")

    def _open_page(self, scene: LiveScene, columns: tuple[str, ...]) -> None:
        host, port = self.options.address
        try:
            self.server = PageServer(self._history, scene, columns, host, port)
        except (ImportError, OSError, UnicodeError) as error:  # one of a name that is no host
            self._say(f"warning: no page at {host}:{port}: {in_line(error)}")
            return
        self._stack.callback(self.server.close)
        self._draws.append(self._history.append)
        self._say(f"page: {self.server.url}")
        if self.options.browser and not _opened(self.server.url):
            self._say(f"warning: no browser was found: open {self.server.url}")

    def _say(self, text: str) -> None:
        print(f"arrivals: {text}", file=self._errors, flush=True)


def wait_for_interrupt() -> None:
    """Wait for Ctrl-C, which raises a KeyboardInterrupt."""
    while True:
        time.sleep(1.0)


def _opened(url: str) -> bool:
    """Open an address in a browser; return False if there is none."""
    try:
        return webbrowser.open(url)
    except webbrowser.Error:
        return False
