"""What trackers are tried on: simulated truth, recorded data, metrics and plots."""

from arrivals.scenarios.any_arrays import Cardioids, Circle, Grating
from arrivals.scenarios.ar_fields import (
    AutoregressiveField,
    FastSource,
    FourOnThree,
    MoreSensors,
    MovingSource,
    NoisySources,
    ThirdOrder,
    ThreeOnThree,
)
from arrivals.scenarios.ar_sources import ar_signals
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
from arrivals.scenarios.methods import Method, grid
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
from arrivals.scenarios.runner import monte_carlo
from arrivals.scenarios.separation import nmse, sdr
from arrivals.scenarios.speech import SpeechField, SpeechOfOrderTwo
from arrivals.scenarios.study import Study
from arrivals.scenarios.swellex96 import TowPastLine
from arrivals.scenarios.unlabelled import best_assignment_rmse
from arrivals.scenarios.waveguides import BottomLayer, Waveguide

__all__ = [
    "AutoregressiveField",
    "BirthsAndDeaths",
    "BottomLayer",
    "Calibration",
    "Cardioids",
    "Circle",
    "CrossingSources",
    "FastSource",
    "FourOnThree",
    "Gospa",
    "Grating",
    "InterpolationBand",
    "InterpolationCoupled",
    "InterpolationTone",
    "Method",
    "MoreSensors",
    "MovingSource",
    "Network",
    "NoisySources",
    "OnePairOff",
    "PairsInTurn",
    "RSSTrial",
    "RandomPairsOff",
    "Recording",
    "Scenario",
    "SixSources",
    "SixStatic",
    "Snapshots",
    "SpeechField",
    "SpeechOfOrderTwo",
    "Study",
    "Table1K3",
    "Table1K7",
    "ThirdOrder",
    "ThreeOnThree",
    "ThreeStatic",
    "TowPastLine",
    "Trial",
    "Waveguide",
    "ar_signals",
    "available",
    "best_assignment_rmse",
    "calibrate",
    "create",
    "exact_detection",
    "find",
    "gospa",
    "grid",
    "huber",
    "mean_gospa",
    "mean_rmse",
    "monte_carlo",
    "network_detection",
    "nmse",
    "ospa",
    "plot_array",
    "plot_bearing_time",
    "read",
    "read_network",
    "register",
    "rmse",
    "rss_bound",
    "scores",
    "sdr",
]
