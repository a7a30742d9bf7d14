"""Ocean acoustics."""
