"""Rows of readings in tables, and in the logs of WiGLE and Kismet."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterable
from contextlib import closing
from io import BytesIO
from os import PathLike
from pathlib import Path

from arrivals.files import open_input
from arrivals.recordings.formats.file_contents import MAX_BYTES, check_size
from arrivals.tables import TableLine, TableRow, named_rows

GZIP, ZIP = b"\x1f\x8b", b"PK\3\4"
KISMET_COLUMNS = ("time", "mac", "signal_dbm", "lat", "lon")
KISMET_NETWORKS = "GPSBestLat"  # a column of the table of networks
KISMET_CURE = "pass the .kismet database, the .gpsxml file, or the output of kismetdb_to_wiglecsv"
# packets with a level and a position; the transmitter is known for most of them
KISMET_QUERY = (
    "SELECT ts_sec + ts_usec / 1e6, "
    "CASE WHEN transmac = '00:00:00:00:00:00' THEN sourcemac ELSE transmac END, signal, lat, lon "
    "FROM packets WHERE signal != 0 AND (lat != 0 OR lon != 0)"
)


def rows_of(path: str | PathLike[str]) -> list[TableRow]:
    """Return the rows of a table, or of a log of WiGLE or Kismet.

    Parameters
    ----------
    path : path
        Table with a header; CSV of WiGLE, with its line above the header; either in gzip; database
        of Kismet since 2019 (.kismet), or its points before (.gpsxml).

    Returns
    -------
    list of TableRow
        At least one.

    Raises
    ------
    ValueError
        If the file has no rows, is damaged, or is of Kismet and has no readings.
    """
    with open_input(path) as file:
        data = file.read()
    if data.startswith(GZIP):
        data = _unpacked(data)
    if data.startswith(ZIP):
        raise ValueError("a spreadsheet or another zip file is not a table: save it as CSV")
    if data.startswith(b"SQLite format 3\0"):
        return _kismet_database(path)
    if data.lstrip(b"\xef\xbb\xbf \r\n").startswith(b"<"):
        return _kismet_points(data)
    if data.lstrip(b"\xef\xbb\xbf").startswith(b"WigleWifi"):
        data = b"\n" + data.partition(b"\n")[2]  # line numbers stay
    rows = named_rows(data)
    if KISMET_NETWORKS in rows[0].columns:
        raise ValueError(f"a table of networks of Kismet has no single readings: {KISMET_CURE}")
    if len(rows[0].columns) == 1:
        raise ValueError(
            f"the table has one column, {next(iter(rows[0].columns))!r}: separate cells by commas, "
            "semicolons or tabs"
        )
    return rows


def _unpacked(data: bytes) -> bytes:
    """Return the contents of a gzip file."""
    try:
        with gzip.open(BytesIO(data)) as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise ValueError(f"not a complete gzip file: {error}") from None
    check_size(len(data), MAX_BYTES)
    return data


def _kismet_database(path: str | PathLike[str]) -> list[TableRow]:
    import sqlite3

    try:
        with closing(sqlite3.connect(f"{Path(path).resolve().as_uri()}?mode=ro", uri=True)) as log:
            version = log.execute("SELECT db_version FROM KISMET").fetchone()
            if version is None or version[0] < 5:
                raise ValueError(f"db_version must be at least 5; got {version}: {KISMET_CURE}")
            return _rows(log.execute(KISMET_QUERY))
    except sqlite3.Error as error:
        raise ValueError(f"not a complete log of Kismet: {error}") from None


def _kismet_points(data: bytes) -> list[TableRow]:
    from xml.etree import ElementTree

    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise ValueError(f"not complete XML: {error}") from None
    points = (point.attrib for point in root.iter("gps-point"))
    return _rows(
        (f"{p['time-sec']}.{int(p.get('time-usec', 0)):06d}", p["bssid"], p["signal_dbm"],
         p["lat"], p["lon"])
        for p in points
        if {"time-sec", "bssid", "signal_dbm", "lat", "lon"} <= set(p)
        and p.get("source", p["bssid"]) == p["bssid"]  # sent by the access point itself
    )  # fmt: skip


def _rows(values: Iterable[tuple[object, ...]]) -> list[TableRow]:
    columns = {name: k for k, name in enumerate(KISMET_COLUMNS)}
    rows = [
        TableRow(TableLine(number, [str(value) for value in row], ","), columns)
        for number, row in enumerate(values, start=1)
    ]
    if not rows:
        raise ValueError(f"there are no readings with a level and a position: {KISMET_CURE}")
    return rows
