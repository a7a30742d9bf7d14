"""Array responses as Fourier series of an angle."""
