"""Trackers, their estimates, and the registry of trackers."""

from arrivals.measurements import is_missing
from arrivals.trackers.autoregressive.ar_kalman_qrd_rls import ARKalmanQRDRLS
from arrivals.trackers.autoregressive.qrd_rls import QRDRLS
from arrivals.trackers.base import Tracker
from arrivals.trackers.beamforming.cbf import CBF
from arrivals.trackers.beamforming.mvdr import MVDR
from arrivals.trackers.beamforming.spectrum import find_peaks, refine_peaks
from arrivals.trackers.direction_estimates import RangeEstimate, SourceEstimate, SphereEstimate
from arrivals.trackers.direction_tracker import DirectionTracker
from arrivals.trackers.estimates import (
    DirectionEstimate,
    Estimate,
    PositionEstimate,
    StateEstimate,
)
from arrivals.trackers.fusion.fused import Fused
from arrivals.trackers.fusion.fused_estimate import FusedEstimate
from arrivals.trackers.fusion.settings import BearingDetection, GlobalHypotheses
from arrivals.trackers.fusion.stations.single_step_bearings import bearings
from arrivals.trackers.gaussian.base import GaussianFilter
from arrivals.trackers.gaussian.ekf import EKF
from arrivals.trackers.gaussian.filterpy_adapter import as_filterpy
from arrivals.trackers.gaussian.imm import IMM, Filter
from arrivals.trackers.gaussian.kalman import Kalman
from arrivals.trackers.gaussian.particle import Particle
from arrivals.trackers.gaussian.ukf import UKF
from arrivals.trackers.interpolation.interpolation_ekf import InterpolationEKF
from arrivals.trackers.multi_target.peaks_gnn import PeaksGNN
from arrivals.trackers.registry import available, create, find, register
from arrivals.trackers.rss.rss_ml import RSSML
from arrivals.trackers.rss.rss_vb import RSSVB
from arrivals.trackers.rss.sensor_subset import update_by_cells
from arrivals.trackers.rss.settings import (
    AmplitudePrior,
    BirthDeath,
    GridSearch,
    MAPSolver,
    VariationalSolver,
)
from arrivals.trackers.run import Run
from arrivals.trackers.sparse_bayes.fixed_point import FixedPointSolver
from arrivals.trackers.sparse_bayes.sbl import SBL
from arrivals.trackers.sparse_bayes.ssbl import SSBL
from arrivals.trackers.subspace.esprit import ESPRIT
from arrivals.trackers.subspace.music import MUSIC
from arrivals.trackers.subspace.past import PAST
from arrivals.trackers.subspace.root_music import RootMUSIC
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.trackers.svalse.newton.solver import NewtonSolver
from arrivals.trackers.svalse.svalse import SVALSE
from arrivals.trackers.svalse.valse import VALSE
from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.wideband_mixture import WidebandMixture

__all__ = [
    "ARKalmanQRDRLS",
    "AmplitudePrior",
    "BearingDetection",
    "BirthDeath",
    "CBF",
    "CoordinateSolver",
    "DirectionEstimate",
    "DirectionTracker",
    "EKF",
    "ESPRIT",
    "Estimate",
    "Filter",
    "FixedPointSolver",
    "Fused",
    "FusedEstimate",
    "IMM",
    "InterpolationEKF",
    "Kalman",
    "GaussianFilter",
    "GlobalHypotheses",
    "GridSearch",
    "MAPSolver",
    "MUSIC",
    "MVDR",
    "MixtureSettings",
    "NewtonSolver",
    "PAST",
    "Particle",
    "PeaksGNN",
    "PositionEstimate",
    "QRDRLS",
    "RSSML",
    "RSSVB",
    "RangeEstimate",
    "RootMUSIC",
    "Run",
    "SBL",
    "SSBL",
    "SVALSE",
    "SourceEstimate",
    "SphereEstimate",
    "StateEstimate",
    "Tracker",
    "UKF",
    "VALSE",
    "VariationalSolver",
    "WidebandMixture",
    "as_filterpy",
    "available",
    "bearings",
    "create",
    "find",
    "find_peaks",
    "is_missing",
    "refine_peaks",
    "register",
    "update_by_cells",
]
