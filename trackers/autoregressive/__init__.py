"""AR Kalman filter with QRD-RLS."""
