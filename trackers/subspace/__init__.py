"""Subspace methods."""

from arrivals.trackers.beamforming.source_number import aic, mdl, number_of_sources
from arrivals.trackers.subspace.base import Subspaces, SubspaceTracker
from arrivals.trackers.subspace.covariance import CovarianceSubspace
from arrivals.trackers.subspace.esprit import ESPRIT
from arrivals.trackers.subspace.music import MUSIC
from arrivals.trackers.subspace.music_spectrum import music_spectrum
from arrivals.trackers.subspace.past import PAST
from arrivals.trackers.subspace.root_music import RootMUSIC

__all__ = [
    "ESPRIT",
    "MUSIC",
    "PAST",
    "CovarianceSubspace",
    "RootMUSIC",
    "SubspaceTracker",
    "Subspaces",
    "aic",
    "mdl",
    "music_spectrum",
    "number_of_sources",
]
