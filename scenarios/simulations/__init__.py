"""Simulated scenes with a known truth, each registered by name."""

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
    StaticSources,
    ThreeStatic,
)
from arrivals.scenarios.simulations.moving_emitters import (
    BirthsAndDeaths,
    CrossingSources,
    WalkingSources,
)
from arrivals.scenarios.simulations.near_field import NearField
from arrivals.scenarios.simulations.planar_arrays import Cardioids, Circle, Grating
from arrivals.scenarios.simulations.random_walks import RandomWalks, SwitchingWalks
from arrivals.scenarios.simulations.rooms import TalkersInRoom
from arrivals.scenarios.simulations.sampled_source import (
    InterpolationBand,
    InterpolationCoupled,
    InterpolationTone,
)
from arrivals.scenarios.simulations.signal_strength import RSSTrial, Table1K3, Table1K7
from arrivals.scenarios.simulations.sources_on_sphere import SourcesOnSphere
from arrivals.scenarios.simulations.speech import SpeechField, SpeechOfOrderTwo
from arrivals.scenarios.simulations.stations import (
    StationsGhost,
    StationsRadio,
    StationsSound,
    StationsTrial,
)
from arrivals.scenarios.simulations.swellex96 import TowPastLine

__all__ = [
    "AutoregressiveField",
    "BirthsAndDeaths",
    "Cardioids",
    "Circle",
    "CrossingSources",
    "FastSource",
    "FourOnThree",
    "Grating",
    "InterpolationBand",
    "InterpolationCoupled",
    "InterpolationTone",
    "MoreSensors",
    "MovingSource",
    "NearField",
    "NoisySources",
    "OnePairOff",
    "PairsInTurn",
    "RSSTrial",
    "RandomPairsOff",
    "RandomWalks",
    "SixSources",
    "SixStatic",
    "SourcesOnSphere",
    "StaticSources",
    "SpeechField",
    "SpeechOfOrderTwo",
    "StationsGhost",
    "StationsRadio",
    "StationsSound",
    "StationsTrial",
    "SwitchingWalks",
    "Table1K3",
    "Table1K7",
    "ThirdOrder",
    "ThreeOnThree",
    "ThreeStatic",
    "TalkersInRoom",
    "TowPastLine",
    "WalkingSources",
    "ar_signals",
]
