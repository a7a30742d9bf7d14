"""Station of a stations file: its place, array, recording and options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from arrivals.measurement_models import SensorArray, Station
from arrivals.measurement_models.direction_measurement import DirectionMeasurement
from arrivals.messages import in_line
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class StationPlan:
    """A station of a stations file, before its measurements are known.

    Parameters
    ----------
    name : str
        Name of the station.
    position : ndarray, shape (2,)
        Position on the map, m.
    heading : float or None
        Azimuth of the array's x axis, rad; None if it is not given.
    array : SensorArray or None
        Array, whose directions grow anticlockwise; None for ready-made bearings.
    recording : str, tuple of str or None
        File of the recording, or several whose channels follow each other.
    start : float
        Time of the first sample on the common clock, s.
    options : mapping of str to object
        Options of `station_options`, those of the root included.
    """

    name: str
    position: Float
    heading: float | None
    array: SensorArray | None = None
    recording: str | tuple[str, ...] | None = None
    start: float = 0.0
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def is_compass(self) -> bool:
        """True if ready-made bearings are clockwise from north."""
        return bool(self.options.get("bearings") == "compass")

    def station(self, measurement: DirectionMeasurement | None = None) -> Station:
        """Return the station with a measurement model, None for ready-made bearings.

        Raises
        ------
        ValueError
            If the heading is required and not given.
        """
        if self.heading is None and not (measurement is None and self.is_compass):
            raise ValueError(
                f"station {self.name!r} requires heading_deg or heading_compass_deg: its "
                f"{'bearings are' if measurement is None else 'array is'} relative to the heading"
            )
        return Station(
            measurement,
            self.position,
            self.heading or 0.0,
            heading_std=float(np.deg2rad(self.options.get("heading_std_deg", 0.0))),
            position_std=self.options.get("position_std_m", 0.0),
            wave_speed=self.options.get("wave_speed", np.inf),
            name=self.name,
        )

    def azimuth(self, bearing: Float) -> Float:
        """Return azimuths on the map of ready-made bearings, rad: heading + b, or π/2 - b."""
        turned = np.pi / 2 - bearing if self.is_compass else (self.heading or 0.0) + bearing
        return np.asarray((turned + np.pi) % (2 * np.pi) - np.pi)


@contextmanager
def of_station(name: str) -> Iterator[None]:
    """Begin the messages of errors with the name of a station."""
    try:
        yield
    except (ValueError, TypeError) as error:
        known = f"station {name!r}"
        text = in_line(error)
        raise ValueError(text if text.startswith(known) else f"{known}: {text}") from error
