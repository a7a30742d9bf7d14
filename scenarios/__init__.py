"""What trackers are tried on: simulated truth, recorded data, metrics and plots."""

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
from arrivals.scenarios.metrics import (
    Gospa,
    gospa,
    mean_gospa,
    mean_rmse,
    ospa,
    rmse,
)
from arrivals.scenarios.plots import plot_array, plot_bearing_time
from arrivals.scenarios.readers import read
from arrivals.scenarios.recordings import Recording, Snapshots
from arrivals.scenarios.separation import nmse, sdr
from arrivals.scenarios.speech import SpeechField, SpeechOfOrderTwo
from arrivals.scenarios.unlabelled import best_assignment_rmse

__all__ = [
    "AutoregressiveField",
    "FastSource",
    "FourOnThree",
    "MoreSensors",
    "MovingSource",
    "NoisySources",
    "ThirdOrder",
    "ThreeOnThree",
    "SpeechField",
    "SpeechOfOrderTwo",
from arrivals.scenarios.swellex96 import TowPastLine
from arrivals.scenarios.waveguides import BottomLayer, Waveguide

__all__ = [
    "BottomLayer",
    "Gospa",
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
    "TowPastLine",
    "Trial",
    "ar_signals",
    "Waveguide",
    "available",
    "best_assignment_rmse",
    "create",
    "find",
    "gospa",
    "mean_gospa",
    "mean_rmse",
    "nmse",
    "ospa",
    "plot_array",
    "plot_bearing_time",
    "read",
    "register",
    "rmse",
    "sdr",
]
