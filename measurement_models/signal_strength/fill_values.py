"""Constants that stand for missing readings, such as 0, 100 or -200 dB."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike

from arrivals.typing import Bool, Float
from arrivals.validation import real

MIN_GAP_DB = 20.0  # from a constant to all other readings
MIN_GAP_OF_MANY_DB = 10.0  # the same if it occurs often and at several sensors
MANY = 5


def fill_values(rss_db: Float) -> list[float]:
    """Return constants that repeat at the end of the range, far from all other readings.

    Parameters
    ----------
    rss_db : ndarray, shape (n_steps, n_sensors)
        Levels, dB; NaN where missing.

    Returns
    -------
    list of float

    Examples
    --------
    >>> fill_values(np.array([[-60.0, 100.0, -71.0], [-61.0, 100.0, -72.0]]))
    [100.0]
    >>> fill_values(np.array([[-60.0, -79.0, -71.0], [-61.0, -79.0, -72.0]]))
    []
    """
    values, counts = np.unique(rss_db[np.isfinite(rss_db)], return_counts=True)
    found: list[float] = []
    while len(values) > 1:
        low, high = values[1] - values[0], values[-1] - values[-2]
        ends = [(0, low, values[-1] - values[1])]
        if values[-1] >= 0:  # a level below 0 dB at the upper end is that of a near source
            ends.append((-1, high, values[-2] - values[0]))
        fills = [
            end
            for end, gap, spread in ends
            if counts[end] > 1
            and gap >= max(min_gap(rss_db == values[end]), 0.25 * spread)
        ]  # fmt: skip
        if not fills:
            break
        found.append(float(values[fills[0]]))
        values, counts = np.delete(values, fills[0]), np.delete(counts, fills[0])
    return found


def without(rss_db: ArrayLike, missing: ArrayLike) -> Float:
    """Return levels, dB, NaN where they equal a value of `missing`.

    Examples
    --------
    >>> without([[-60.0, 100.0]], [100.0, -200.0])
    array([[-60.,  nan]])
    """
    levels = real("rss_db", rss_db)
    return np.where(np.isin(levels, real("missing", missing)), np.nan, levels)


def min_gap(is_constant: Bool) -> float:
    """Return the gap, dB, at which a constant counts as a fill value."""
    many = is_constant.sum() >= MANY and is_constant.any(axis=0).sum() > 1
    return MIN_GAP_OF_MANY_DB if many else MIN_GAP_DB


def warn_fill_values(rss_db: Float) -> None:
    """Warn of constants that may stand for missing readings."""
    found = fill_values(rss_db)
    if found:
        values = ", ".join(f"{value:g}" for value in found)
        warnings.warn(
            f"{values} dB repeats far from all other readings: if it stands for a missing one, "
            f"read the network with missing=[{values}] (--missing {found[0]:g})",
            stacklevel=3,
        )
