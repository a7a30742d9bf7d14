"""Times of readings: seconds, times since 1970, and dates."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from arrivals.tables import MISSING
from arrivals.typing import Float

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
FIRST_DATE, LAST_DATE = 6e8, 2.5e11  # s since 1970: numbers between are dates of 1989 to 9892
# ms, µs and ns since 1970 are larger than any date in the unit before
SMALLER_UNITS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))


def parsed(cells: Sequence[str], lines: Sequence[int], scale: float) -> tuple[Float, float | None]:
    """Return times, s, and their origin if they have dates.

    Parameters
    ----------
    cells : sequence of str
        Numbers, or dates by ISO 8601; those without a zone are UTC.
    lines : sequence of int
        Their lines in the file.
    scale : float
        Unit of numbers, s. Where it is 1, the unit of times since 1970 follows from their size.

    Returns
    -------
    time : ndarray, shape (n,)
    start : float or None
        The whole second, since 1970 UTC, that times with a date count from.

    Raises
    ------
    ValueError
        If a time is missing or not understood.

    Examples
    --------
    >>> parsed(["2026-05-01 12:00:00.5", "2026-05-01T14:00:02+02:00"], [2, 3], 1.0)
    (array([0.5, 2. ]), 1777636800.0)
    >>> parsed(["1777636800250"], [2], 1.0)
    (array([0.25]), 1777636800.0)
    """
    if not _is_number(cells[0]):
        microseconds = np.array(
            [_microseconds(cell, line) for cell, line in zip(cells, lines, strict=True)]
        )
        start = int(microseconds.min()) // 10**6
        return (microseconds - start * 10**6) / 1e6, float(start)
    time = np.array([_number(cell, line) for cell, line in zip(cells, lines, strict=True)])
    if scale == 1.0:
        largest = np.abs(time).max()
        scale = next((unit for size, unit in SMALLER_UNITS if largest > size), 1.0)
    worst = int(np.abs(time).argmax())
    if np.abs(time[worst]) * scale > LAST_DATE:
        raise _not_understood(cells[worst], lines[worst])
    if time.min() * scale < FIRST_DATE:
        return time * scale, None
    start = int(np.floor(time.min() * scale))
    return (time - start / scale) * scale, float(start)


def iso_text(time: float) -> str:
    """Return a time since 1970 as a date, UTC, to 1 ms.

    Examples
    --------
    >>> iso_text(1777636800.25)
    '2026-05-01T12:00:00.250Z'
    """
    date = (EPOCH + timedelta(seconds=round(time, 3))).replace(tzinfo=None)
    return f"{date.isoformat(timespec='milliseconds')}Z"


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _number(cell: str, line: int) -> float:
    try:
        number = float("" if "_" in cell else cell)
    except ValueError:
        raise _not_understood(cell, line) from None
    if not np.isfinite(number):
        raise _not_understood(cell, line)
    return number


def _microseconds(cell: str, line: int) -> int:
    try:
        date = datetime.fromisoformat(cell.strip().replace("/", "-"))
    except ValueError:
        raise _not_understood(cell, line) from None
    date = date.replace(tzinfo=UTC) if date.tzinfo is None else date
    return (date - EPOCH) // timedelta(microseconds=1)


def _not_understood(cell: str, line: int) -> ValueError:
    if cell.strip().lower() in MISSING:
        return ValueError(f"line {line}: the time is missing")
    return ValueError(
        f"line {line}: the time {cell.strip()!r} is not understood: write seconds, or "
        "2026-05-01T12:00:00.25Z"
    )
