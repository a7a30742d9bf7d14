"""Measurement models: measurements of a state by sensors; arrays and their geometry."""

from arrivals.measurement_models.array_snapshot import ArraySnapshot
from arrivals.measurement_models.arrays.element_response import ElementResponse
from arrivals.measurement_models.arrays.noise_coherence import NoiseCoherence
from arrivals.measurement_models.arrays.sensor_array import SensorArray, steering_vector
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.bearing import Bearing
from arrivals.measurement_models.combined import CombinedMeasurement
from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.measurement_models.delays.delay_line import DelayLine, Phasor
from arrivals.measurement_models.delays.interpolation import DelayInterpolator, InterpolationDelay
from arrivals.measurement_models.delays.source_correlation import Autoregressive, FlatBand, Tones
from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.measurement_models.function import FunctionMeasurement
from arrivals.measurement_models.linear import LinearMeasurement
from arrivals.measurement_models.manifolds.manifold import AngleManifold, Manifold, PointManifold
from arrivals.measurement_models.manifolds.symmetric_line import ArrayManifold
from arrivals.measurement_models.signal_strength.decibels import (
    db_to_neper,
    dbm_to_neper,
    neper_to_db,
)
from arrivals.measurement_models.signal_strength.envelope import AveragedEnvelope
from arrivals.measurement_models.signal_strength.gains import LogGains
from arrivals.measurement_models.signal_strength.log_normal import LogNormalRSS
from arrivals.measurement_models.snapshot_likelihood import composite
from arrivals.measurement_models.station import Station, StationEntries

__all__ = [
    "MeasurementModel",
    # arrays
    "SensorArray",
    "ElementResponse",
    "steering_vector",
    # snapshots of an array
    "ArraySnapshot",
    "NoiseCoherence",
    "composite",
    "DirectionMeasurement",
    "Manifold",
    "AngleManifold",
    "PointManifold",
    "ArrayManifold",
    # bearings and signal strength
    "Bearing",
    "Station",
    "StationEntries",
    "LogNormalRSS",
    "AveragedEnvelope",
    "LogGains",
    "db_to_neper",
    "dbm_to_neper",
    "neper_to_db",
    # samples of one source
    "ArraySamples",
    "FlatBand",
    "Tones",
    "Autoregressive",
    "DelayInterpolator",
    "InterpolationDelay",
    "DelayLine",
    "Phasor",
    # models from parts
    "LinearMeasurement",
    "FunctionMeasurement",
    "CombinedMeasurement",
]
