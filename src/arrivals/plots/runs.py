"""Plot of any run: directions over time, or positions on a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from arrivals.plots.bearing_time import plot_bearing_time
from arrivals.plots.maps import plot_map
from arrivals.trackers.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot(run: Run, **more: Any) -> Axes:
    """Draw the directions of a run over time, or its positions on a map.

    Parameters
    ----------
    run : Run
        Run of a tracker of directions or of positions.
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
    if "doa" in run.fields:
        return plot_bearing_time(run, **{"time": run.time} | more)
    return plot_map(run, **more)
