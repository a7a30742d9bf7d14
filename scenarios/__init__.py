"""What trackers are tried on: simulated truth, recorded data, metrics and plots."""

from arrivals.scenarios.any_arrays import Cardioids, Circle, Grating
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
from arrivals.scenarios.metrics import Gospa, gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.plots import plot_array, plot_bearing_time
from arrivals.scenarios.readers import read
from arrivals.scenarios.recordings import Recording, Snapshots

__all__ = [
    "Cardioids",
    "Circle",
    "Gospa",
    "Grating",
    "InterpolationBand",
    "InterpolationCoupled",
    "InterpolationTone",
    "OnePairOff",
    "PairsInTurn",
    "RandomPairsOff",
    "Recording",
    "Scenario",
    "SixSources",
    "SixStatic",
    "Snapshots",
    "ThreeStatic",
    "Trial",
    "available",
    "create",
    "find",
    "gospa",
    "mean_gospa",
    "mean_rmse",
    "ospa",
    "plot_array",
    "plot_bearing_time",
    "read",
    "register",
    "rmse",
]
