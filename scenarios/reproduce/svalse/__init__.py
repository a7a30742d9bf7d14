"""VALSE and SVALSE."""
