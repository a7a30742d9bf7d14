"""Delays."""
