"""Gaussian and particle filters, and filterpy's contract."""
