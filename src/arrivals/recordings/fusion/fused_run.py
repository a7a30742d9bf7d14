"""Fused positions over time, with their stations, and the tracks file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from arrivals.measurement_models import Station
from arrivals.measurement_models.arrays.local_plane import LocalPlane
from arrivals.recordings.networks.times import iso_text
from arrivals.trackers.fusion.fused_estimate import MIN_RECEIVED
from arrivals.trackers.run import Run
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class FusedRun(Run):
    """Positions of the sources over time, from several stations.

    `position` (n_steps, n_slots, 2), m, `velocity`, `covariance`, `existence`, `label` and
    `received` (n_steps, n_slots, n_stations) are arrays over time, as in any `Run`. Where stations
    have latitudes and longitudes, so are `lat` and `lon` (n_steps, n_slots), degrees.

    Parameters
    ----------
    kind, fields, x, n_found, time, elapsed, extras : object
        As in `Run`.
    stations : tuple of Station
        Stations.
    bearings : tuple of (ndarray or None)
        Azimuths on the map, rad, of each station in the last step with any; None where a station
        had no data.
    sensors : ndarray, shape (n_sensors, 2), optional
        Sensors of signal strength, m.
    plane : LocalPlane, optional
        Plane of the positions, where stations have latitudes and longitudes.
    start : float, optional
        Time 0 in seconds since 1970-01-01 UTC, where times have dates.
    understood : str
        What was chosen, in a line.
    """

    stations: tuple[Station, ...] = ()
    bearings: tuple[Float | None, ...] = ()
    sensors: Float | None = None
    plane: LocalPlane | None = None
    start: float | None = None
    understood: str = field(default="", repr=False)

    @classmethod
    def of(cls, run: Run, **more: Any) -> FusedRun:
        """Return a run of `Fused` with its stations.

        Parameters
        ----------
        run : Run
            Run with positions.
        **more : object
            Fields of this class that `Run` does not have.

        Returns
        -------
        FusedRun
        """
        known = {one.name: getattr(run, one.name) for one in fields(Run)}
        plane = more.get("plane")
        if plane is not None:
            lat, lon = plane.to_lat_lon(*np.moveaxis(run.position, -1, 0))
            known["extras"] = {**run.extras, "lat": lat, "lon": lon}
        return cls(**known, **more)

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns of `rows`."""
        return (
            *super().header,
            *(() if self.plane is None else ("lat_deg", "lon_deg")),
            *(() if self.start is None else ("time_utc",)),
        )

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Iterate over the rows of the tracks file.

        Yields
        ------
        tuple
            Step (from 0), time, then the columns of the estimate, of which the last one
            has the names of the stations whose bearings updated the track.
        """
        for step, time in enumerate(self.time.tolist()):
            for slot, row in enumerate(self.estimate(step).rows()):
                weights = self.received[step, slot, : len(self.stations)]
                cells = (step, time, *row[:-1], station_names(self.stations, weights))
                if self.plane is not None:
                    place = (self.lat[step, slot], self.lon[step, slot])
                    cells += tuple(f"{degrees:.8f}" for degrees in place)
                yield cells if self.start is None else (*cells, iso_text(self.start + time))


def station_names(stations: Sequence[Station], weights: Float) -> str:
    """Return the names of stations with weights above 1/2, joined by +.

    Examples
    --------
    >>> stations = [Station(None, [0.0, 0.0], name="mast"), Station(None, [9.0, 0.0], name="roof")]
    >>> station_names(stations, np.array([0.9, 0.8])), station_names(stations, np.array([0.1, 1.0]))
    ('mast+roof', 'roof')
    """
    return "+".join(
        station.name
        for station, weight in zip(stations, weights.tolist(), strict=True)
        if weight > MIN_RECEIVED
    )
