"""Plots of tracks, arrays, maps, studies and calibration."""

from arrivals.plots.arrays import plot_array
from arrivals.plots.bearing_time import plot_bearing_time
from arrivals.plots.calibration import plot_coverage, plot_reliability
from arrivals.plots.maps import plot_map
from arrivals.plots.over_time import plot_range, plot_tracks
from arrivals.plots.runs import plot
from arrivals.plots.sky import plot_sky
from arrivals.plots.study import plot_metric

__all__ = [
    "plot",
    "plot_array",
    "plot_bearing_time",
    "plot_coverage",
    "plot_map",
    "plot_metric",
    "plot_range",
    "plot_reliability",
    "plot_sky",
    "plot_tracks",
]
