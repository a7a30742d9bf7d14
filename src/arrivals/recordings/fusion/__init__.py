"""Fused positions: stations files, ready-made bearings, recordings of several arrays, and runs."""

from arrivals.recordings.fusion.bearing_tables import BearingTable, read_bearings
from arrivals.recordings.fusion.fused_run import FusedRun
from arrivals.recordings.fusion.fusing import fuse
from arrivals.recordings.fusion.station_plan import StationPlan
from arrivals.recordings.fusion.stations_file import StationsFile, read_stations

__all__ = [
    "BearingTable",
    "FusedRun",
    "StationPlan",
    "StationsFile",
    "fuse",
    "read_bearings",
    "read_stations",
]
