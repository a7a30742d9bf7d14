"""What sensors see: arrays and their geometry, and the models p(z | x)."""

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.element_response import ElementResponse
from arrivals.measurement_models.arrays.plane_waves import PlaneWaves
from arrivals.measurement_models.arrays.sensor_array import SensorArray, direction, steering_vector
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.bearing import Bearing
from arrivals.measurement_models.combined import CombinedMeasurement
from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.measurement_models.delays.delay_line import DelayLine, Phasor
from arrivals.measurement_models.delays.interpolation import DelayInterpolator, InterpolationDelay
from arrivals.measurement_models.delays.source_correlation import (
    Autoregressive,
    FlatBand,
    SourceCorrelation,
    Tones,
)
from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.function import FunctionMeasurement
from arrivals.measurement_models.linear import LinearMeasurement
from arrivals.measurement_models.manifolds.fourier import FourierManifold, fourier_manifold
from arrivals.measurement_models.manifolds.manifold import Manifold
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.measurement_models.manifolds.uniform_line import UniformLineManifold
from arrivals.measurement_models.signal_strength.decibels import (
    db_to_neper,
    dbm_to_neper,
    neper_to_db,
    neper_to_dbm,
    watt_to_neper,
)
from arrivals.measurement_models.signal_strength.envelope import (
    envelope_moments,
    log_envelope_moments,
)
from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.measurement_models.signal_strength.path_loss import doppler_log_gain
from arrivals.measurement_models.snapshot_likelihood import composite

__all__ = [
    "ArrayManifold",
    "ArraySamples",
    "ArraySnapshot",
    "Autoregressive",
    "Bearing",
    "CombinedMeasurement",
    "DelayInterpolator",
    "DelayLine",
    "DirectionMeasurement",
    "ElementResponse",
    "FlatBand",
    "FourierManifold",
    "UniformLineManifold",
    "FunctionMeasurement",
    "InterpolationDelay",
    "LinearMeasurement",
    "LogNormalRSS",
    "Manifold",
    "MeasurementModel",
    "Phasor",
    "PlaneWaves",
    "SensorArray",
    "SourceCorrelation",
    "Tones",
    "composite",
    "db_to_neper",
    "dbm_to_neper",
    "direction",
    "doppler_log_gain",
    "envelope_moments",
    "fourier_manifold",
    "log_envelope_moments",
    "neper_to_db",
    "neper_to_dbm",
    "steering_vector",
    "watt_to_neper",
]
