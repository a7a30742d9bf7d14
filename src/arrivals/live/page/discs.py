"""Views of one step on a disc: directions in the plane, and the sky."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.live.page.figures import GRID, INK, empty_source, hover, new_figure
from arrivals.live.steps import LiveScene

TITLE = 24  # height of a title, pixels


def polar_figure(scene: LiveScene) -> tuple[Any, dict[str, Any]]:
    """Return the polar view of the latest step, and its data sources.

    Parameters
    ----------
    scene : LiveScene
        The run: broadside is upwards, or azimuth 0 to the right.

    Returns
    -------
    figure : bokeh figure
    sources : dict of str to ColumnDataSource
        `rays`, `sectors` and `outline`.
    """
    sources = {
        "rays": empty_source("x y label doa_deg std_deg existence colour alpha"),
        "sectors": empty_source("start end colour"),
        "outline": empty_source("x y"),
    }
    plot = disc("Now: directions, and beam power", half=scene.line)
    plot.patch("x", "y", source=sources["outline"], fill_color="#9aa3ad", fill_alpha=0.35,
               line_color=None)  # fmt: skip
    plot.wedge(0, 0, 1.0, "start", "end", source=sources["sectors"], color="colour",
               fill_alpha=0.25, line_color=None)  # fmt: skip
    plot.segment(0, 0, "x", "y", source=sources["rays"], color="colour", alpha="alpha",
                 line_width=3)  # fmt: skip
    ends = plot.scatter("x", "y", source=sources["rays"], size=10, color="colour", alpha="alpha",
                        line_color="white")  # fmt: skip
    plot.text("x", "y", "label", source=sources["rays"], x_offset=7, y_offset=-7,
              text_font_size="11px", text_color="colour")  # fmt: skip
    tool = hover(("label", "@label"), ("direction", "@doa_deg{0.0} ± @std_deg{0.0}°"),
                 ("existence", "@existence{0.00}"))  # fmt: skip
    tool.renderers = [ends]
    plot.add_tools(tool)
    return plot, sources


def sky_figure() -> tuple[Any, dict[str, Any]]:
    """Return the view of the sky, and its data sources.

    Returns
    -------
    figure : bokeh figure
    sources : dict of str to ColumnDataSource
        `trail` of the latest steps, and `now`.
    """
    names = "x y time label doa_deg elevation_deg existence level_db colour alpha"
    sources = {"trail": empty_source(names), "now": empty_source(names)}
    plot = disc("Now: the sky, zenith in the middle", rings=(1 / 3, 2 / 3))
    plot.scatter("x", "y", source=sources["trail"], size=3, color="colour", alpha=0.4)
    now = plot.scatter("x", "y", source=sources["now"], size=12, color="colour", alpha="alpha",
                       line_color="white")  # fmt: skip
    plot.text("x", "y", "label", source=sources["now"], x_offset=8, y_offset=-8,
              text_font_size="11px", text_color="colour")  # fmt: skip
    tool = hover(("label", "@label"), ("azimuth", "@doa_deg{0.0}°"),
                 ("elevation", "@elevation_deg{0.0}°"),
                 ("existence", "@existence{0.00}"))  # fmt: skip
    tool.renderers = [now]
    plot.add_tools(tool)
    return plot, sources


def disc(title: str, *, half: bool = False, rings: tuple[float, ...] = (0.5,)) -> Any:
    """Return a figure with the unit circle, or its upper half, with degrees on the rim.

    Parameters
    ----------
    title : str
        Title.
    half : bool
        True for directions from broadside, which is upwards.
    rings : tuple of float
        Radii of further circles.

    Returns
    -------
    bokeh figure
    """
    from bokeh.models import Range1d

    edge = 1.24
    low = -0.22 if half else -edge
    width = 360
    height = round(width * (edge - low) / (2 * edge)) + TITLE
    plot = new_figure(title, width=width, height=height, x_range=Range1d(-edge, edge),
                      y_range=Range1d(low, edge),
                      toolbar_location=None, min_border=0)  # fmt: skip
    plot.axis.visible, plot.grid.visible = False, False
    turn = np.linspace(0, np.pi if half else 2 * np.pi, 181)
    for radius in (*rings, 1.0):
        plot.line(radius * np.cos(turn), radius * np.sin(turn), color="#b8bfc8", line_width=1)
    degrees = range(-90, 91, 30) if half else range(-150, 181, 30)
    angle = np.deg2rad([90 - each if half else each for each in degrees])
    plot.segment(0, 0, np.cos(angle), np.sin(angle), color=GRID, line_width=1)
    plot.text(1.11 * np.cos(angle), 1.11 * np.sin(angle), text=[f"{d}°" for d in degrees],
              text_align="center", text_baseline="middle", text_font_size="11px",
              text_color=INK)  # fmt: skip
    return plot
