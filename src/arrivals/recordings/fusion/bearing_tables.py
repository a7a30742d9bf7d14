"""Tables of ready-made bearings: time, station, bearing, standard deviation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike, fspath
from pathlib import Path

import numpy as np

from arrivals.files import open_input
from arrivals.messages import similar
from arrivals.recordings.fusion.station_plan import StationPlan
from arrivals.recordings.networks.cells import Cells, times
from arrivals.recordings.networks.columns import NAMES, Column, aliases_of, roles
from arrivals.recordings.networks.sensor_tables import named
from arrivals.tables import TableRow, named_rows, table_lines
from arrivals.typing import Float, Int

DEFAULT_STD_DEG = 3.0
MAX_STD_DEG = float(np.rad2deg(1.0))  # of a bearing in `Fused`
ANGLES = {"": 1.0, "deg": 1.0, "degrees": 1.0, "rad": 180 / np.pi, "radians": 180 / np.pi}
# names by role, without case, spaces and punctuation; the first one that a table has counts
BEARINGS: dict[str, tuple[str, Mapping[str, float]]] = {
    "time": NAMES["time"],
    "date": NAMES["date"],
    "station": ("station stationid stationname sensor sensorid site node nodeid receiver rx array "
                "name id", {"": 1.0}),
    "bearing": ("bearing azimuth az doa aoa direction angle lob maxdoa maxdoaangle theta", ANGLES),
    "std": ("std sigma stddev standarddeviation uncertainty bearingstd accuracy", ANGLES),
}  # fmt: skip
ALIASES = aliases_of(BEARINGS)
# the log of KrakenSDR's app has no header: ms since 1970, bearing, confidence, level, frequency,
# kind of array, latency, station, ...
KRAKEN = {"time": 0, "bearing": 1, "station": 7}
KRAKEN_COLUMNS, KRAKEN_ARRAYS = 13, ("UCA", "ULA", "CUSTOM")


@dataclass(frozen=True, eq=False)
class BearingTable:
    """Ready-made bearings, one an entry; arrays (n_bearings,).

    Parameters
    ----------
    time : ndarray
        Times, s.
    station : ndarray of int
        Indices of the stations.
    azimuth : ndarray
        Azimuths on the map, rad; NaN where a station took part and received nothing.
    variance : ndarray
        Variances, rad².
    start : float, optional
        Time 0 in seconds since 1970-01-01 UTC, where times have dates.
    understood : tuple of str
        How the table was understood, in phrases.
    """

    time: Float
    station: Int
    azimuth: Float
    variance: Float
    start: float | None = None
    understood: tuple[str, ...] = ()


def read_bearings(
    paths: str | PathLike[str] | Sequence[str | PathLike[str]], plans: Sequence[StationPlan]
) -> BearingTable:
    """Read tables of ready-made bearings.

    Parameters
    ----------
    paths : path, or sequence of paths
        Tables with the columns ``time_s, station, bearing_deg, std_deg`` (or others by which they
        are known), or logs of KrakenSDR's app, which have no header. A table without stations has
        those of the station by whose name the file is called, or of the only one. Without a
        deviation it is 3 degrees.
    plans : sequence of StationPlan
        Stations, whose headings turn bearings that are anticlockwise from the array's x axis.

    Returns
    -------
    BearingTable

    Raises
    ------
    ValueError
        If a column, a time or a station is not understood; the message begins with the file.
    """
    several = [paths] if isinstance(paths, str | PathLike) else list(paths)
    tables = []
    for path in several:
        with named(path):
            tables.append(_read(path, plans))
    dated = [table.start for table in tables if table.start is not None]
    if dated and len(dated) < len(tables):
        raise ValueError("times of bearings must be dates in all tables, or in none")
    start = min(dated, default=None)
    if start is not None:
        tables = [replace(one, time=one.time + ((one.start or start) - start)) for one in tables]
    parts = ("time", "station", "azimuth", "variance")
    joined = {name: np.concatenate([getattr(one, name) for one in tables]) for name in parts}
    order = np.lexsort((joined["station"], joined["time"]))
    joined = {name: values[order] for name, values in joined.items()}
    phrases = dict.fromkeys(phrase for table in tables for phrase in table.understood)
    return BearingTable(start=start, understood=tuple(phrases), **joined)


def _read(path: str | PathLike[str], plans: Sequence[StationPlan]) -> BearingTable:
    rows, found = _rows(path)
    if "bearing" not in found:
        names = " ".join(BEARINGS["bearing"][0].split()[:6])
        raise ValueError(
            f"the column 'bearing_deg' is missing: found {', '.join(rows[0].columns)}; understood "
            f"are {names} ..."
        )
    time, start, phrase = times(Cells(rows, found, None))
    station = _stations(path, rows, found.get("station"), plans)
    bearing, std = found["bearing"], found.get("std")
    degrees = np.array([row.real(bearing.name) for row in rows]) * bearing.scale
    std_deg = np.full(len(rows), np.nan)
    if std is not None:
        std_deg = np.array([row.real(std.name) for row in rows]) * std.scale
        bad = np.flatnonzero((std_deg <= 0) | (std_deg > MAX_STD_DEG))
        if bad.size:
            line, value = rows[int(bad[0])].number, std_deg[bad[0]]
            raise ValueError(
                f"line {line}: a deviation must be positive and at most {MAX_STD_DEG:.3g} degrees; "
                f"got {value:g}"
            )
    phrases = [phrase, f"bearing {bearing.name!r}"]
    unknown = np.isnan(std_deg) & ~np.isnan(degrees)
    if unknown.any():
        phrases.append(
            f"no deviations: {DEFAULT_STD_DEG:g} degrees assumed"
            if unknown.all()
            else f"{np.count_nonzero(unknown)} without a deviation: {DEFAULT_STD_DEG:g} degrees"
        )
    std_deg = np.where(np.isnan(std_deg), DEFAULT_STD_DEG, std_deg)
    azimuth = np.full(len(rows), np.nan)
    for k in np.unique(station).tolist():
        plans[k].station()  # refuses a missing heading
        azimuth[station == k] = plans[k].azimuth(np.deg2rad(degrees[station == k]))
    return BearingTable(time, station, azimuth, np.deg2rad(std_deg) ** 2, start, tuple(phrases))


def _rows(path: str | PathLike[str]) -> tuple[list[TableRow], dict[str, Column]]:
    """Return the rows of a table, and its columns by role."""
    with open_input(path) as file:
        data = file.read()
    lines = list(table_lines(data))
    if lines and _is_kraken(lines[0].cells):
        rows = [TableRow(line, KRAKEN) for line in lines]
        short = next((line for line in lines if len(line.cells) < KRAKEN_COLUMNS), None)
        if short is not None:
            raise ValueError(f"line {short.number} must have {KRAKEN_COLUMNS} cells or more")
        return rows, {role: Column(role) for role in KRAKEN}
    rows = named_rows(data)
    return rows, roles(rows[0].columns, tuple(BEARINGS), ALIASES)


def _is_kraken(cells: Sequence[str]) -> bool:
    return (
        len(cells) >= KRAKEN_COLUMNS
        and cells[0].strip().isdigit()
        and cells[5].strip().upper() in KRAKEN_ARRAYS
    )


def _stations(
    path: str | PathLike[str],
    rows: Sequence[TableRow],
    column: Column | None,
    plans: Sequence[StationPlan],
) -> Int:
    """Return the index of the station of each row."""
    index = {plan.name.casefold(): k for k, plan in enumerate(plans)}
    index |= {plan.name: k for k, plan in enumerate(plans)}
    names = [plan.name for plan in plans]
    if column is None:
        stem = Path(fspath(path)).stem
        known = index.get(stem, index.get(stem.casefold(), 0 if len(plans) == 1 else None))
        if known is None:
            raise ValueError(
                "the column 'station' is missing, and the file has the name of none of the "
                f"stations {', '.join(names)}: found {', '.join(rows[0].columns)}"
            )
        return np.full(len(rows), known, dtype=np.int64)
    station = []
    for row in rows:
        name = row[column.name].strip()
        known = index.get(name, index.get(name.casefold()))
        if known is None:
            hint = similar(name, names) or f": the stations are {', '.join(names)}"
            raise ValueError(f"line {row.number}: no station has the name {name!r}{hint}")
        station.append(known)
    return np.array(station, dtype=np.int64)
