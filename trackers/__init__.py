"""The methods, and the registry that finds them by name."""

from arrivals.trackers.base import Tracker
from arrivals.trackers.cbf import CBF
from arrivals.trackers.estimates import DirectionEstimate, Estimate, PositionEstimate
from arrivals.trackers.recorder import Run
from arrivals.trackers.registry import available, create, find, register
from arrivals.trackers.svalse import SVALSE
from arrivals.trackers.valse import VALSE

__all__ = [
    "CBF",
    "SVALSE",
    "VALSE",
    "DirectionEstimate",
    "Estimate",
    "PositionEstimate",
    "Run",
    "Tracker",
    "available",
    "create",
    "find",
    "register",
]
