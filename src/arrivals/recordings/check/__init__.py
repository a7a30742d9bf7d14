"""Check of recordings: levels, wiring and size of the array."""

from arrivals.recordings.check.recording_check import check, warn_of_faults
from arrivals.recordings.check.report import ChannelCheck, CheckReport, Fault

__all__ = ["ChannelCheck", "CheckReport", "Fault", "check", "warn_of_faults"]
