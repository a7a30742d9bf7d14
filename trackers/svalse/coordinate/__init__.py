"""Coordinate ascent, the method of the papers."""

from arrivals.trackers.svalse.coordinate.solver import CoordinateSolver, PosteriorName

__all__ = ["CoordinateSolver", "PosteriorName"]
