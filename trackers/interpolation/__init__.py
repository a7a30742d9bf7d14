"""The interpolation-delay filter."""
