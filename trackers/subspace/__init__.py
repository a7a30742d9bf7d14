"""Subspace methods."""
