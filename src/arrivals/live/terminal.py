"""Coarse drawing of a run in a terminal: a line every quarter of a second."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import pairwise
from typing import TextIO

import numpy as np

from arrivals.live.steps import LiveScene, LiveStep

SPACING = 0.25  # s between lines
N_CELLS = 60  # of a strip of directions
SHADES = " .:-=+*#"  # beam power, from the lowest shown to the highest
ASCII_RANGE_DB = 6.0  # beam power shown
COLOURS = (31, 34, 33, 32, 35, 36, 91, 94, 93, 92)  # codes of the colours of labels
MAX_LISTED = 6  # sources at the end of a line


def has_colours(stream: TextIO) -> bool:
    """Return True if a stream is a terminal that shows colours.

    Examples
    --------
    >>> import io
    >>> has_colours(io.StringIO())
    False
    """
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM", "dumb") == "dumb"
    return stream.isatty() and not plain


class TerminalView:
    """Lines about the steps of a run: time, a strip of directions, the sources.

    Parameters
    ----------
    scene : LiveScene
        The run.
    write : callable
        Receives text.
    colours : bool
        True to colour labels.

    Examples
    --------
    >>> from arrivals.trackers import DirectionEstimate
    >>> lines = []
    >>> view = TerminalView(LiveScene("tow.wav, cbf", line=True), lines.append, False)
    >>> view.show(LiveStep(0, 0.5, DirectionEstimate.empty()))
    >>> lines[-1].split()
    ['0.5', '|', '|']
    """

    def __init__(self, scene: LiveScene, write: Callable[[str], object], colours: bool) -> None:
        self._scene, self._write, self._colours = scene, write, colours
        self._due = -np.inf
        self._limit = 90 if scene.line else 180

    def show(self, step: LiveStep) -> None:
        """Write the line of a step, if it is due."""
        if step.time < self._due:
            return
        if self._due == -np.inf:
            self._write(self._heading())
        self._due = step.time + SPACING
        strip = "" if self._scene.kind == "map" else f" |{self._strip(step)}|"
        late = f"  {step.lag:.1f} s late" if step.lag > 0.5 else ""
        self._write(f"{step.time:9.1f}{strip}  {self._sources(step)}{late}".rstrip() + "\n")

    def _heading(self) -> str:
        """Return the title of the run, and the ends of the strip."""
        heading = f"{self._scene.title}\n"
        if self._scene.kind == "map":
            return heading
        low, high = f"-{self._limit}", f"{self._limit}"
        middle = f"{0:^{N_CELLS - len(low) - len(high)}}"
        return f"{heading}{'time, s':>9}  {low}{middle}{high}  degrees\n"

    def _strip(self, step: LiveStep) -> str:
        """Return the cells of the strip: shades of beam power, and the last digits of labels."""
        cells = [" "] * N_CELLS
        if step.beam_db is not None:
            edges = np.linspace(0, len(step.beam_db), N_CELLS + 1).astype(int)
            for k, (first, last) in enumerate(pairwise(edges)):
                level = 1 + step.beam_db[first : max(last, first + 1)].max() / ASCII_RANGE_DB
                cells[k] = SHADES[int(np.clip(level * (len(SHADES) - 1), 0, len(SHADES) - 1))]
        for one in step.sources():
            angle = one["doa_deg"]
            if np.isfinite(angle):
                place = int((angle + self._limit) / (2 * self._limit) * N_CELLS)
                cells[min(max(place, 0), N_CELLS - 1)] = self._mark(one["label"])
        return "".join(cells)

    def _mark(self, label: int) -> str:
        mark = str(label % 10) if label >= 0 else "o"
        return self._coloured(mark, label)

    def _coloured(self, text: str, label: int) -> str:
        if not self._colours or label < 0:
            return text
        return f"\x1b[1;{COLOURS[label % len(COLOURS)]}m{text}\x1b[0m"

    def _sources(self, step: LiveStep) -> str:
        sources = step.sources()
        parts = [self._words(one) for one in sources[:MAX_LISTED]]
        rest = len(sources) - MAX_LISTED
        return "  ".join([*parts, *([f"and {rest} more"] if rest > 0 else [])])

    def _words(self, one: dict[str, float]) -> str:
        """Return label and place of a source, such as `3: 41.2±0.8`."""
        label = int(one.get("label", one.get("entry", -1)))
        name = self._coloured(f"{label}:", label) + " " if label >= 0 else ""
        if "x_m" in one:
            return f"{name}{one['x_m']:.1f}, {one['y_m']:.1f} m"
        words = f"{name}{one['doa_deg']:.1f}"
        if np.isfinite(one["std_deg"]):
            words += f"±{one['std_deg']:.1f}"
        if "elevation_deg" in one:
            words += f"/{one['elevation_deg']:.1f}"
        if "range_m" in one and np.isfinite(one["range_m"]):
            words += f" at {one['range_m']:.1f} m"
        return words
