"""What sensors see: arrays and their geometry, and the models p(z | x)."""

from arrivals.measurement_models.arrays import SensorArray, direction, steering_vector
from arrivals.measurement_models.base import MeasurementModel
from arrivals.measurement_models.manifolds import GridLine, Manifold
from arrivals.measurement_models.snapshots import ArraySnapshot, composite

__all__ = [
    "ArraySnapshot",
    "GridLine",
    "Manifold",
    "MeasurementModel",
    "SensorArray",
    "composite",
    "direction",
    "steering_vector",
]
