"""Choice of frequencies, windows and tracker for a recording."""

from arrivals.recordings.choice.limits import BandLimits
from arrivals.recordings.choice.options import Choice, TrackOptions
from arrivals.recordings.choice.rules import choose
from arrivals.recordings.choice.spectrum import MeanSpectrum

__all__ = ["BandLimits", "Choice", "MeanSpectrum", "TrackOptions", "choose"]
