"""What sensors see: arrays and their geometry, and the models p(z | x)."""

from arrivals.measurement_models.array_manifold import ArrayManifold
from arrivals.measurement_models.arrays import SensorArray, direction, steering_vector
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.bearing import Bearing
from arrivals.measurement_models.correlation import (
    Autoregressive,
    FlatBand,
    SourceCorrelation,
    Tones,
)
from arrivals.measurement_models.decibels import (
    db_to_neper,
    dbm_to_neper,
    neper_to_db,
    neper_to_dbm,
    watt_to_neper,
)
from arrivals.measurement_models.delay_line import DelayLine, Phasor
from arrivals.measurement_models.element_responses import ElementResponse
from arrivals.measurement_models.envelope import envelope_moments, log_envelope_moments
from arrivals.measurement_models.fourier_manifolds import FourierManifold, fourier_manifold
from arrivals.measurement_models.interpolation import DelayInterpolator, InterpolationDelay
from arrivals.measurement_models.linear import LinearMeasurement
from arrivals.measurement_models.manifolds import GridLine, Manifold
from arrivals.measurement_models.path_loss import doppler_log_gain
from arrivals.measurement_models.plane_waves import PlaneWaves
from arrivals.measurement_models.rss import LogNormalRSS
from arrivals.measurement_models.samples import ArraySamples
from arrivals.measurement_models.snapshots import ArraySnapshot, composite

__all__ = [
    "ArrayManifold",
    "ArraySamples",
    "ArraySnapshot",
    "Autoregressive",
    "Bearing",
    "DelayInterpolator",
    "DelayLine",
    "ElementResponse",
    "FlatBand",
    "FourierManifold",
    "GridLine",
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
