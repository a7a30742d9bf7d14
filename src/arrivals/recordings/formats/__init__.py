"""Formats of recording files: WAV, NumPy, MATLAB and text."""
