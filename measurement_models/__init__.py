"""What sensors see: arrays and their geometry, and the models p(z | x)."""

from arrivals.measurement_models.arrays import SensorArray, direction, steering_vector
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.bearing import Bearing
from arrivals.measurement_models.correlation import (
    Autoregressive,
    FlatBand,
    SourceCorrelation,
    Tones,
)
from arrivals.measurement_models.delay_line import DelayLine, Phasor
from arrivals.measurement_models.element_responses import ElementResponse
from arrivals.measurement_models.fourier_manifolds import FourierManifold, fourier_manifold
from arrivals.measurement_models.interpolation import DelayInterpolator, InterpolationDelay
from arrivals.measurement_models.linear import LinearMeasurement
from arrivals.measurement_models.manifolds import GridLine, Manifold
from arrivals.measurement_models.plane_waves import PlaneWaves
from arrivals.measurement_models.samples import ArraySamples
from arrivals.measurement_models.snapshots import ArraySnapshot, composite

__all__ = [
    "ArraySamples",
    "ArraySnapshot",
    "Bearing",
    "Autoregressive",
    "DelayInterpolator",
    "DelayLine",
    "ElementResponse",
    "FlatBand",
    "FourierManifold",
    "GridLine",
    "InterpolationDelay",
    "LinearMeasurement",
    "Manifold",
    "MeasurementModel",
    "Phasor",
    "PlaneWaves",
    "SensorArray",
    "SourceCorrelation",
    "Tones",
    "composite",
    "direction",
    "fourier_manifold",
    "steering_vector",
]
