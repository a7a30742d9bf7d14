"""Swellex96."""
