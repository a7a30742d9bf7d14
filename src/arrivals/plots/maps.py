"""Maps of estimated positions: sensors, stations, tracks and error ellipses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models import Station
from arrivals.plots.bearing_time import new_axes
from arrivals.plots.colours import NEUTRAL, label_colours
from arrivals.plots.labels import legend_beside, set_title, settings_text
from arrivals.plots.station_map import draw_bearings, draw_stations
from arrivals.plots.tracks import PAUSE_WIDTH
from arrivals.trackers.run import Run
from arrivals.typing import Float
from arrivals.validation import count, instance, real, shaped

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONFIDENCE = 0.95
MAX_NAMES = 12  # in the legend
MARGIN = 0.12  # of a map with stations, for their names


def plot_map(
    run: Run | Mapping[str, Run],
    *,
    sensors: ArrayLike | None = None,
    truth: ArrayLike | None = None,
    stations: Sequence[Station] | None = None,
    bearings: Sequence[ArrayLike | None] | None = None,
    n_ellipses: int = 12,
    ax: Axes | None = None,
) -> Axes:
    """Draw positions over time with 95 % ellipses, the sensors and the stations.

    A thin line joins a track over its pauses. The legend is beside the map, and the title has the
    settings that the run knows. Colours are those of `plot_bearing_time`; of several runs, they
    count the tracks.

    Parameters
    ----------
    run : Run, or mapping of str to Run
        Run of a tracker of positions; or runs by name, such as those of `arrivals.locate`.
    sensors : array_like, shape (n_sensors, 2), optional
        Sensor positions, m; rows with NaN are left out.
    truth : array_like, shape (n_steps, n_sources, 2), optional
        True positions, m.
    stations : sequence of Station, optional
        Stations, with their names and headings.
    bearings : sequence of (array_like or None), optional
        Azimuths of each station, rad, drawn as rays; such as those of the last step.
    n_ellipses : int
        Maximum number for each label; the last position always has one.
    ax : matplotlib Axes, optional
        Axes of a new figure if None; `save` of `arrivals.plots.bearing_time` writes it.
        A figure of yours has room for the legend by `layout="constrained"`.

    Returns
    -------
    matplotlib Axes
        Axes in metres, of equal scale.

    Raises
    ------
    TypeError
        If the run does not have positions.
    ValueError
        If a shape does not fit, or there are bearings without stations or not one a station.

    Examples
    --------
    >>> from arrivals.scenarios import create
    >>> trial = create("rss_crossing", n_steps=5).sample(np.random.default_rng(0))
    >>> run = trial.tracker("rss_vb").run(trial.measurements)
    >>> plot_map(run, sensors=trial.measurement.sensors).get_xlabel()
    'x, m'
    """
    runs = run if isinstance(run, Mapping) else {"": run}
    for one in runs.values():
        if "position" not in instance("run", one, Run).fields:
            raise TypeError(f"run must contain positions; got {one.kind.__name__}")
    count("n_ellipses", n_ellipses)
    if bearings is not None and stations is None:
        raise ValueError("bearings must come with stations; got None")
    places = None if sensors is None else _points("sensors", sensors, 2)
    paths = None if truth is None else _points("truth", truth, 3)
    ax = new_axes((7.0, 6.4)) if ax is None else ax
    if places is not None:
        x, y = places.T
        marker = "^" if stations is None else "s"  # stations are triangles
        ax.scatter(x, y, s=16, color="0.6", marker=marker, label="sensors")
    if paths is not None:
        for j, path in enumerate(np.moveaxis(paths, 1, 0)):
            ax.plot(*path.T, color="black", linewidth=0.8, linestyle=":",
                    label=None if j else "truth")  # fmt: skip
    n_drawn = 0
    for name, one in runs.items():
        labels = np.unique(one.label[one.label >= 0]).tolist()
        several = label_colours(range(n_drawn, n_drawn + len(labels))).values()
        colours = (
            dict(zip(labels, several, strict=True)) if len(runs) > 1 else label_colours(labels)
        )
        for label in labels:
            number = f"source {label}" if not name or len(labels) > 1 else ""
            text = " ".join(filter(None, (name, number))) if n_drawn < MAX_NAMES else None
            _draw_track(ax, one, label, n_ellipses, text, colours[label])
            n_drawn += 1
    if stations is not None:
        draw_stations(ax, stations)
        ax.margins(MARGIN)
    if stations is not None and bearings is not None:
        draw_bearings(ax, stations, bearings)
    ax.set(xlabel="x, m", ylabel="y, m")
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(color="0.92")
    ax.set_axisbelow(True)
    legend_beside(ax)
    first = next(iter(runs.values()), None)
    places_text = "" if stations is None else f"{len(stations)} stations"
    set_title(ax, "" if first is None else settings_text(first), places_text)
    return ax


def _points(name: str, value: ArrayLike, ndim: int) -> Float:
    """Return positions (..., 2) of so many axes."""
    points = real(name, value)
    if points.ndim != ndim:
        raise ValueError(f"{name} must have {ndim} axes, the last of 2; got shape {points.shape}")
    return shaped(name, points, *points.shape[:-1], 2)


def _draw_track(
    ax: Axes, run: Run, label: int, n_ellipses: int, text: str | None, colour: str
) -> None:
    step, slot = np.nonzero(run.label == label)
    position, spread = run.position[step, slot], run.covariance[step, slot]
    breaks = np.flatnonzero(np.diff(step) > 1) + 1
    for at in breaks.tolist():
        ax.plot(*position[at - 1 : at + 1].T, color=colour, linewidth=PAUSE_WIDTH, label="_pause")
    for n, part in enumerate(np.split(position, breaks)):
        ax.plot(*part.T, color=colour, linewidth=1.6, label=None if n else text)
    ax.scatter(
        position[-1:, 0],
        position[-1:, 1],
        s=22,
        color=colour,
        edgecolors=NEUTRAL,
        linewidths=0.5,
        zorder=4,
    )
    shown = np.unique(np.linspace(len(position) - 1, 0, n_ellipses).round().astype(int))
    for k in shown.tolist():
        x, y = ellipse(position[k], spread[k])
        ax.plot(x, y, color=colour, linewidth=0.7, alpha=0.7)


def ellipse(mean: Float, covariance: Float, confidence: float = CONFIDENCE) -> tuple[Float, Float]:
    """Return x and y of the confidence ellipse of a Gaussian position.

    Parameters
    ----------
    mean : ndarray, shape (2,)
        Mean, m.
    covariance : ndarray, shape (2, 2)
        Covariance, m².
    confidence : float
        Probability that the position lies in the ellipse.

    Examples
    --------
    >>> x, y = ellipse(np.zeros(2), np.diag([4.0, 1.0]))
    >>> round(float(x.max()), 2), round(float(y.max()), 2)
    (4.9, 2.45)
    """
    radius = np.sqrt(-2 * np.log(1 - confidence))  # χ² of two degrees of freedom
    variance, axes = np.linalg.eigh(covariance)
    phi = np.linspace(0, 2 * np.pi, 101)
    circle = np.stack([np.cos(phi), np.sin(phi)])
    x, y = mean[:, None] + radius * (axes * np.sqrt(np.maximum(variance, 0))) @ circle
    return x, y
