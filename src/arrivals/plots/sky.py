"""Plots of directions on the sphere: half spaces as discs about zenith and nadir."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from arrivals.plots.bearing_time import new_axes
from arrivals.plots.colours import NEUTRAL
from arrivals.plots.labels import set_title, settings_text
from arrivals.plots.tracks import (
    BAND_OPACITY,
    draw_tracks,
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
MAX_AREAS = 600  # estimates that are drawn with their deviations


def plot_sky(run: Run, *, clockwise: bool = False, ax: Axes | None = None) -> Axes:
    """Draw directions on the sphere as tracks on a disc, with the zenith in the middle.

    The distance from the middle is 90 degrees minus the elevation. Directions below the horizon
    are on a second disc, with the nadir in the middle, as seen from above, too. Colours and opacity
    are those of `plot_bearing_time`; a ring is the last direction of a track, of at most 30.
    Shaded ellipses are one standard deviation, of at most 600 directions; thin lines join tracks
    over pauses.

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
    order = track_order(run, run.elevation)
    step, slot = order.step, order.slot
    azimuth, elevation = run.doa[step, slot], run.elevation[step, slot]
    order = order.near((elevation[1:] < 0) == (elevation[:-1] < 0))
    point = _on_disc(azimuth, elevation, clockwise)
    colour, label = track_colours(run, order), run.label[step, slot]
    some = slice(None, None, max(1, -(-len(step) // MAX_AREAS)))
    areas = _areas(
        azimuth[some],
        elevation[some],
        run.covariance[step, slot].reshape(-1, 2, 2)[some],
        clockwise,
    )
    _shade(ax, areas, colour[some])
    draw_tracks(ax, point, colour, order)
    last = np.append(np.diff(label) != 0, True)[: len(label)] & (label >= 0)
    last &= last.sum() <= MAX_ENDS
    x, y = point[last].T
    ax.scatter(x, y, s=42, facecolors="none", edgecolors=list(colour[last]), linewidths=1.4,
               zorder=4)  # fmt: skip
    edge = RIM + 30
    ax.set(xlim=(-edge, APART + edge if below else edge), ylim=(-edge, edge + (12 if below else 0)))
    ax.set_aspect("equal")
    ax.set_axis_off()
    set_title(ax, settings_text(run))
    return ax


def _areas(azimuth: Float, elevation: Float, covariance: Float, clockwise: bool) -> Float:
    """Return outlines (n, 25, 2) of one standard deviation about directions, NaN if unknown.

    Examples
    --------
    >>> zenith, std = np.array([np.pi / 2]), np.deg2rad(2.0)
    >>> np.ptp(_areas(np.zeros(1), zenith, std**2 * np.eye(2)[None], False)[0], axis=0).round(2)
    array([4., 4.])
    """
    known = np.asarray(np.isfinite(covariance).all(axis=(-2, -1)))
    variance, axes = np.linalg.eigh(np.where(known[:, None, None], covariance, 0.0))
    turn = np.linspace(0, 2 * np.pi, 25)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    moved = (axes * np.sqrt(np.maximum(variance, 0))[:, None]) @ circle  # elevation, along azimuth
    up, along = moved[:, 0], moved[:, 1]
    # unit vectors of the tangent plane: a direction that moves over the zenith stays a direction
    cos_a, sin_a = np.cos(azimuth)[:, None], np.sin(azimuth)[:, None]
    cos_e, sin_e = np.cos(elevation)[:, None], np.sin(elevation)[:, None]
    x = cos_e * cos_a - up * sin_e * cos_a - along * sin_a
    y = cos_e * sin_a - up * sin_e * sin_a + along * cos_a
    z = sin_e + up * cos_e
    on_side = np.where(elevation < 0, np.minimum(z.T, -1e-9), np.maximum(z.T, 0.0)).T
    outline = _on_disc(np.arctan2(y, x), np.arctan2(on_side, np.hypot(x, y)), clockwise)
    return np.asarray(np.where(known[:, None, None], outline, np.nan))


def _shade(ax: Axes, areas: Float, colour: Float) -> None:
    from matplotlib.collections import PolyCollection

    known = np.asarray(np.isfinite(areas).all(axis=(1, 2)))
    pale = colour[known] * [1, 1, 1, BAND_OPACITY]
    ax.add_collection(PolyCollection(list(areas[known]), facecolors=pale, edgecolors="none",
                                     label="_deviations"))  # fmt: skip


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
