"""Solver by joint Newton steps and single changes of the support."""

from arrivals.trackers.svalse.newton.solver import NewtonSolver
from arrivals.trackers.svalse.newton.support_search import IterationLimits

__all__ = ["IterationLimits", "NewtonSolver"]
