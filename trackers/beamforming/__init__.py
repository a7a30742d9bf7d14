"""Beamformers."""
