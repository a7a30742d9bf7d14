"""Plots of arrays: element numbers, 0 degrees, and the sense in which directions are counted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from arrivals.measurement_models import SensorArray
from arrivals.plots.bearing_time import new_axes
from arrivals.plots.colours import NEUTRAL, PALETTE
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes

N_NUMBERED = 32  # maximum number of sensors that are numbered
SENSE_DEG = 40.0  # length of the arrow that shows the sense


def plot_array(
    array: SensorArray,
    *,
    clockwise: bool = False,
    first: int = 1,
    directions: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw the sensors of an array, numbered if they are few, with 0 degrees and the sense.

    Parameters
    ----------
    array : SensorArray
        Array whose sensors are drawn.
    clockwise : bool
        True if the coordinates are north and east, as those of an array file with
        `clockwise = true`: north is drawn upwards, east to the right.
    first : int
        Number of the first sensor; 1 as in array files.
    directions : bool
        Draw the direction of 0 degrees and the sense in which directions grow.
    ax : matplotlib Axes, optional
        Axes of a new figure if None; sensors in space require the projection "3d".

    Returns
    -------
    matplotlib Axes
        Metres; a line lies along the horizontal axis.

    Examples
    --------
    >>> plot_array(SensorArray.ula(8, spacing=0.5)).get_xlabel()
    'position, m'
    >>> plot_array(SensorArray.uca(5, radius=0.3), clockwise=True).get_ylabel()
    'north, m'
    """
    ax = new_axes((5.0, 1.9) if array.dim == 1 else (3.6, 3.6), array.dim) if ax is None else ax
    positions = array.positions
    if array.dim == 1:
        positions = np.column_stack([positions, np.zeros(len(positions))])
    elif clockwise:
        positions = np.column_stack([positions[:, 1], positions[:, 0], positions[:, 2:]])
    cast(Any, ax).scatter(*positions.T, s=28, color=PALETTE[0], zorder=3)
    if array.n_sensors <= N_NUMBERED and array.dim < 3:
        for number, position in enumerate(positions, start=first):
            ax.annotate(str(number), position, (0, 6), textcoords="offset points",
                        ha="center", fontsize=8)  # fmt: skip
    if directions and array.dim == 1:
        _mark_broadside(ax, positions[:, 0])
    elif directions and array.dim == 2:
        _mark_azimuths(ax, positions, clockwise)
    _finish(ax, array.dim, clockwise)
    return ax


def _mark_broadside(ax: Axes, x: Float) -> None:
    """Draw 0 degrees as an arrow from the middle upwards, and the sense as one to the right."""
    middle, half = (x.max() + x.min()) / 2, max(np.ptp(x) / 2, 1e-9)
    _arrow(ax, (middle, 0.25), (middle, 0.8), "0°")
    _arrow(ax, (middle, 0.25), (middle + half / 2, 0.65), "positive")


def _mark_azimuths(ax: Axes, positions: Float, clockwise: bool) -> None:
    """Draw 0 degrees as an arrow, and the sense as an arc about the middle of the array."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    middle, radius = (low + high) / 2, 0.7 * float(np.linalg.norm(high - low))
    azimuth = np.deg2rad(np.linspace(0, SENSE_DEG, 20))
    across, along = np.sin(azimuth), np.cos(azimuth)
    unit = np.column_stack([across, along] if clockwise else [along, across])
    arc = middle + radius * unit
    _arrow(ax, middle + 0.75 * radius * unit[0], middle + 1.2 * radius * unit[0], "0°")
    ax.plot(*arc.T, color=NEUTRAL, linewidth=1)
    _arrow(ax, arc[-2], arc[-1], f"{SENSE_DEG:g}°")


def _arrow(ax: Axes, start: Any, end: Any, text: str) -> None:
    style = {"arrowstyle": "->", "color": NEUTRAL, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", end, start, arrowprops=style)
    ax.annotate(text, end, (5, 5), textcoords="offset points", fontsize=8, color=NEUTRAL)
    ax.update_datalim([start, end])


def _finish(ax: Axes, dim: int, clockwise: bool) -> None:
    """Label the axes; a line has only one."""
    if dim == 1:
        ax.axhline(0, color="0.8", linewidth=1, zorder=1)
        ax.set(xlabel="position, m", yticks=[], ylim=(-0.4, 1))
        ax.spines[["left", "right", "top"]].set_visible(False)
        ax.locator_params(axis="x", nbins=6)
        return
    names = ("east, m", "north, m") if clockwise else ("x, m", "y, m")
    ax.set(xlabel=names[0], ylabel=names[1])
    ax.margins(0.15)
    if dim == 3:
        cast(Any, ax).set_zlabel("z, m")
    else:
        ax.set_aspect("equal")
        ax.autoscale_view()
        ax.grid(color="0.92")
        ax.set_axisbelow(True)
