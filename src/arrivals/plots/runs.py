"""Plot of any run: directions over time or on the sky, ranges or states over time, maps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from arrivals.messages import shown
from arrivals.plots.bearing_time import plot_bearing_time
from arrivals.plots.maps import plot_map
from arrivals.plots.over_time import plot_range, plot_tracks
from arrivals.plots.sky import plot_sky
from arrivals.trackers.run import Run
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OVER_TIME = (
    "time",
    "snapshots",
    "measurement",
    "dynamic_range_db",
    "normalize",
)  # not drawn on the sky


class PlacedRuns(Protocol):
    """Runs of trackers of positions by name, as `arrivals.locate` returns them."""

    @property
    def runs(self) -> Mapping[str, Run]:
        """Runs by name."""

    @property
    def sensors(self) -> Float:
        """Sensor positions, m, (n_sensors, 2)."""

    @property
    def truth(self) -> Float | None:
        """True positions, m, (n_steps, n_sources, 2), if they are known."""


def plot(run: Run | PlacedRuns, **more: Any) -> Axes:
    """Draw the directions of a run over time or on the sky, positions on a map, or a state.

    Runs with elevations are drawn by `plot_sky`; of runs with ranges, directions are above by
    `plot_bearing_time`, and ranges below by `plot_range`. Positions are drawn by `plot_map`, the
    states of Kalman filters by `plot_tracks`.

    Parameters
    ----------
    run : Run, or the result of `arrivals.locate` or `arrivals.fuse`
        Run of a tracker of directions or of positions, or several of positions.
    **more : object
        Arguments of these functions; the times are those of the run. Times and snapshots are not
        drawn on the sky.

    Returns
    -------
    matplotlib Axes
        Axes of a new figure without a window, of the ranges if there are any;
        `ax.figure.savefig("tracks.png")` writes it.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers import CBF
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0)
    >>> plot(CBF(model).run([model.steering_vector(0.5)])).get_ylabel()
    'direction of arrival, degrees'
    """
    if not isinstance(run, Run):
        if not hasattr(run, "runs"):
            raise TypeError(f"run must be a Run, or the result of locate; got {shown(run)}")
        return plot_map(run.runs, **{"sensors": run.sensors, "truth": run.truth} | more)
    if "elevation" in run.fields:
        return plot_sky(run, **{key: more[key] for key in more if key not in OVER_TIME})
    if "range" in run.fields:
        return _plot_directions_and_ranges(run, **{"time": run.time} | more)
    if "doa" in run.fields:
        return plot_bearing_time(run, **{"time": run.time} | more)
    if "position" not in run.fields:
        return plot_tracks(run, **{"time": run.time} | more)
    # a run of `arrivals.fuse` has stations, and perhaps sensors
    known = {name: getattr(run, name, None) for name in ("stations", "bearings", "sensors")}
    return plot_map(run, **{name: one for name, one in known.items() if one is not None} | more)


def _plot_directions_and_ranges(run: Run, *, time: Any, **more: Any) -> Axes:
    from matplotlib.figure import Figure

    if "ax" in more:
        return plot_range(run, time=time, ax=more["ax"])
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    above, below = figure.subplots(2, sharex=True, height_ratios=(4, 3))
    plot_bearing_time(run, time=time, ax=above, **more).set_xlabel("")
    below = plot_range(run, time=time, ax=below)
    below.set_title(below.get_title().removeprefix(above.get_title()).lstrip(", \n"), fontsize=10)
    return below
