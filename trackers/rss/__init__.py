"""Positions from signal strength."""
