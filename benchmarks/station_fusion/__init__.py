"""Cells, methods and scores of benchmarks/fusion.py."""
