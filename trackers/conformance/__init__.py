"""Checks that every tracker passes, those of other packages included."""

from arrivals.trackers.conformance.checks import CHECKS, check_tracker
from arrivals.trackers.conformance.comparison import difference
from arrivals.trackers.conformance.stepping import Check, MakeTracker, Measurements

__all__ = ["CHECKS", "Check", "MakeTracker", "Measurements", "check_tracker", "difference"]
