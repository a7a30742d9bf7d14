"""Positions from the directions of several stations, and from signal strength."""

from arrivals.trackers.fusion.fused import Fused
from arrivals.trackers.fusion.fused_estimate import FusedEstimate
from arrivals.trackers.fusion.settings import BearingDetection, GlobalHypotheses

__all__ = ["BearingDetection", "Fused", "FusedEstimate", "GlobalHypotheses"]
