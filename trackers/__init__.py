"""The methods, and the registry that finds them by name."""

from arrivals.trackers.base import Tracker
from arrivals.trackers.cbf import CBF
from arrivals.trackers.ekf import EKF
from arrivals.trackers.estimates import DirectionEstimate, Estimate, PositionEstimate, StateEstimate
from arrivals.trackers.filterpy_bridge import as_filterpy
from arrivals.trackers.imm import IMM, Filter
from arrivals.trackers.interpolation_ekf import InterpolationEKF
from arrivals.trackers.kalman import Kalman
from arrivals.trackers.kalman_type import KalmanType
from arrivals.trackers.mvdr import MVDR
from arrivals.trackers.particle import Particle
from arrivals.trackers.peaks_gnn import PeaksGNN
from arrivals.trackers.recorder import Run
from arrivals.trackers.registry import available, create, find, register
from arrivals.trackers.sbl import SBL
from arrivals.trackers.ssbl import SSBL
from arrivals.trackers.svalse import SVALSE
from arrivals.trackers.ukf import UKF
from arrivals.trackers.valse import VALSE

__all__ = [
    "CBF",
    "EKF",
    "IMM",
    "MVDR",
    "SBL",
    "SSBL",
    "SVALSE",
    "UKF",
    "VALSE",
    "DirectionEstimate",
    "Estimate",
    "Filter",
    "InterpolationEKF",
    "Kalman",
    "KalmanType",
    "Particle",
    "PeaksGNN",
    "PositionEstimate",
    "Run",
    "StateEstimate",
    "Tracker",
    "as_filterpy",
    "available",
    "create",
    "find",
    "register",
]
