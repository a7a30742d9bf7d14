"""What trackers are tried on: simulated truth, recorded data, metrics and plots."""

from arrivals.plots.bearing_time import plot_array, plot_bearing_time
from arrivals.recordings.network_calibration import Calibration, calibrate
from arrivals.recordings.networks import Network, read_network
from arrivals.recordings.readers import read
from arrivals.recordings.recording import Recording, Snapshots
from arrivals.scenarios.base import Scenario, Trial, available, create, register
from arrivals.scenarios.base import find_scenario as find
from arrivals.scenarios.bounds.detection import exact_detection, network_detection
from arrivals.scenarios.bounds.signal_strength import rss_bound
from arrivals.scenarios.experiments.methods import Method, grid
from arrivals.scenarios.experiments.monte_carlo import monte_carlo
from arrivals.scenarios.experiments.study import Study
from arrivals.scenarios.metrics.gospa import Gospa, gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.metrics.position_errors import huber, scores
from arrivals.scenarios.metrics.separation import nmse, sdr
from arrivals.scenarios.metrics.unlabelled_rmse import best_assignment_rmse
from arrivals.scenarios.ocean_acoustics.waveguide import BottomLayer, Waveguide
from arrivals.scenarios.simulations.ar_signals import ar_signals
from arrivals.scenarios.simulations.autoregressive_sources import (
    AutoregressiveField,
    FastSource,
    FourOnThree,
    MoreSensors,
    MovingSource,
    NoisySources,
    ThirdOrder,
    ThreeOnThree,
)
from arrivals.scenarios.simulations.line_arrays import (
    OnePairOff,
    PairsInTurn,
    RandomPairsOff,
    SixSources,
    SixStatic,
    ThreeStatic,
)
from arrivals.scenarios.simulations.moving_emitters import BirthsAndDeaths, CrossingSources
from arrivals.scenarios.simulations.planar_arrays import Cardioids, Circle, Grating
from arrivals.scenarios.simulations.sampled_source import (
    InterpolationBand,
    InterpolationCoupled,
    InterpolationTone,
)
from arrivals.scenarios.simulations.signal_strength import RSSTrial, Table1K3, Table1K7
from arrivals.scenarios.simulations.speech import SpeechField, SpeechOfOrderTwo
from arrivals.scenarios.simulations.swellex96 import TowPastLine

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
