"""Detection followed by data association."""

from arrivals.trackers.multi_target.peaks_gnn import PeaksGNN
from arrivals.trackers.multi_target.track_bank import TrackBank, nearest

__all__ = ["PeaksGNN", "TrackBank", "nearest"]
