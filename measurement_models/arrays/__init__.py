"""Arrays of sensors: positions, files, element responses, ambiguities."""

from arrivals.measurement_models.arrays.description import from_description
from arrivals.measurement_models.arrays.element_response import ElementResponse
from arrivals.measurement_models.arrays.files import from_csv, from_file, from_toml
from arrivals.measurement_models.arrays.sensor_array import SensorArray, steering_vector

__all__ = [
    "ElementResponse",
    "SensorArray",
    "from_csv",
    "from_description",
    "from_file",
    "from_toml",
    "steering_vector",
]

for reader in (from_csv, from_file, from_toml):  # here, because `files` imports the class
    setattr(SensorArray, reader.__name__, staticmethod(reader))
