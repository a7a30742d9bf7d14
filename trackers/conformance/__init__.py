"""Checks that every tracker passes: ours, and those of other packages."""

from arrivals.trackers.conformance.checks import (
    CHECKS,
    Check,
    MakeTracker,
    Measurements,
    check_tracker,
    difference,
)

__all__ = ["CHECKS", "Check", "MakeTracker", "Measurements", "check_tracker", "difference"]
