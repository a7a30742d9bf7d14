"""Positions of several sources from signal strength."""

from arrivals.trackers.rss.rss_ml import RSSML
from arrivals.trackers.rss.rss_vb import RSSVB
from arrivals.trackers.rss.settings import (
    AmplitudePrior,
    BirthDeath,
    GridSearch,
    MAPSolver,
    VariationalSolver,
)

__all__ = [
    "RSSVB",
    "RSSML",
    "AmplitudePrior",
    "BirthDeath",
    "GridSearch",
    "VariationalSolver",
    "MAPSolver",
]
