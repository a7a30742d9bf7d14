"""What trackers are tried on: simulated truth, recorded data, metrics and plots."""

from arrivals.scenarios.base import Scenario, Trial, available, create, register
from arrivals.scenarios.base import find_scenario as find
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
from arrivals.scenarios.methods import Method, grid
from arrivals.scenarios.metrics import Gospa, gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.plots import plot_array, plot_bearing_time
from arrivals.scenarios.readers import read
from arrivals.scenarios.recordings import Recording, Snapshots
from arrivals.scenarios.runner import monte_carlo
from arrivals.scenarios.study import Study

__all__ = [
    "Gospa",
    "InterpolationBand",
    "InterpolationCoupled",
    "InterpolationTone",
    "Method",
    "OnePairOff",
    "PairsInTurn",
    "RandomPairsOff",
    "Recording",
    "Scenario",
    "SixSources",
    "SixStatic",
    "Snapshots",
    "Study",
    "ThreeStatic",
    "Trial",
    "available",
    "create",
    "find",
    "gospa",
    "grid",
    "mean_gospa",
    "mean_rmse",
    "monte_carlo",
    "ospa",
    "plot_array",
    "plot_bearing_time",
    "read",
    "register",
    "rmse",
]
