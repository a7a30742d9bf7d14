"""Demonstrations on shipped data: several trackers, a table of tracks of each, one picture."""
