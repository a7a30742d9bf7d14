"""filterpy's names on Gaussian filters: attributes, matrices, and further methods."""
