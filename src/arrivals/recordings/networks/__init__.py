"""Readings of signal strength: tables, networks, and the positions of sources."""

from arrivals.recordings.networks.calibration import Calibration, calibrate
from arrivals.recordings.networks.network import Network
from arrivals.recordings.networks.network_files import read_network
from arrivals.recordings.networks.sensor_tables import read_sensors

__all__ = ["Calibration", "Network", "calibrate", "read_network", "read_sensors"]
