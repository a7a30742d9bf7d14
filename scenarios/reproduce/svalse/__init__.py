"""Figs 4 to 10 of Park, Meyer and Gerstoft, JASA 153(1), 2023, and SVALSE on any array."""
