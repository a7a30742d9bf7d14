"""Plots of ranges over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.plots.bearing_time import (
    draw_tracks,
    new_axes,
    require_field,
    step_times,
    track_colours,
    track_order,
)
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDEST = 20.0  # ratio of the ranges on a linear axis


def plot_range(run: Run, *, time: ArrayLike | None = None, ax: Axes | None = None) -> Axes:
    """Draw ranges over time, with bands of ± one standard deviation.

    Plane waves have no range and are left out; the title has their share. Colours and opacity are
    those of `plot_bearing_time`. The axis is logarithmic if the largest range is more than 20
    times the smallest.

    Parameters
    ----------
    run : Run
        Run of a tracker of direction and range.
    time : array_like, shape (n_steps,), optional
        Increasing times, s; the number of the step if None.
    ax : matplotlib Axes, optional
        Axes of a new figure without a window if None; `save` writes it.

    Returns
    -------
    matplotlib Axes
        Ranges upwards, m; time to the right.

    Raises
    ------
    ValueError
        If the shape of `time` does not fit the run.
    TypeError
        If the run does not have ranges.

    Examples
    --------
    >>> from arrivals.trackers import RangeEstimate
    >>> from arrivals.trackers.run import RunRecorder
    >>> recorder, one = RunRecorder(RangeEstimate), np.ones(1)
    >>> for distance in (50.0, 49.0, np.inf):
    ...     recorder.add(RangeEstimate(0 * one, 0.01 * one, one, one + 0j, np.array([3]),
    ...                                range=distance * one, range_std=2 * one,
    ...                                covariance=np.full((1, 2, 2), np.nan)), one)
    >>> plot_range(recorder.run(dt=1.0, elapsed=0.0)).get_title()
    'without plane waves, 33 % of the estimates'
    """
    require_field(run, "range", "ranges")
    ax = new_axes((9.0, 3.6)) if ax is None else ax
    at = step_times(run, time)
    step, slot, joined = track_order(run)
    distance, std = run.range[step, slot], run.range_std[step, slot]
    near = np.isfinite(distance)
    joined &= near[1:] & near[:-1]
    colour = track_colours(run, step, slot)
    x = at[step]
    _draw_bands(ax, x, distance, std, colour, joined)
    keep = np.flatnonzero(near)
    # neighbours among those that are kept
    draw_tracks(ax, np.stack([x, distance], 1)[keep], colour[keep], joined[keep[:-1]])
    _scale(ax, distance[near])
    ax.set(xlabel="step" if time is None else "time, s", ylabel="range, m (± 1 std)")
    if len(at) > 0:
        half = (at[-1] - at[0]) / max(1, len(at) - 1) / 2 or 0.5
        ax.set_xlim(at[0] - half, at[-1] + half)
    if not near.all():
        share = 100 * float(np.mean(~near))
        ax.set_title(f"without plane waves, {share:.0f} % of the estimates", fontsize=10)
    return ax


def _draw_bands(
    ax: Axes, x: Float, distance: Float, std: Float, colour: Float, joined: Bool
) -> None:
    """Draw the deviations between joined neighbours as areas, of isolated ranges as lines."""
    from matplotlib.collections import LineCollection, PolyCollection

    low, high = np.maximum(distance - std, 1e-3 * distance), distance + std
    pale = colour * [1, 1, 1, 0.25]
    lower, upper = np.stack([x, low], 1), np.stack([x, high], 1)
    stated = joined & np.isfinite(std[1:]) & np.isfinite(std[:-1])
    corners = [lower[:-1], lower[1:], upper[1:], upper[:-1]]
    areas = np.stack([each[stated] for each in corners], axis=1)
    ax.add_collection(PolyCollection(list(areas), facecolors=pale[1:][stated], edgecolors="none"))
    alone = np.isfinite(distance) & np.isfinite(std)
    alone[:-1][joined] = False
    alone[1:][joined] = False
    bars = np.stack([lower, upper], axis=1)[alone]
    ax.add_collection(LineCollection(list(bars), colors=pale[alone], linewidths=1.2))


def _scale(ax: Axes, distance: Float) -> None:
    """Set the scale of the axis and its limits by the ranges alone, not by wide deviations."""
    if not len(distance):
        ax.set_yticks([])  # plane waves alone
        return
    low, high = float(distance.min()), float(distance.max())
    if high > WIDEST * low:
        ax.set_yscale("log")
        ax.set_ylim(low / 1.5, high * 1.5)
        ax.yaxis.set_major_formatter("{x:g}")
    else:
        ax.set_ylim(0, 1.25 * high)
    ax.grid(axis="y", color="0.92")
    ax.set_axisbelow(True)
