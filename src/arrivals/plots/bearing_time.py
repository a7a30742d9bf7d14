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
from arrivals.plots.beam import NORMALIZE, Normalize, draw_beam
from arrivals.plots.labels import set_title, settings_text
from arrivals.plots.tracks import (
    draw_bands,
    draw_tracks,
    require_field,
    step_times,
    time_limits,
    track_colours,
    track_order,
)
from arrivals.trackers.run import Run
from arrivals.typing import Complex, Float
from arrivals.validation import one_of, positive

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RANGES_DB = {"run": 30.0, "step": 10.0}
PICTURES = (".png", ".pdf", ".svg", ".jpg")


def plot_bearing_time(
    run: Run,
    *,
    snapshots: ArrayLike | Iterable[Complex] | None = None,
    measurement: ArraySnapshot | None = None,
    time: ArrayLike | None = None,
    dynamic_range_db: float | None = None,
    normalize: Normalize = "run",
    colour: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw directions over time, over the power of the conventional beamformer.

    Each label has a colour (they repeat), directions without a label are dark, and the opacity
    is the existence; without existence, all are opaque. Bands are ± one standard deviation; a thin
    line joins a track over its pauses. The title has the settings that the run knows. Of more than
    6000 steps, every n-th is drawn.

    Parameters
    ----------
    run : Run
        Run of a tracker of directions, n_steps long.
    snapshots : array_like or iterable, shape (n_steps, *measurement.shape), optional
        Measurements of the run, iterated over once; without them, the beam is not drawn.
    measurement : ArraySnapshot, optional
        Array and wavelength of the snapshots; those of the run's tracker if None.
    time : array_like, shape (n_steps,), optional
        Increasing times, s; the number of the step if None.
    dynamic_range_db : float, optional
        Power shown, down from the highest, dB; 30 of a run and 10 of a step if None.
    normalize : {"run", "step"}
        Whether the highest power is that of all steps, or of each step, where quiet sources stay
        visible beside louder steps.
    colour : str, optional
        One colour for all labels.
    ax : matplotlib Axes, optional
        Axes of a new figure without a window if None; `save` writes it.

    Returns
    -------
    matplotlib Axes
        Directions upwards, degrees; time to the right.

    Raises
    ------
    ValueError
        If shapes do not fit the run, or the `measurement` of snapshots is not known.
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
    one_of("normalize", normalize, NORMALIZE)
    ax = new_axes((9.0, 4.5)) if ax is None else ax
    at = step_times(run, time)
    known = run.measurement if measurement is None else measurement
    if snapshots is not None:
        if not isinstance(known, ArraySnapshot):
            raise ValueError("measurement must be set with snapshots; got None")
        asked = RANGES_DB[normalize] if dynamic_range_db is None else dynamic_range_db
        range_db = positive("dynamic_range_db", asked)
        draw_beam(ax, at, snapshots, known, range_db, normalize)
    limit = 90.0 if is_on_line(run, known) else 180.0
    draw_directions(ax, at, run, limit, colour)
    ax.set(xlabel="step" if time is None else "time, s")
    set_title(ax, settings_text(run, measurement))
    time_limits(ax, at)
    return ax


def is_on_line(run: Run, measurement: object = None) -> bool:
    """Return True if directions are those of a line: of its array, or within ±90 degrees."""
    dim = getattr(getattr(measurement, "array", None), "dim", None)
    return bool((np.abs(run.doa) > np.pi / 2).sum() == 0) if dim is None else dim == 1


def draw_directions(ax: Axes, at: Float, run: Run, limit: float, colour: str | None = None) -> None:
    """Draw tracks and bands of directions, joined neither across ±180 degrees nor endfire.

    Parameters
    ----------
    ax : matplotlib Axes
        Axes of directions over time.
    at : ndarray, shape (n_steps,)
        Times.
    run : Run
        Run with directions.
    limit : float
        90 on a line, 180 elsewhere, degrees.
    colour : str, optional
        One colour for all labels.
    """
    order = track_order(run, run.doa)
    x, y = at[order.step], np.rad2deg(run.doa[order.step, order.slot])
    std = np.rad2deg(run.std[order.step, order.slot])
    order = order.near(np.abs(np.diff(y)) < limit)
    colours = track_colours(run, order, colour)
    turns = (-360.0, 0.0, 360.0) if limit == 180.0 else (0.0,)
    for turn in turns:  # bands beyond ±180 degrees go on at the other side
        low, high = y - std + turn, y + std + turn
        seen = (low < limit) & (high > -limit)
        ends = np.where(seen, low, np.nan), np.where(seen, high, np.nan)
        draw_bands(ax, x, ends, colours, order)
    draw_tracks(ax, np.stack([x, y], 1), colours, order)
    ax.set(ylim=(-limit, limit), yticks=np.arange(-limit, limit + 1, limit / 3))
    ax.set_ylabel("direction of arrival, degrees" if limit == 90.0 else "azimuth, degrees")


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
