"""Filtering and smoothing of whole sequences by Gaussian filters."""
