"""Kalman filter and QRD-RLS for autoregressive sources."""

from arrivals.trackers.autoregressive.ar_kalman_qrd_rls import ARKalmanQRDRLS
from arrivals.trackers.autoregressive.qrd_rls import QRDRLS
from arrivals.trackers.autoregressive.settings import NoiseSettings, RegressionSettings

__all__ = ["ARKalmanQRDRLS", "NoiseSettings", "QRDRLS", "RegressionSettings"]
