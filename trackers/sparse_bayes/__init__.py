"""Sparse Bayesian learning on a scan grid."""

from arrivals.trackers.sparse_bayes.fixed_point import FixedPointSolver
from arrivals.trackers.sparse_bayes.sbl import SBL
from arrivals.trackers.sparse_bayes.ssbl import SSBL

__all__ = ["SBL", "SSBL", "FixedPointSolver"]
