"""Plot of any run: directions over time, or positions on a map."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from arrivals.plots.bearing_time import plot_bearing_time
from arrivals.plots.maps import plot_map
from arrivals.trackers.run import Run
from arrivals.typing import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
    """Draw the directions of a run over time, or positions on a map.

    Parameters
    ----------
    run : Run, or the result of `arrivals.locate`
        Run of a tracker of directions or of positions, or several of positions.
    **more : object
        Arguments of `plot_bearing_time` or of `plot_map`; the times are those of the run.

    Returns
    -------
    matplotlib Axes
        Axes of a new figure without a window; `ax.figure.savefig("tracks.png")` writes it.

    Examples
    --------
    >>> from arrivals.measurement_models import ArraySnapshot, SensorArray
    >>> from arrivals.trackers import CBF
    >>> model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0)
    >>> plot(CBF(model).run([model.steering_vector(0.5)])).get_ylabel()
    'direction of arrival, degrees'
    """
    if not isinstance(run, Run):
        return plot_map(run.runs, **{"sensors": run.sensors, "truth": run.truth} | more)
    if "doa" in run.fields:
        return plot_bearing_time(run, **{"time": run.time} | more)
    return plot_map(run, **more)
