"""The Newton solver."""
