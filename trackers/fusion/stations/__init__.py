"""Bearings of one station in a step, and their association with tracks."""
