"""Figs 11 and 12 of Park, Meyer and Gerstoft, JASA 153(1), 2023: a simulated tow at sea."""
