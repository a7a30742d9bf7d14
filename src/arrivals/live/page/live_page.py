"""The page of a run in a browser: figures, table, status, pause."""

from __future__ import annotations

import html
from typing import Any

import numpy as np

from arrivals.live.page.columns import (
    beam_image,
    channel_columns,
    ellipse_lines,
    polar_columns,
    sky_columns,
    source_columns,
    track_lines,
)
from arrivals.live.page.discs import polar_figure, sky_figure
from arrivals.live.page.figures import fit_levels, level_figure, map_figure, time_figure, update
from arrivals.live.page.table import table_html
from arrivals.live.steps import LiveScene, LiveStep, StepHistory

PERIOD = 200  # ms between updates
SAME = 1e-3  # s: limits of an axis that are equal
SPAN, N_SHOWN = 30.0, 400  # s, and steps, that are shown at first: the longer time of both
RAY = 4.0  # length of bearings, over the extent of the stations


class LivePage:
    """Page of one browser, with its own zoom and pause, on the history of a run.

    Parameters
    ----------
    history : StepHistory
        Steps; nothing is written to it.
    scene : LiveScene
        The run.
    columns : tuple of str
        Columns of the tracks file.
    """

    def __init__(self, history: StepHistory, scene: LiveScene, columns: tuple[str, ...]) -> None:
        from bokeh.models import Div, Toggle

        self._history, self._scene = history, scene
        self._n_shown = -1
        self._ended = False
        self._sources: dict[str, Any] = {}
        self._status = Div(text="waiting for the first step", sizing_mode="stretch_width")
        self._columns = columns
        self._table = Div(text=table_html(columns), sizing_mode="stretch_width", height=150,
                          styles={"overflow-y": "auto"})  # fmt: skip
        self._pause = Toggle(label="Pause", width=90)
        self._pause.on_change("active", self._on_pause)
        self._time: Any = None
        self._levels: Any = None
        self._limits = (0.0, 1.0)  # of the time axis, as set last
        self.layout = self._laid_out()

    def attach(self, document: Any) -> None:
        """Add the page to the document of a session, and update it from now on.

        Parameters
        ----------
        document : bokeh Document
            Document of the session.
        """
        document.title = "Arrivals"
        document.add_root(self.layout)
        self.refresh()
        document.add_periodic_callback(self.refresh, PERIOD)

    def refresh(self) -> None:
        """Draw the latest steps, unless the page is paused or they are drawn already."""
        steps = self._history.steps()
        if self._pause.active or not steps:
            return
        ended = self._history.ended
        if self._history.n_seen == self._n_shown and ended == self._ended:
            return
        self._n_shown, self._ended = self._history.n_seen, ended
        last = steps[-1]
        columns = source_columns(steps)
        self._status.text = self._words(steps)
        self._table.text = table_html(self._columns, last)
        if last.channel_db is not None:
            update(self._sources, channels=channel_columns(last))
            fit_levels(self._levels, last.channel_db)
        if self._scene.kind == "map":
            self._refresh_map(last, columns)
            return
        jump = 90.0 if self._scene.line else 180.0
        update(
            self._sources, points=columns, lines=track_lines(columns, "time", "doa_deg", jump),
            beam=beam_image(steps, self._scene.directions_deg),
        )  # fmt: skip
        self._follow(steps)
        if self._scene.kind == "sky":
            now = sky_columns(source_columns([last]))
            update(self._sources, trail=sky_columns(columns), now=now)
        else:
            rays, sectors, outline = polar_columns(last, self._scene)
            update(self._sources, rays=rays, sectors=sectors, outline=outline)

    def _refresh_map(self, last: LiveStep, columns: Any) -> None:
        places = [*(one[1:] for one in self._scene.stations), *self._scene.sensors]
        size = RAY * float(np.hypot(*np.ptp(places, axis=0))) if len(places) > 1 else 1.0
        rays = {
            "xs": [[x, x + size * np.cos(azimuth)] for x, _, azimuth in last.rays],
            "ys": [[y, y + size * np.sin(azimuth)] for _, y, azimuth in last.rays],
        }
        lines = track_lines(columns, "x_m", "y_m")
        update(self._sources, rays=rays, lines=lines, ellipses=ellipse_lines(last),
               now=source_columns([last]))  # fmt: skip

    def _laid_out(self) -> Any:
        from bokeh.layouts import column, row
        from bokeh.models import Div

        style = "font: 600 15px sans-serif; color: #2b2f36"
        title = Div(text=f'<span style="{style}">{html.escape(self._scene.title)}</span>',
                    sizing_mode="stretch_width")  # fmt: skip
        wide = {"sizing_mode": "stretch_width"}
        self._levels, own = level_figure()
        self._sources |= own
        head = row(self._pause, column(title, self._status, **wide), **wide)
        if self._scene.kind == "map":
            figure, own = map_figure(self._scene)
            self._sources |= own
            return column(head, figure, self._table, **wide)
        self._time, own = time_figure(self._scene)
        self._sources |= own
        side, own = sky_figure() if self._scene.kind == "sky" else polar_figure(self._scene)
        self._sources |= own
        below = row(side, column(self._table, self._levels, **wide), **wide)
        return column(head, self._time, below, **wide)

    def _follow(self, steps: Any) -> None:
        """Move the time axis on, unless the user has zoomed; a reset follows again."""
        axis, last = self._time.x_range, steps[-1].time
        follows = np.allclose((axis.start, axis.end), self._limits, rtol=0, atol=SAME)
        first = min(last - SPAN, steps[-N_SHOWN:][0].time)
        first = max(steps[0].time, first)
        self._limits = axis.reset_start, axis.reset_end = first, max(last, first + 1.0)
        if follows:
            axis.start, axis.end = self._limits

    def _on_pause(self, _name: str, _old: bool, active: bool) -> None:
        self._pause.label = "Resume" if active else "Pause"

    def _words(self, steps: Any) -> str:
        """Return the status: step, time, time a step, lag."""
        last = steps[-1]
        elapsed = np.array([one.elapsed for one in steps[-50:]])
        parts = [f"step {last.number}", f"time {last.time:.2f} s"]
        if np.isfinite(elapsed).any():
            parts.append(f"a step every {1e3 * np.nanmedian(elapsed):.1f} ms")
        if np.isfinite(last.lag):
            parts.append(f"lag {last.lag:.2f} s")
        if self._ended:
            parts.append("the run has ended")
        return " &nbsp;·&nbsp; ".join(parts)
