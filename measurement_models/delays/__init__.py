"""Delays between the sensors of a line, from real samples."""
