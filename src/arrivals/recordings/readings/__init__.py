"""Readings of signal strength: tables, networks, and the positions of sources."""

from arrivals.recordings.readings.calibration import Calibration, calibrate
from arrivals.recordings.readings.network import Network
from arrivals.recordings.readings.network_files import read_network
from arrivals.recordings.readings.sensor_tables import read_sensors

__all__ = ["Calibration", "Network", "calibrate", "read_network", "read_sensors"]
