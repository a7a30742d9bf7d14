"""Received signal strength: path loss, envelope statistics, log-normal readings."""
