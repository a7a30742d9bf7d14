"""Plots of directions over time; matplotlib is imported when a plot is drawn."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from arrivals.files import atomic_write
from arrivals.measurement_models import ArraySnapshot
from arrivals.messages import shown
from arrivals.plots.beam import N_STEPS, draw_beam
from arrivals.trackers.run import Run
from arrivals.typing import Bool, Complex, Float, Int
from arrivals.validation import instance, one_of, positive, shaped

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Strong colours that differ from each other on grey, also for the colour-blind.
PALETTE = (
    "#d62728", "#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd",
    "#e377c2", "#17becf", "#8c564b", "#b8a900", "#00429d",
)  # fmt: skip
NEUTRAL = "#202020"
PICTURES = (".png", ".pdf", ".svg", ".jpg")


def plot_bearing_time(
    run: Run,
    *,
    snapshots: ArrayLike | Iterable[Complex] | None = None,
    measurement: ArraySnapshot | None = None,
    time: ArrayLike | None = None,
    dynamic_range_db: float = 30.0,
    ax: Axes | None = None,
) -> Axes:
    """Draw directions over time, over the power of the conventional beamformer.

    Each label has a colour (they repeat), directions without a label are dark, and the opacity
    is the existence; without existence, all are opaque. Of more than 6000 steps, every n-th is
    drawn.

    Parameters
    ----------
    run : Run
        Run of a tracker of directions, n_steps long.
    snapshots : array_like or iterable, shape (n_steps, *measurement.shape), optional
        Measurements of the run, iterated over once; without them, the beam is not drawn.
    measurement : ArraySnapshot, optional
        Array and wavelength, required with `snapshots`.
    time : array_like, shape (n_steps,), optional
        Increasing times, s; the number of the step if None.
    dynamic_range_db : float
        Power shown, down from the highest of all steps, dB.
    ax : matplotlib Axes, optional
        Axes of a new figure without a window if None; `save` writes it.

    Returns
    -------
    matplotlib Axes
        Directions upwards, degrees; time to the right.

    Raises
    ------
    ValueError
        If shapes do not fit the run, or `snapshots` come without a `measurement`.
    TypeError
        If the run does not have directions.

    Examples
    --------
    >>> from arrivals.measurement_models import SensorArray
    >>> from arrivals.trackers import SVALSE
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)
    >>> z = model.simulate([[0.50], [0.51], [0.52]], 1.0, np.random.default_rng(0))
    >>> ax = plot_bearing_time(SVALSE(model).run(z), snapshots=z, measurement=model)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('step', 'direction of arrival, degrees')
    """
    require_field(run, "doa", "directions")
    ax = new_axes((9.0, 4.5)) if ax is None else ax
    at = step_times(run, time)
    if snapshots is not None:
        if measurement is None:
            raise ValueError("measurement must be set with snapshots; got None")
        range_db = positive("dynamic_range_db", dynamic_range_db)
        draw_beam(ax, at, snapshots, measurement, range_db)
    _draw_tracks(ax, at, run)
    line = bool((np.abs(run.doa) > np.pi / 2).sum() == 0)
    _name_axes(ax, line if measurement is None else measurement.array.dim == 1, time is None)
    if len(at) > 0:
        half = (at[-1] - at[0]) / max(1, len(at) - 1) / 2 or 0.5
        ax.set_xlim(at[0] - half, at[-1] + half)
    return ax


def require_field(run: Run, name: str, words: str) -> None:
    """Raise a TypeError unless a run has a field of its sources."""
    if name not in instance("run", run, Run).fields:
        raise TypeError(f"run must contain {words}; got {run.kind.__name__}")


def step_times(run: Run, time: ArrayLike | None) -> Float:
    """Return the times of the steps, s, increasing; their numbers if None."""
    if time is None:
        return np.arange(len(run), dtype=np.float64)
    at = shaped("time", time, len(run))
    if not np.isfinite(at).all() or (np.diff(at) <= 0).any():
        raise ValueError(f"time must be finite and increasing; got {shown(at)}")
    return at


def _name_axes(ax: Axes, line: bool, steps: bool) -> None:
    limit, tick = (90, 30) if line else (180, 60)
    ax.set(ylim=(-limit, limit), yticks=np.arange(-limit, limit + 1, tick))
    ax.set_ylabel("direction of arrival, degrees" if line else "azimuth, degrees")
    ax.set_xlabel("step" if steps else "time, s")


def _draw_tracks(ax: Axes, at: Float, run: Run) -> None:
    """Draw each label as a line through successive steps, and isolated directions as dots."""
    step, slot, joined = track_order(run)
    point = np.stack([at[step], np.rad2deg(run.doa[step, slot])], 1)
    furthest = 180 if (np.abs(point[:, 1]) > 90).any() else 90  # not across ±180°, on lines ±90°
    near = np.abs(np.diff(point[:, 1])) < furthest
    draw_tracks(ax, point, track_colours(run, step, slot), joined & near)


def track_order(run: Run) -> tuple[Int, Int, Bool]:
    """Return steps and slots of the directions by label and step, and which neighbours are joined.

    Of more than 6000 steps, every n-th is taken. Neighbours are joined, (n - 1,), if they have one
    label and successive steps.
    """
    every = max(1, -(-len(run) // N_STEPS))
    step, slot = np.nonzero(~np.isnan(run.doa[::every]))
    label = run.label[::every][step, slot]
    order = np.lexsort([step, label])
    step, slot, label = step[order], slot[order], label[order]
    joined = (np.diff(label) == 0) & (label[1:] >= 0) & (np.diff(step) == 1)
    return step * every, slot, np.asarray(joined)


def draw_tracks(ax: Axes, point: Float, colour: Float, joined: Bool) -> None:
    """Draw points (n, 2): lines between neighbours that are joined, dots elsewhere."""
    from matplotlib.collections import LineCollection

    lines = list(np.stack([point[:-1][joined], point[1:][joined]], axis=1))
    for width, paint in ((3.4, "white"), (1.7, colour[1:][joined])):
        ax.add_collection(LineCollection(lines, colors=paint, linewidths=width, zorder=3))
    alone = np.ones(len(point), dtype=np.bool_)
    alone[:-1][joined] = False
    alone[1:][joined] = False
    x, y = point[alone].T
    ax.scatter(x, y, s=9, c=colour[alone], edgecolors="white", linewidths=0.4, zorder=2)


def track_colours(run: Run, step: Int, slot: Int) -> Float:
    """Return RGBA rows: the colour from the label, the opacity from the existence."""
    from matplotlib.colors import to_rgba_array

    label, existence = run.label[step, slot], run.existence[step, slot]
    palette = to_rgba_array((*PALETTE, NEUTRAL))
    colour = palette[np.where(label < 0, -1, label % len(PALETTE))]
    colour[:, 3] = np.where(np.isnan(existence), 1.0, np.clip(existence, 0.0, 1.0))
    return np.asarray(colour)


def new_axes(size: tuple[float, float], dim: int = 2) -> Axes:
    """Return the axes of a new figure without a window."""
    from matplotlib.figure import Figure

    projection = {"projection": "3d"} if dim == 3 else {}
    figure = Figure(figsize=size, layout=None if dim == 3 else "constrained")
    return figure.add_subplot(**projection)


def save(ax: Axes, path: str | PathLike[str], *, dpi: float = 150.0) -> None:
    """Write the figure of `ax` to a file, which appears only when it is complete.

    Raises
    ------
    ValueError
        If the suffix is not one of png, pdf, svg and jpg.
    OSError
        If the folder does not exist or is not writable.

    Examples
    --------
    >>> save(new_axes((3.0, 2.0)), "array.sketch")
    Traceback (most recent call last):
    ValueError: the suffix of a picture must be one of '.png', '.pdf', '.svg', '.jpg'; got '.sketch'
    """
    kind = picture_format(path)
    with atomic_write(path, binary=True) as file:
        cast("Figure", ax.figure).savefig(file, format=kind, dpi=dpi)


def picture_format(path: str | PathLike[str]) -> str:
    """Return the format of a picture by its suffix.

    Examples
    --------
    >>> picture_format("tracks.PNG")
    'png'
    """
    return one_of("the suffix of a picture", Path(path).suffix.lower(), PICTURES)[1:]
