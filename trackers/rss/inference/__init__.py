"""Inference for one set of readings."""
