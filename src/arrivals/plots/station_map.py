"""Stations on maps: places, names, headings, and the bearings of a step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import Station
from arrivals.plots.colours import NEUTRAL
from arrivals.typing import Float
from arrivals.validation import real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TICK, NAME = 15.0, 11.0  # points, from a station: end of the heading tick, middle of its name
RAY = 4.0  # length of a bearing, over the diagonal of the map


def draw_stations(ax: Axes, stations: Sequence[Station]) -> None:
    """Draw stations with their names, and ticks along their headings.

    Names are on the far side from the middle of the stations. Stations with ready-made bearings
    and without a heading have no tick.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes of a map, m.
    stations : sequence of Station

    Examples
    --------
    >>> from arrivals.plots.bearing_time import new_axes
    >>> ax = new_axes((3.0, 3.0))
    >>> draw_stations(ax, [Station(None, [0.0, 0.0], name="mast"), Station(None, [9.0, 0.0])])
    >>> [text.get_text() for text in ax.texts]
    ['mast']
    """
    places = np.array([station.position for station in stations])
    x, y = places.T
    ax.scatter(x, y, s=58, marker="^", color=NEUTRAL, edgecolors="white", linewidths=0.6,
               zorder=5, label="stations")  # fmt: skip
    line = {"arrowstyle": "-", "color": NEUTRAL, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
    paper = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.8}
    for station, outwards in zip(stations, _outwards(places), strict=True):
        place = (float(station.position[0]), float(station.position[1]))
        along = np.array([np.cos(station.heading), np.sin(station.heading)])
        if station.measurement is not None or station.heading != 0:
            end = (TICK * float(along[0]), TICK * float(along[1]))
            ax.annotate("", place, end, textcoords="offset points", arrowprops=line, zorder=4)
            if along @ outwards > np.sqrt(0.5):  # beside the tick, not on it
                outwards = np.array([-along[1], along[0]])
        if station.name:
            offset = (NAME * float(outwards[0]), NAME * float(outwards[1]))
            horizontal = ("center", "left", "right")[int(np.sign(round(outwards[0])))]
            ax.annotate(station.name, place, offset, textcoords="offset points", fontsize=8,
                        ha=horizontal, va="center", bbox=paper, zorder=6)  # fmt: skip


def _outwards(places: Float) -> Float:
    """Return unit vectors (n, 2) from the middle of places, downwards at the middle itself."""
    away = places - places.mean(axis=0)
    length = np.linalg.norm(away, axis=1, keepdims=True)
    unit = np.divide(away, length, out=np.zeros_like(away), where=length > 0)
    return np.asarray(np.where(length > 0, unit, [0.0, -1.0]))


def draw_bearings(
    ax: Axes, stations: Sequence[Station], bearings: Sequence[ArrayLike | None]
) -> None:
    """Draw bearings as grey rays from their stations, which do not change the limits.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes of a map, m, with all that sets its limits.
    stations : sequence of Station
    bearings : sequence of (array_like or None)
        Azimuths of each station, rad, (n_bearings,).

    Raises
    ------
    ValueError
        If there is not one entry a station.

    Examples
    --------
    >>> from arrivals.plots.bearing_time import new_axes
    >>> ax = new_axes((3.0, 3.0))
    >>> draw_bearings(ax, [Station(None, [0.0, 0.0]), Station(None, [9.0, 0.0])], [[0.5], None])
    >>> len(ax.collections[0].get_segments())
    1
    """
    from matplotlib.collections import LineCollection

    if len(bearings) != len(stations):
        raise ValueError(f"bearings must be one a station, {len(stations)}; got {len(bearings)}")
    size = RAY * float(np.hypot(*ax.dataLim.size)) if np.isfinite(ax.dataLim.size).all() else RAY
    rays = [
        [station.position, station.position + size * np.array([np.cos(azimuth), np.sin(azimuth)])]
        for station, azimuths in zip(stations, bearings, strict=True)
        if azimuths is not None
        for azimuth in np.ravel(real("bearings", azimuths)).tolist()
    ]
    lines = LineCollection(rays, colors="0.72", linewidths=0.7, zorder=1, label="last bearings")
    ax.add_collection(lines, autolim=False)
