"""Interpolation-delay filter: one direction from real samples of a line."""

from arrivals.trackers.interpolation.interpolation_ekf import InterpolationEKF
from arrivals.trackers.interpolation.variants import VARIANTS, Variant

__all__ = ["VARIANTS", "InterpolationEKF", "Variant"]
