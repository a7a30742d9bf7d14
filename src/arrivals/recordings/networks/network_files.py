"""Files of one network: npz, and tables of readings."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from arrivals.files import open_input
from arrivals.measurements import real_numbers
from arrivals.recordings.formats.file_contents import MAX_BYTES, check_size
from arrivals.recordings.formats.numpy_files import numpy_arrays
from arrivals.recordings.networks.cells import checked
from arrivals.recordings.networks.network import Network
from arrivals.recordings.networks.sensor_tables import named
from arrivals.recordings.networks.steps import as_network
from arrivals.recordings.networks.tables import read_table

ARRAYS = ("rss_db", "sensor_xy", "sensor_name", "time", "tx_xy")  # of an npz file


def read_network(
    readings: str | PathLike[str],
    sensors: str | PathLike[str] | None = None,
    missing: Sequence[float] = (),
) -> Network:
    """Read a measured network from files.

    Parameters
    ----------
    readings : path
        ``.npz``: arrays ``rss_db`` (n_steps, n_sensors), ``sensor_xy`` (n_steps, n_sensors, 2) or
        (n_sensors, 2), and optionally ``sensor_name``, ``time``, ``tx_xy``. ``.csv``: a heading
        and one row a step, ``time_s`` and a column for each sensor; or one row a reading,
        ``time_s, sensor, rss_db``, or other names by which they are known. Levels in dB or dBm;
        empty where missing.
    sensors : path, optional
        Table of the sensors for a CSV file, with the columns ``name, x_m, y_m``.
    missing : sequence of float
        Levels, dB, that stand for a missing reading, such as 100 or -200.

    Returns
    -------
    Network

    Raises
    ------
    ValueError
        If a sensor is listed twice or unknown, all readings are missing, or a cell is not a number.

    Examples
    --------
    >>> read_network("readings.csv")
    Traceback (most recent call last):
    FileNotFoundError: [Errno 2] No such file or directory: 'readings.csv'
    """
    if Path(readings).suffix.lower() == ".npz":
        return read_npz(readings, missing)
    table = read_table(readings, sensors, missing)
    with named(readings):
        if len(table.readings) != 1:
            raise ValueError(
                f"the table has {len(table.readings)} devices: locate each by itself, as "
                "arrivals.locate does"
            )
        return as_network(next(iter(table.readings.values())))


def read_npz(path: str | PathLike[str], missing: Sequence[float] = ()) -> Network:
    """Read a network from the arrays of an npz file, as in `read_network`."""
    with open_input(path) as file, named(path):
        stored = numpy_arrays(file)
        for key in ("rss_db", "sensor_xy"):
            if key not in stored:
                raise ValueError(f"the array {key!r} is missing")
        check_size(sum(each.n_bytes for each in stored.values()), MAX_BYTES)
        held = {key: each.load() for key, each in stored.items() if key in ARRAYS}
        rss_db = real_numbers("rss_db", held["rss_db"])
        sensors = real_numbers("sensor_xy", held["sensor_xy"])
        if rss_db.ndim != 2:
            raise ValueError(f"rss_db must have shape (n_steps, n_sensors); got {rss_db.shape}")
        if sensors.shape not in ((*rss_db.shape, 2), (rss_db.shape[1], 2)):
            either = f"{(*rss_db.shape, 2)} or {(rss_db.shape[1], 2)}"
            raise ValueError(f"sensor_xy must have shape {either}; got {sensors.shape}")
        sensors = np.broadcast_to(sensors, (*rss_db.shape, 2))
        name = held.get("sensor_name", np.arange(rss_db.shape[1])).astype(str).ravel().tolist()
        time = held.get("time", np.arange(float(len(rss_db))))
        rss_db = checked(rss_db, missing)
        return Network(tuple(name), time, rss_db, sensors, held.get("tx_xy"))
