"""Positions of sensors: units, turns, compass coordinates, checks."""

from typing import Any

import numpy as np

from arrivals.measurements import real_numbers
from arrivals.typing import Float
from arrivals.validation import number, one_of

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048}  # m


def in_metres(name: str, value: Any, unit: str) -> Any:
    """Return a length, or lengths, in metres.

    Parameters
    ----------
    name : str
        Name of the value in messages.
    value : object
        Number or nested numbers; unchanged if `unit` is "m".
    unit : str
        Name in `UNITS`.

    Returns
    -------
    object
        float for a number, ndarray for several.

    Raises
    ------
    ValueError, TypeError
        If the unit is unknown, or values are not numbers.

    Examples
    --------
    >>> in_metres("radius", 4.6, "cm"), in_metres("distances", [1, 2], "km")
    (0.046, array([1000., 2000.]))
    """
    scale = UNITS[one_of("unit", unit, tuple(UNITS))]
    if scale == 1.0:
        return value
    lengths = scale * real_numbers(name, value)
    return lengths if lengths.ndim else float(lengths)


def turned(positions: Float, rotation: Any) -> Float:
    """Return positions turned about the origin, from the first axis to the second.

    Directions grow by the same angle.

    Parameters
    ----------
    positions : ndarray, shape (n_sensors, 2) or (n_sensors, 3)
        Metres; the third coordinate is unchanged.
    rotation : float
        Angle, degrees.

    Returns
    -------
    ndarray
        Same shape.

    Examples
    --------
    >>> turned(np.array([[1.0, 0.0]]), 90).round(6)
    array([[0., 1.]])
    """
    angle = np.deg2rad(number("rotation", rotation))
    c, s = np.cos(angle), np.sin(angle)
    x, y = positions[:, 0], positions[:, 1]
    return np.column_stack([c * x - s * y, s * x + c * y, positions[:, 2:]])


def compass(positions: Float) -> Float:
    """Return east and north coordinates in the order north, east.

    Directions, which are counted from the first axis to the second, are compass bearings then:
    from north, clockwise. Applied twice, nothing changes.

    Parameters
    ----------
    positions : ndarray, shape (n_sensors, 2) or (n_sensors, 3)
        Metres.

    Returns
    -------
    ndarray
        Same shape.

    Examples
    --------
    >>> compass(np.array([[1.0, 2.0, 3.0]]))
    array([[2., 1., 3.]])
    """
    return np.column_stack([positions[:, 1], positions[:, 0], positions[:, 2:]])


def check_distinct(positions: Float) -> None:
    """Raise a ValueError if two sensors share a position.

    Examples
    --------
    >>> check_distinct(np.array([[0.0], [1.0], [0.0]]))
    Traceback (most recent call last):
    ValueError: two sensors share the position (0) m: numbers 1 and 3 of 3
    """
    order = np.lexsort(positions.T)
    same = (np.diff(positions[order], axis=0) == 0).all(axis=1)
    if same.any():
        first = int(np.argmax(same))
        one, other = sorted(order[first : first + 2].tolist())
        place = ", ".join(f"{x:g}" for x in positions[one])
        which = f"numbers {one + 1} and {other + 1} of {len(positions)}"
        raise ValueError(f"two sensors share the position ({place}) m: {which}")
