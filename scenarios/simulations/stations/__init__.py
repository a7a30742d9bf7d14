"""Scenes of several arrays at known places of a map."""

from arrivals.scenarios.simulations.stations.scenes import (
    StationsGhost,
    StationsRadio,
    StationsSound,
)
from arrivals.scenarios.simulations.stations.trial import StationsTrial

__all__ = ["StationsGhost", "StationsRadio", "StationsSound", "StationsTrial"]
