"""What trackers are tried on: simulated truth, recorded data, metrics and plots."""

from arrivals.scenarios.base import Scenario, Trial, available, create, register
from arrivals.scenarios.base import find_scenario as find
from arrivals.scenarios.detection import exact_detection, network_detection
from arrivals.scenarios.interpolation import (
    InterpolationBand,
    InterpolationCoupled,
    InterpolationTone,
)
from arrivals.scenarios.line_arrays import (
    OnePairOff,
    PairsInTurn,
    RandomPairsOff,
    SixSources,
    SixStatic,
    ThreeStatic,
)
from arrivals.scenarios.metrics import Gospa, gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.networks import Network, read_network
from arrivals.scenarios.plots import plot_array, plot_bearing_time
from arrivals.scenarios.readers import read
from arrivals.scenarios.recordings import Recording, Snapshots
from arrivals.scenarios.rss import RSSTrial, Table1K3, Table1K7
from arrivals.scenarios.rss_bounds import rss_bound
from arrivals.scenarios.rss_calibration import Calibration, calibrate
from arrivals.scenarios.rss_metrics import huber, scores
from arrivals.scenarios.rss_moving import BirthsAndDeaths, CrossingSources

__all__ = [
    "BirthsAndDeaths",
    "Calibration",
    "CrossingSources",
    "Gospa",
    "InterpolationBand",
    "InterpolationCoupled",
    "InterpolationTone",
    "Network",
    "OnePairOff",
    "PairsInTurn",
    "RSSTrial",
    "RandomPairsOff",
    "Recording",
    "Scenario",
    "SixSources",
    "SixStatic",
    "Snapshots",
    "Table1K3",
    "Table1K7",
    "ThreeStatic",
    "Trial",
    "available",
    "calibrate",
    "create",
    "exact_detection",
    "find",
    "gospa",
    "huber",
    "mean_gospa",
    "mean_rmse",
    "network_detection",
    "ospa",
    "plot_array",
    "plot_bearing_time",
    "read",
    "read_network",
    "register",
    "rmse",
    "rss_bound",
    "scores",
]
