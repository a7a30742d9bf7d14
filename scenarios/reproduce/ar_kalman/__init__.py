"""Figs 1 to 9 of the report on joint tracking of directions and source signals, and its claims."""
