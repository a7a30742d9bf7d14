"""Plots of tracks, arrays, maps and studies."""

from arrivals.plots.arrays import plot_array
from arrivals.plots.bearing_time import plot_bearing_time
from arrivals.plots.maps import plot_map
from arrivals.plots.ranges import plot_range
from arrivals.plots.runs import plot
from arrivals.plots.sky import plot_sky
from arrivals.plots.study import plot_metric

__all__ = [
    "plot",
    "plot_array",
    "plot_bearing_time",
    "plot_map",
    "plot_metric",
    "plot_range",
    "plot_sky",
]
