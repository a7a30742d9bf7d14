"""Cells of a table of readings: texts, times and levels."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from arrivals.measurement_models.signal_strength.fill_values import without
from arrivals.recordings.networks.columns import Column, understood_names
from arrivals.recordings.networks.times import iso_text, parsed
from arrivals.tables import TableRow
from arrivals.typing import Float

MAX_LEVEL_DB = 340.0  # 39 Np: levels beyond are no measurements
LEAST_UNSIGNED_DB = 20.0  # dBm without their sign are above
SHOWN = 3  # names in a message


@dataclass(frozen=True, eq=False)
class Cells:
    """Rows of a table with the columns that are understood."""

    rows: Sequence[TableRow]
    found: Mapping[str, Column]
    group: str | None

    @property
    def columns(self) -> list[str]:
        """Names of all columns."""
        return list(self.rows[0].columns)

    def texts(self, column: str) -> list[str]:
        """Return the cells of a column without spaces around them."""
        return [row[column].strip() for row in self.rows]

    def device_column(self, sensor: str | None) -> str | None:
        """Return the column of the sources, which is not that of the sensors."""
        if self.group is not None:
            return self.group
        devices = (self.found.get(role) for role in ("device", "access point"))
        return next((each.name for each in devices if each and each.name != sensor), None)


def times(cells: Cells) -> tuple[Float, float | None, str]:
    """Return times, their origin, and a phrase about them; the origin is None without dates."""
    found = cells.found
    column = found.get("time") or found.get("date")
    if column is None:
        raise ValueError(
            f"the column 'time_s' is missing: found {', '.join(cells.columns)}; understood are "
            f"{understood_names('time')}"
        )
    texts = cells.texts(column.name)
    if "time" in found and "date" in found:
        texts = [f"{date} {one}" for date, one in zip(cells.texts(found["date"].name), texts,
                                                      strict=True)]  # fmt: skip
    numbers = [one.replace(",", ".") if one.count(",") == 1 else one for one in texts]
    time, start = parsed(numbers, [row.number for row in cells.rows], column.scale)
    since = "" if start is None else f" (from {iso_text(start)[:-5]}Z)"
    return time, start, f"time {column.name!r}{since}"


def some(names: Sequence[str]) -> str:
    """Return a few of the names for a message."""
    distinct = list(dict.fromkeys(names))
    text = ", ".join(repr(one) for one in distinct[:SHOWN])
    return text + (" ..." if len(distinct) > SHOWN else "")


def checked(level: Float, missing: Sequence[float]) -> Float:
    """Return levels of a receiver, dB, NaN where they are missing."""
    rss_db = without(level, missing)
    valid = rss_db[np.isfinite(rss_db)]
    worst = valid[np.abs(valid).argmax()] if valid.size else 0.0
    if abs(worst) > MAX_LEVEL_DB:
        cure = f"pass missing=[{worst:g}] (--missing {worst:g}) if it stands for a missing reading"
        raise ValueError(f"rss_db must lie within ±{MAX_LEVEL_DB:g} dB; got {worst:g}: {cure}")
    if valid.size and valid.min() > LEAST_UNSIGNED_DB:
        warnings.warn(
            f"all levels are above {LEAST_UNSIGNED_DB:g} dB: if they are dBm without their sign, "
            "strong readings count as weak; write the sign", stacklevel=2
        )  # fmt: skip
    return rss_db
