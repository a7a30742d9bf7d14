"""The number of emitters."""
