"""Simulated scenes, metrics, bounds and Monte Carlo studies.

The classes of the scenes are in `arrivals.scenarios.simulations`; `create` makes them by name.
"""

from arrivals.plots.arrays import plot_array
from arrivals.plots.bearing_time import plot_bearing_time
from arrivals.plots.over_time import plot_range
from arrivals.plots.sky import plot_sky
from arrivals.recordings.networks import Network, calibrate, read_network
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording
from arrivals.scenarios.base import Scenario, Trial
from arrivals.scenarios.bounds.detection import exact_detection, network_detection
from arrivals.scenarios.bounds.signal_strength import rss_bound
from arrivals.scenarios.experiments.methods import Method, grid
from arrivals.scenarios.experiments.monte_carlo import monte_carlo
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.metrics.calibration import Reliability, reliability
from arrivals.scenarios.metrics.gospa import Gospa, gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.metrics.separation import nmse, sdr
from arrivals.scenarios.metrics.unlabelled_rmse import best_assignment_rmse
from arrivals.scenarios.registry import available, create, find, register
from arrivals.scenarios.simulations import ar_signals  # registers the scenes

__all__ = [
    "Gospa",
    "Method",
    "Network",
    "Recording",
    "Reliability",
    "Scenario",
    "Study",
    "Trial",
    "ar_signals",
    "available",
    "best_assignment_rmse",
    "calibrate",
    "create",
    "exact_detection",
    "find",
    "gospa",
    "grid",
    "mean_gospa",
    "mean_rmse",
    "monte_carlo",
    "network_detection",
    "nmse",
    "ospa",
    "plot_array",
    "plot_bearing_time",
    "plot_range",
    "plot_sky",
    "read",
    "read_network",
    "register",
    "reliability",
    "rmse",
    "rss_bound",
    "sdr",
]
