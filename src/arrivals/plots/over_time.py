"""Plots of one quantity of the sources over time: tracks with bands, and ranges."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from arrivals.plots.bearing_time import draw_directions, is_on_line, new_axes
from arrivals.plots.colours import NEUTRAL, label_colours
from arrivals.plots.labels import legend_beside, set_title, settings_text
from arrivals.plots.tracks import (
    draw_bands,
    draw_tracks,
    labels_of,
    require_field,
    step_times,
    time_limits,
    track_colours,
    track_order,
)
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import instance, one_of, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDEST = 20.0  # ratio of the ranges on a linear axis
MAX_NAMES = 12  # in the legend
QUANTITIES = ("doa", "elevation", "range", "x", "y", "state", "existence")


class Quantity(NamedTuple):
    """A quantity of the sources: name of its axis, values and deviations (n_steps, n_slots)."""

    name: str
    value: Float
    std: Float


def plot_tracks(
    run: Run,
    quantity: str | None = None,
    *,
    truth: ArrayLike | None = None,
    time: ArrayLike | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw one quantity of each track over time, with bands of ± one standard deviation.

    Colours, opacity and thin lines over pauses are those of `plot_bearing_time`. The legend, beside
    the axes, names at most 12 labels.

    Parameters
    ----------
    run : Run
        Run of any tracker.
    quantity : {"doa", "elevation", "range", "x", "y", "state", "existence"}, optional
        Directions and elevations in degrees, ranges and coordinates in m, the entries of a state,
        or probabilities. If None, directions, coordinates x or the state, which the run has.
    truth : array_like, shape (n_steps, n_sources), optional
        True values in rad, m or the unit of the state, dotted; NaN where there are none.
    time : array_like, shape (n_steps,), optional
        Increasing times, s; the number of the step if None.
    ax : matplotlib Axes, optional
        Axes of a new figure without a window if None.
        A figure of yours has room for the legend by `layout="constrained"`.

    Returns
    -------
    matplotlib Axes
        The quantity upwards, time to the right.

    Raises
    ------
    ValueError
        If the quantity is unknown, or shapes do not fit the run.
    TypeError
        If the run does not have the quantity.

    Examples
    --------
    >>> from arrivals.motion_models import RandomWalk
    >>> from arrivals.measurement_models import LinearMeasurement
    >>> from arrivals.trackers import Kalman
    >>> model = LinearMeasurement([[1.0]], [[4.0]])
    >>> tracker = Kalman(RandomWalk(1.0, n_dims=1), model, [0.0], [[9.0]])
    >>> plot_tracks(tracker.run([[1.0], [2.0], [2.0]])).get_ylabel()
    'state (± 1 std)'
    """
    chosen = _quantity(instance("run", run, Run), quantity)
    at = step_times(run, time)
    known = None if truth is None else _true_values(truth, len(run), chosen.name)
    ax = new_axes((9.0, 4.5)) if ax is None else ax
    limit = None
    if chosen.name.startswith("direction"):
        limit = 90.0 if is_on_line(run, run.measurement) else 180.0
        draw_directions(ax, at, run, limit)
    else:
        _draw(ax, at, run, chosen)
        ax.set_ylabel(chosen.name + " (± 1 std)" * bool(np.isfinite(chosen.std).any()))
        ax.autoscale_view()
    if known is not None:
        _draw_truth(ax, at, known, limit)
    if chosen.name == "existence":
        ax.set_ylim(-0.02, 1.02)
    ax.set(xlabel="step" if time is None else "time, s")
    time_limits(ax, at)
    _name_labels(ax, run)
    set_title(ax, settings_text(run))
    return ax


def _quantity(run: Run, name: str | None) -> Quantity:
    """Return a quantity of a run; raise an error if it has none of that name."""
    if name is None:
        fields = ("doa", "position", "x")
        found = next((field for field in fields if field in run.fields), None)
        if found is None:
            raise TypeError(f"run must contain tracks; got {run.kind.__name__}")
        name = {"position": "x", "x": "state"}.get(found, found)
    one_of("quantity", name, QUANTITIES)
    if name == "doa":
        require_field(run, "doa", "directions")
        return Quantity("direction, degrees", np.rad2deg(run.doa), np.rad2deg(run.std))
    if name == "elevation":
        require_field(run, "elevation", "elevations")
        std = _deviation(run.covariance, 0)
        return Quantity("elevation, degrees", np.rad2deg(run.elevation), np.rad2deg(std))
    if name == "range":
        require_field(run, "range", "ranges")
        finite = np.where(np.isfinite(run.range), run.range, np.nan)
        return Quantity("range, m", finite, run.range_std)
    if name in ("x", "y"):
        require_field(run, "position", "positions")
        k = ("x", "y").index(name)
        position = run.position[..., k] if len(run) else np.zeros((0, 0))
        return Quantity(f"{name}, m", position, _deviation(run.covariance, k))
    if name == "state":
        require_field(run, "x", "states")
        state = run.fields["x"]
        std = np.array([np.diagonal(P) for P in np.sqrt(np.maximum(run.P, 0))])
        return Quantity("state", state, std.reshape(state.shape))
    require_field(run, "existence", "probabilities of existence")
    return Quantity("existence", run.existence, np.full(run.existence.shape, np.nan))


def _deviation(covariance: Float, k: int) -> Float:
    """Return the standard deviations of an entry, (n_steps, n_slots), also of no step."""
    return np.sqrt(covariance[..., k, k]) if covariance.ndim == 4 else np.zeros((0, 0))


def _true_values(truth: ArrayLike, n_steps: int, name: str) -> Float:
    """Return true values in the unit of the axis, (n_steps, n_sources)."""
    values = real("truth", truth)
    if values.ndim != 2 or len(values) != n_steps:
        raise ValueError(f"truth must have shape ({n_steps}, n_sources); got {values.shape}")
    return np.rad2deg(values) if name.endswith("degrees") else values


def _draw_truth(ax: Axes, at: Float, known: Float, limit: float | None) -> None:
    """Draw true values as dotted lines, which break where a direction jumps across the limits."""
    for n, path in enumerate(known.T):
        if limit is not None:
            path = (path + 180.0) % 360.0 - 180.0
            jumps = np.flatnonzero(np.abs(np.diff(path)) > limit) + 1
            x, path = np.insert(at, jumps, np.nan), np.insert(path, jumps, np.nan)
        else:
            x = at
        ax.plot(x, path, color=NEUTRAL, linewidth=1.0, linestyle=":", zorder=4,
                label=None if n else "truth")  # fmt: skip


def _draw(ax: Axes, at: Float, run: Run, chosen: Quantity) -> None:
    order = track_order(run, chosen.value)
    x, colour = at[order.step], track_colours(run, order)
    value, std = (each[order.step, order.slot] for each in (chosen.value, chosen.std))
    draw_bands(ax, x, (value - std, value + std), colour, order)
    draw_tracks(ax, np.stack([x, value], 1), colour, order)


def _name_labels(ax: Axes, run: Run) -> None:
    """Name the labels by their colours in a legend, of the first of many."""
    labels = np.unique(labels_of(run)).tolist()
    colours, noun = label_colours(labels), "source" if "label" in run.fields else "entry"
    for label in [label for label in labels if label >= 0][:MAX_NAMES]:
        ax.plot([], [], color=colours[label], linewidth=2, label=f"{noun} {label}")
    legend_beside(ax)


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
    at = step_times(run, time)
    ax = new_axes((9.0, 3.6)) if ax is None else ax
    order = track_order(run, run.range)
    distance, std = run.range[order.step, order.slot], run.range_std[order.step, order.slot]
    near = np.isfinite(distance)
    order, distance, std = order.only(near), distance[near], std[near]
    x, colour = at[order.step], track_colours(run, order)
    low, high = np.maximum(distance - std, 1e-3 * distance), distance + std
    draw_bands(ax, x, (low, high), colour, order)
    draw_tracks(ax, np.stack([x, distance], 1), colour, order)
    _scale(ax, distance)
    ax.set(xlabel="step" if time is None else "time, s", ylabel="range, m (± 1 std)")
    time_limits(ax, at)
    plane = int((~near).sum())
    share = f"without plane waves, {100 * plane / max(len(near), 1):.0f} % of the estimates"
    set_title(ax, settings_text(run), share if plane else "")
    return ax


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
