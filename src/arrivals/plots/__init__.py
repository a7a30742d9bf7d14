"""Plots of tracks, arrays, maps and studies."""
