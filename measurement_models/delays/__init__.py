"""Delays between the sensors of a line, from real samples."""

from arrivals.measurement_models.delays.array_samples import ArraySamples
from arrivals.measurement_models.delays.delay_line import DelayLine, Phasor
from arrivals.measurement_models.delays.interpolation import DelayInterpolator, InterpolationDelay
from arrivals.measurement_models.delays.source_correlation import (
    Autoregressive,
    FlatBand,
    SourceCorrelation,
    Tones,
)

__all__ = [
    "ArraySamples",
    "SourceCorrelation",
    "FlatBand",
    "Tones",
    "Autoregressive",
    "DelayInterpolator",
    "InterpolationDelay",
    "DelayLine",
    "Phasor",
]
