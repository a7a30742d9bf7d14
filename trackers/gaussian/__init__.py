"""Gaussian filters, the particle filter, and adapters for filterpy."""

from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.ekf import EKF
from arrivals.trackers.gaussian.filterpy_adapter import as_filterpy
from arrivals.trackers.gaussian.imm import IMM, Filter
from arrivals.trackers.gaussian.kalman import Kalman
from arrivals.trackers.gaussian.particle import Particle
from arrivals.trackers.gaussian.ukf import UKF

__all__ = ["Kalman", "EKF", "UKF", "Particle", "IMM", "Filter", "GaussianFilter", "as_filterpy"]
