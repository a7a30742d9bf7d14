"""Figures of the page, by bokeh: directions over time, map, levels."""

from __future__ import annotations

from typing import Any

import numpy as np

from arrivals.live.page.columns import Columns
from arrivals.live.steps import LiveScene
from arrivals.typing import Float

TOOLS = "pan,wheel_zoom,box_zoom,reset,save"
INK, PAPER, GRID = "#2b2f36", "#ffffff", "#dfe3e8"
GREYS = tuple(f"#{255 - k // 2:02x}{255 - k // 2:02x}{255 - k * 4 // 9:02x}" for k in range(256))


def new_figure(title: str, **more: Any) -> Any:
    """Return an empty figure in the style of the page.

    Parameters
    ----------
    title : str
        Title.
    **more : object
        Arguments of `bokeh.plotting.figure`.

    Returns
    -------
    bokeh figure
    """
    from bokeh.plotting import figure

    plot = figure(title=title, tools=TOOLS, active_scroll="wheel_zoom", **more)
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    plot.background_fill_color = plot.border_fill_color = PAPER
    plot.outline_line_color = GRID
    plot.grid.grid_line_color = GRID
    plot.title.text_font_size, plot.title.text_color = "12px", INK
    plot.axis.axis_label_text_font_style = "normal"
    plot.axis.minor_tick_line_color = None
    return plot


def empty_source(names: str) -> Any:
    """Return a data source with empty columns.

    Parameters
    ----------
    names : str
        Names of the columns, separated by spaces.

    Returns
    -------
    bokeh ColumnDataSource
    """
    from bokeh.models import ColumnDataSource

    return ColumnDataSource({name: [] for name in names.split()})


def hover(*rows: tuple[str, str]) -> Any:
    """Return a tool that shows values of the point under the pointer.

    Parameters
    ----------
    *rows : (str, str)
        Names and fields.
    """
    from bokeh.models import HoverTool

    return HoverTool(tooltips=list(rows))


def time_figure(scene: LiveScene) -> tuple[Any, dict[str, Any]]:
    """Return the figure of directions over time, and its data sources.

    Parameters
    ----------
    scene : LiveScene
        The run.

    Returns
    -------
    figure : bokeh figure
    sources : dict of str to ColumnDataSource
        `beam`, `lines` and `points`.
    """
    from bokeh.models import FixedTicker, LinearColorMapper, Range1d

    limit, tick = (90, 30) if scene.line else (180, 60)
    sources = {
        "beam": empty_source("image x y dw dh"),
        "lines": empty_source("xs ys colour"),
        "points": empty_source(
            "time doa_deg std_deg low high label existence level_db colour alpha"
        ),
    }
    plot = new_figure("Directions over time, over the beam power of each step", height=380,
                      sizing_mode="stretch_width", x_range=Range1d(0.0, 1.0),
                      y_range=Range1d(-limit, limit))  # fmt: skip
    mapper = LinearColorMapper(palette=GREYS, low=0, high=255)
    plot.image("image", "x", "y", "dw", "dh", source=sources["beam"], color_mapper=mapper)
    plot.segment("time", "low", "time", "high", source=sources["points"], color="colour",
                 alpha=0.35, line_width=2)  # fmt: skip
    plot.multi_line("xs", "ys", source=sources["lines"], color="colour", line_width=2)
    points = plot.scatter("time", "doa_deg", source=sources["points"], size=5, color="colour",
                          alpha="alpha", line_color=None)  # fmt: skip
    tool = hover(("label", "@label"), ("time", "@time{0.00} s"),
                 ("direction", "@doa_deg{0.0} ± @std_deg{0.0}°"),
                 ("existence", "@existence{0.00}"), ("level", "@level_db{0.0} dB"))  # fmt: skip
    tool.renderers = [points]
    plot.add_tools(tool)
    plot.yaxis.ticker = FixedTicker(ticks=list(range(-limit, limit + 1, tick)))
    plot.xaxis.axis_label = "time, s"
    plot.yaxis.axis_label = "direction of arrival, degrees" if scene.line else "azimuth, degrees"
    return plot, sources


def map_figure(scene: LiveScene) -> tuple[Any, dict[str, Any]]:
    """Return the map of positions, and its data sources.

    Parameters
    ----------
    scene : LiveScene
        With stations and sensors.

    Returns
    -------
    figure : bokeh figure
    sources : dict of str to ColumnDataSource
        `rays`, `lines`, `ellipses` and `now`.
    """
    names = "x_m y_m std_x_m std_y_m label existence colour alpha"
    sources = {
        "rays": empty_source("xs ys"),
        "lines": empty_source("xs ys colour"),
        "ellipses": empty_source("xs ys colour"),
        "now": empty_source(names),
    }
    plot = new_figure("Map: tracks with 95 % ellipses, bearings of the latest step", height=620,
                      sizing_mode="stretch_width", match_aspect=True)  # fmt: skip
    rays = plot.multi_line("xs", "ys", source=sources["rays"], color="#b8bfc8", line_width=1)
    plot.multi_line("xs", "ys", source=sources["lines"], color="colour", line_width=2)
    plot.multi_line("xs", "ys", source=sources["ellipses"], color="colour", line_width=1)
    if scene.sensors:
        x, y = np.array(scene.sensors).T
        plot.scatter(x, y, size=6, color="#8a929c", marker="square")
    if scene.stations:
        station, x, y = zip(*scene.stations, strict=True)
        plot.scatter(x, y, size=12, color=INK, marker="triangle")
        plot.text(x, y, text=list(station), x_offset=8, y_offset=-6, text_font_size="11px")
    now = plot.scatter("x_m", "y_m", source=sources["now"], size=11, color="colour",
                       alpha="alpha", line_color="white")  # fmt: skip
    plot.text("x_m", "y_m", "label", source=sources["now"], x_offset=8, y_offset=-8,
              text_font_size="11px", text_color="colour")  # fmt: skip
    tool = hover(("label", "@label"), ("x", "@x_m{0.0} ± @std_x_m{0.0} m"),
                 ("y", "@y_m{0.0} ± @std_y_m{0.0} m"),
                 ("existence", "@existence{0.00}"))  # fmt: skip
    tool.renderers = [now]
    plot.add_tools(tool)
    plot.xaxis.axis_label, plot.yaxis.axis_label = "x, m", "y, m"
    # rays are longer than the map: they do not set its limits
    for limits in (plot.x_range, plot.y_range):
        limits.renderers = [one for one in plot.renderers if one is not rays]
    return plot, sources


def level_figure() -> tuple[Any, dict[str, Any]]:
    """Return the figure of channel levels, and its data source, `channels`."""
    from bokeh.models import BasicTicker, Range1d

    source = empty_source("channel level")
    plot = new_figure("Levels of the channels", height=230, sizing_mode="stretch_width",
                      x_range=Range1d(0.5, 1.5), y_range=Range1d(-60, 0))  # fmt: skip
    plot.scatter("channel", "level", source=source, size=11, color="#4d5560")
    plot.add_tools(hover(("channel", "@channel"), ("level", "@level{0.0} dB")))
    plot.xaxis.ticker = BasicTicker(min_interval=1)
    plot.xaxis.axis_label, plot.yaxis.axis_label = "channel", "level, dB"
    return plot, {"channels": source}


def fit_levels(plot: Any, level: Float) -> None:
    """Extend the axes of the levels to all channels and whole decades, as far as necessary.

    Parameters
    ----------
    plot : bokeh figure
        That of `level_figure`.
    level : ndarray, shape (n_channels,)
        Levels, dB; those that are not finite are left out.
    """
    plot.x_range.start, plot.x_range.end = 0.5, len(level) + 0.5
    finite = level[np.isfinite(level)]
    if len(finite):
        low, high = 10 * np.floor(finite.min() / 10 - 0.5), 10 * np.ceil(finite.max() / 10 + 0.5)
        inside = plot.y_range.start <= finite.min() and finite.max() <= plot.y_range.end
        if not inside or plot.y_range.end - plot.y_range.start > 2 * (high - low) + 20:
            plot.y_range.start, plot.y_range.end = float(low), float(high)


def update(sources: dict[str, Any], **columns: Columns) -> None:
    """Replace the data of sources by columns; those that a source does not have are left out.

    Parameters
    ----------
    sources : dict of str to ColumnDataSource
        Data sources by name.
    **columns : dict of str to list
        New columns by name of the source; columns without a row may be missing.
    """
    for name, new in columns.items():
        known = sources[name].data
        sources[name].data = {key: new[key] if any(map(len, new.values())) else [] for key in known}
