"""Mixture over time-frequency bins, for wideband sources in diffuse sound."""

from arrivals.trackers.wideband.settings import MixtureSettings
from arrivals.trackers.wideband.wideband_mixture import WidebandMixture

__all__ = ["MixtureSettings", "WidebandMixture"]
