"""Table 1 and Figs 2 to 8 of the paper on the interpolation-delay filter."""
