"""The Newton solver for one problem at a time in plain Python, compiled by numba where it is."""

from arrivals.trackers.svalse.newton.compiled.inputs import solve_compiled
from arrivals.trackers.svalse.newton.compiled.selection import CompiledChoice, is_compiled

__all__ = ["CompiledChoice", "is_compiled", "solve_compiled"]
