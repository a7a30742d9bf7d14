"""Trackers and measurements of each family for the conformance checks."""
