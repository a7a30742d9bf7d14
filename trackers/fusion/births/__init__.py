"""Births of tracks: crossings of bearings, rays with signal strength."""
