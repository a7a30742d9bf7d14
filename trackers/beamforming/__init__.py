"""Beamformers and the kernels of spatial spectra."""

from arrivals.trackers.beamforming.cbf import CBF
from arrivals.trackers.beamforming.covariance import (
    RunningCovariance,
    diagonal_loading,
    spatial_smoothing,
)
from arrivals.trackers.beamforming.model_grid import scan_grid
from arrivals.trackers.beamforming.mvdr import MVDR, capon_power
from arrivals.trackers.beamforming.scan_ends import ends_coincide, scan_is_joined
from arrivals.trackers.beamforming.scan_grid import AngleGrid, ScanGrid
from arrivals.trackers.beamforming.spectrum import (
    bartlett_power,
    find_peaks,
    local_maxima,
    mean_beam_power,
    parabolic_peak,
    refine_peaks,
    scan_directions,
    scan_steering_matrix,
)
from arrivals.trackers.beamforming.sphere_grid import SphereGrid

__all__ = [
    "CBF",
    "MVDR",
    "AngleGrid",
    "RunningCovariance",
    "ScanGrid",
    "SphereGrid",
    "bartlett_power",
    "capon_power",
    "diagonal_loading",
    "ends_coincide",
    "find_peaks",
    "local_maxima",
    "mean_beam_power",
    "parabolic_peak",
    "refine_peaks",
    "scan_directions",
    "scan_grid",
    "scan_is_joined",
    "scan_steering_matrix",
    "spatial_smoothing",
]
