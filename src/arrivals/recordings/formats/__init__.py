"""Formats of recording files: a module for each, and their registry."""
