"""Malformed inputs for trackers, models, files and the command line, and what counts as a fault."""
