"""SVALSE, VALSE and the solvers of their steps."""

from arrivals.trackers.svalse.components import ComponentPosterior, ComponentPrior, Solver
from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver
from arrivals.trackers.svalse.newton.solver import NewtonSolver
from arrivals.trackers.svalse.newton.support_search import IterationLimits
from arrivals.trackers.svalse.svalse import SVALSE
from arrivals.trackers.svalse.valse import VALSE

__all__ = [
    "SVALSE",
    "VALSE",
    "ComponentPosterior",
    "ComponentPrior",
    "CoordinateSolver",
    "IterationLimits",
    "NewtonSolver",
    "Solver",
]
