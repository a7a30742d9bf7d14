"""Plots of directions on the sphere: half spaces as discs about zenith and nadir."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from arrivals.plots.bearing_time import (
    NEUTRAL,
    draw_tracks,
    new_axes,
    require_field,
    track_colours,
    track_order,
)
from arrivals.trackers.run import Run
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RIM = 90.0  # degrees from the middle of a disc to its horizon
APART = 250.0  # between the middles of two discs
RINGS = (30, 60)  # elevations that are marked
MAX_ENDS = 30  # tracks whose ends are marked, if there are no more


def plot_sky(run: Run, *, clockwise: bool = False, ax: Axes | None = None) -> Axes:
    """Draw directions on the sphere as tracks on a disc, with the zenith in the middle.

    The distance from the middle is 90 degrees minus the elevation. Directions below the horizon
    are on a second disc, with the nadir in the middle, as seen from above, too. Colours and opacity
    are those of `plot_bearing_time`; a ring is the last direction of a track, of at most 30.

    Parameters
    ----------
    run : Run
        Run of a tracker of azimuth and elevation.
    clockwise : bool
        True if coordinates are north and east, as those of an array file with
        `clockwise = true`: north is drawn upwards, east to the right. Else the x axis, azimuth 0,
        points to the right and the y axis, 90 degrees, upwards.
    ax : matplotlib Axes, optional
        Axes of a new figure without a window if None; `save` writes it.

    Returns
    -------
    matplotlib Axes
        Degrees from the middle of the first disc; the second lies to its right.

    Raises
    ------
    TypeError
        If the run does not have elevations.

    Examples
    --------
    >>> from arrivals.trackers import SphereEstimate
    >>> from arrivals.trackers.run import RunRecorder
    >>> recorder, one = RunRecorder(SphereEstimate), np.ones(1)
    >>> for azimuth in (0.5, 0.6, 0.7):
    ...     recorder.add(SphereEstimate(azimuth * one, 0.01 * one, one, one + 0j, np.array([3]),
    ...                                 elevation=one, covariance=1e-4 * np.eye(2)[None]), one)
    >>> [text.get_text() for text in plot_sky(recorder.run(dt=1.0, elapsed=0.0)).texts][:3]
    ['0° (x)', '90° (y)', '180°']
    """
    require_field(run, "elevation", "elevations")
    below = bool((run.elevation < 0).any())
    ax = new_axes((9.6, 4.9) if below else (5.0, 5.0)) if ax is None else ax
    _draw_disc(ax, 0.0, "zenith" if below else "", clockwise)
    if below:
        _draw_disc(ax, APART, "nadir", clockwise)
    step, slot, joined = track_order(run)
    lower = run.elevation[step, slot] < 0
    point = _on_disc(run.doa[step, slot], run.elevation[step, slot], clockwise)
    colour, label = track_colours(run, step, slot), run.label[step, slot]
    draw_tracks(ax, point, colour, joined & (lower[1:] == lower[:-1]))
    last = np.append(np.diff(label) != 0, True)[: len(label)] & (label >= 0)
    last &= last.sum() <= MAX_ENDS
    x, y = point[last].T
    ax.scatter(x, y, s=42, facecolors="none", edgecolors=list(colour[last]), linewidths=1.4,
               zorder=4)  # fmt: skip
    edge = RIM + 30
    ax.set(xlim=(-edge, APART + edge if below else edge), ylim=(-edge, edge + (12 if below else 0)))
    ax.set_aspect("equal")
    ax.set_axis_off()
    return ax


def _on_disc(azimuth: Float, elevation: Float, clockwise: bool) -> Float:
    """Return points (..., 2) on the discs, degrees."""
    radius = RIM - np.abs(np.rad2deg(elevation))
    x, y = radius * np.cos(azimuth), radius * np.sin(azimuth)
    x, y = (y, x) if clockwise else (x, y)
    return np.stack([x + np.where(elevation < 0, APART, 0.0), y], axis=-1)


def _draw_disc(ax: Axes, centre: float, middle: str, clockwise: bool) -> None:
    """Draw rings of elevation and rays of azimuth, with their degrees."""
    turn = np.linspace(0, 2 * np.pi, 181)
    for elevation in (0, *RINGS):
        radius, grey = RIM - elevation, "0.88" if elevation else "0.55"
        x, y = centre + radius * np.cos(turn), radius * np.sin(turn)
        ax.plot(x, y, color=grey, linewidth=0.8, zorder=1)
    names = (" (north)", " (east)") if clockwise else (" (x)", " (y)")
    for k, name in enumerate((*names, "", "")):
        degrees = (0, 90, 180, -90)[k]
        ray = np.deg2rad(90 - degrees if clockwise else degrees)
        unit = np.array([np.cos(ray), np.sin(ray)]).round(9)
        ray_x, ray_y = np.outer(unit, [0, RIM])
        ax.plot(centre + ray_x, ray_y, color="0.88", linewidth=0.8, zorder=1)
        words = f"{degrees}°{name}".replace("-", "−")
        ax.text(centre + (RIM + 4) * unit[0], (RIM + 4) * unit[1], words, fontsize=9,
                ha=("center", "left", "right")[int(np.sign(unit[0]))], color=NEUTRAL,
                va=("center", "bottom", "top")[int(np.sign(unit[1]))])  # fmt: skip
    diagonal = np.sqrt(0.5)
    for elevation in (0, *RINGS):
        at = (RIM - elevation) * diagonal
        words = f"{'−' if middle == 'nadir' else ''}{elevation}°" if elevation else "elevation 0°"
        label = ax.text(
            centre + at + 1, -at - 1, words, fontsize=7, color="0.4", va="top", zorder=5
        )
        label.set_bbox({"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 0.6})
    if middle:
        ax.text(centre, RIM + 28, f"{middle} in the middle", fontsize=10, ha="center", va="center")
