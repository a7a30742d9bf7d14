"""The coordinate-ascent solver."""
