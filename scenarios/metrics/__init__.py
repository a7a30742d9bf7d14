"""Errors of estimates against the truth, and the consistency of their stated deviations."""

from arrivals.scenarios.metrics.assignment import label_switches, matches, track_lengths
from arrivals.scenarios.metrics.calibration import Reliability, reliability
from arrivals.scenarios.metrics.consistency import (
    circular_nees,
    coverage,
    position_coverage,
    position_nees,
)
from arrivals.scenarios.metrics.gospa import Gospa, gospa, mean_gospa, mean_rmse, ospa, rmse
from arrivals.scenarios.metrics.position_errors import huber, scores
from arrivals.scenarios.metrics.registry import METRICS, RANGE_METRICS
from arrivals.scenarios.metrics.separation import nmse, sdr
from arrivals.scenarios.metrics.unlabelled_rmse import best_assignment_rmse

__all__ = [
    "METRICS",
    "RANGE_METRICS",
    "Gospa",
    "Reliability",
    "best_assignment_rmse",
    "circular_nees",
    "coverage",
    "gospa",
    "huber",
    "label_switches",
    "matches",
    "mean_gospa",
    "mean_rmse",
    "nmse",
    "ospa",
    "position_coverage",
    "position_nees",
    "reliability",
    "rmse",
    "scores",
    "sdr",
    "track_lengths",
]
