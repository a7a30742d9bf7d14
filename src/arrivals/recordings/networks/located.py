"""Positions of sources by device, and the positions file."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from os import PathLike

import numpy as np

from arrivals.files import atomic_write
from arrivals.recordings.networks.network import Network
from arrivals.recordings.networks.times import iso_text
from arrivals.trackers.run import Run, header, text
from arrivals.typing import Float


@dataclass(frozen=True, eq=False)
class Located:
    """Positions of the sources of each device.

    Parameters
    ----------
    runs : mapping of str to Run
        Estimates by device; by "" where the readings have no devices. Where the sensors have
        latitudes and longitudes, a run has `lat` and `lon` (n_steps, n_slots), degrees.
    networks : mapping of str to Network
        Readings in steps.
    has_devices : bool
        Whether the readings have devices.
    understood : str
        How the readings were understood, in a line.
    """

    runs: Mapping[str, Run]
    networks: Mapping[str, Network]
    has_devices: bool
    understood: str

    @property
    def run(self) -> Run:
        """The run of the only device.

        Raises
        ------
        ValueError
            If there are several.
        """
        if len(self.runs) != 1:
            raise ValueError(f"run must be one of runs[...]: {', '.join(self.runs)}")
        return next(iter(self.runs.values()))

    @property
    def sensors(self) -> Float:
        """Last positions of the sensors of all devices, m, (n_sensors, 2)."""
        last = [network.sensors[-1] for network in self.networks.values()]
        return np.unique(np.concatenate(last), axis=0)

    @property
    def truth(self) -> Float | None:
        """True positions, m, of the first device, if they are known."""
        return next(iter(self.networks.values())).truth

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns of `rows`."""
        network = next(iter(self.networks.values()))
        columns = header(next(iter(self.runs.values())).kind)
        return (
            *(("device",) if self.has_devices else ()),
            *columns,
            *(() if network.plane is None else ("lat_deg", "lon_deg")),
            *(() if network.start is None else ("time_utc",)),
        )

    def rows(self) -> Iterator[list[str]]:
        """Iterate over the rows of the positions file.

        Yields
        ------
        list of str
            Cells of a source in a step.
        """
        for device, run in self.runs.items():
            start = self.networks[device].start
            for step, time in enumerate(run.time.tolist()):
                for slot, row in enumerate(run.estimate(step).rows()):
                    cells = text((step, time, *row))
                    if self.has_devices:
                        cells = [device, *cells]
                    if "lat" in run.extras:
                        cells += [f"{run.extras[one][step, slot]:.8f}" for one in ("lat", "lon")]
                    if start is not None:
                        cells.append(iso_text(start + time))
                    yield cells

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the positions file; it has its final name only when it is complete.

        Parameters
        ----------
        path : str or path
            Name of the CSV file.
        """
        with atomic_write(path) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.header)
            writer.writerows(self.rows())
