"""The methods, and the registry that finds them by name."""

from arrivals.trackers.ar_kalman_qrd_rls import ARKalmanQRDRLS
from arrivals.trackers.base import Tracker
from arrivals.trackers.cbf import CBF
from arrivals.trackers.ekf import EKF
from arrivals.trackers.esprit import ESPRIT
from arrivals.trackers.estimates import (
    DirectionEstimate,
    Estimate,
    PositionEstimate,
    SourceEstimate,
    StateEstimate,
)
from arrivals.trackers.filterpy_bridge import as_filterpy
from arrivals.trackers.imm import IMM, Filter
from arrivals.trackers.interpolation_ekf import InterpolationEKF
from arrivals.trackers.kalman import Kalman
from arrivals.trackers.kalman_type import KalmanType
from arrivals.trackers.music import MUSIC
from arrivals.trackers.mvdr import MVDR
from arrivals.trackers.particle import Particle
from arrivals.trackers.past import PAST
from arrivals.trackers.peaks_gnn import PeaksGNN
from arrivals.trackers.qrd_rls import QRDRLS
from arrivals.trackers.recorder import Run
from arrivals.trackers.registry import available, create, find, register
from arrivals.trackers.root_music import RootMUSIC
from arrivals.trackers.rss_ml import RSSML
from arrivals.trackers.rss_vb import RSSVB
from arrivals.trackers.sbl import SBL
from arrivals.trackers.ssbl import SSBL
from arrivals.trackers.svalse import SVALSE
from arrivals.trackers.ukf import UKF
from arrivals.trackers.valse import VALSE

__all__ = [
    "ARKalmanQRDRLS",
    "CBF",
    "DirectionEstimate",
    "EKF",
    "ESPRIT",
    "Estimate",
    "Filter",
    "IMM",
    "InterpolationEKF",
    "Kalman",
    "KalmanType",
    "MUSIC",
    "MVDR",
    "PAST",
    "Particle",
    "PeaksGNN",
    "PositionEstimate",
    "QRDRLS",
    "RSSML",
    "RSSVB",
    "RootMUSIC",
    "Run",
    "SBL",
    "SSBL",
    "SVALSE",
    "SourceEstimate",
    "StateEstimate",
    "Tracker",
    "UKF",
    "VALSE",
    "as_filterpy",
    "available",
    "create",
    "find",
    "register",
]
