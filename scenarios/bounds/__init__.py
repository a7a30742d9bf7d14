"""Cramér-Rao bounds of directions and positions, and probabilities of detection."""

from arrivals.scenarios.bounds.delay import band_bound, exact_bound, tone_bound
from arrivals.scenarios.bounds.detection import exact_detection, network_detection
from arrivals.scenarios.bounds.signal_strength import rss_bound
from arrivals.scenarios.bounds.snapshot import line_bound, snapshot_bound
from arrivals.scenarios.bounds.stations import bearing_information, posterior_bound
from arrivals.scenarios.bounds.two_unknowns import range_bound, sphere_bound

__all__ = [
    "band_bound",
    "bearing_information",
    "exact_bound",
    "exact_detection",
    "line_bound",
    "network_detection",
    "posterior_bound",
    "range_bound",
    "rss_bound",
    "snapshot_bound",
    "sphere_bound",
    "tone_bound",
]
