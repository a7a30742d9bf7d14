"""Places of an array and of standing or moving talkers in a room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.typing import Float

SIZE = (6.0, 5.0, 2.8)  # m
PLACES = 25  # of a moving talker
SWEEP = 60.0  # degrees, of a moving talker


@dataclass(frozen=True, eq=False)
class RoomLayout:
    """Places of the sensors and of the talkers over time.

    Parameters
    ----------
    sensors : ndarray, shape (n_sensors, 3)
        Positions in the room, m.
    places : list of ndarray, each of shape (n_places, 3)
        Positions of each talker at equal intervals, m; one alone if the talker is static.
    doa : list of ndarray, each of shape (n_places,)
        Directions of the places in the array's frame, rad, unwrapped.
    """

    sensors: Float
    places: list[Float]
    doa: list[Float]


def draw_azimuths(
    n_talkers: int, n_moving: int, rng: np.random.Generator, *, line: bool = False
) -> list[Float]:
    """Draw azimuths of talkers at least 30° apart, or 20° where one moves, rad.

    Parameters
    ----------
    n_talkers, n_moving : int
        Number of talkers, and how many of them, the first ones, move by 60°.
    rng : numpy.random.Generator
        Source of random numbers.
    line : bool
        Whether all are in front of a line, 25 to 155° from its end.

    Returns
    -------
    list of ndarray, each of shape (n_places,)
        Azimuths at equal intervals of time; one alone for a static talker.

    Examples
    --------
    >>> moving, static = draw_azimuths(2, 1, np.random.default_rng(0))
    >>> len(moving), len(static), np.rad2deg(moving[[0, -1]]).round()
    (25, 1, array([ 49., -11.]))
    """
    low, high = (25.0, 155.0) if line else (-180.0, 180.0)
    moves = np.arange(n_talkers) < n_moving
    least = np.where(moves[:, None] | moves, 20.0, 30.0)
    while True:
        start = rng.uniform(low, high, n_talkers)
        end = start + moves * rng.choice([-SWEEP, SWEEP], n_talkers)
        path = np.linspace(start, end, PLACES, axis=1)
        gap = np.abs((path[:, None] - path + 180) % 360 - 180).min(axis=2)
        in_front = not line or bool(((end >= low) & (end <= high)).all())
        if in_front and (gap + 360 * np.eye(n_talkers) >= least).all():
            return [np.deg2rad(p if m else p[:1]) for p, m in zip(path, moves, strict=True)]


def draw_layout(positions: Float, azimuths: list[Float], rng: np.random.Generator) -> RoomLayout:
    """Draw a place and an orientation of an array, with talkers around it.

    The array is within 0.5 m of the room's middle, 1.2 m high; talkers have a horizontal distance
    of 1 to 1.8 m and a height of 1.35 to 1.6 m.

    Parameters
    ----------
    positions : ndarray, shape (n_sensors, dim)
        Sensors in the array's frame, m; a line's have its x axis.
    azimuths : list of ndarray, each of shape (n_places,)
        Azimuths of the talkers in the array's frame, rad.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    RoomLayout
        Places in the room, and directions: of a line, the angle from broadside of the cone on
        which the talker is.

    Examples
    --------
    >>> layout = draw_layout(np.array([[-0.1], [0.1]]), [np.zeros(1)], np.random.default_rng(0))
    >>> layout.sensors.shape, layout.places[0].shape, np.rad2deg(layout.doa[0]).round(1)
    ((2, 3), (1, 3), array([70.8]))
    """
    centre = np.array([rng.uniform(2.5, 3.5), rng.uniform(2.0, 3.0), 1.2])
    turn = rng.uniform(-np.pi, np.pi)
    axes = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    dim = positions.shape[1]
    places, doa = [], []
    for azimuth in azimuths:
        distance, height = rng.uniform(1.0, 1.8), rng.uniform(0.15, 0.4)
        local = np.stack(
            [distance * np.cos(azimuth), distance * np.sin(azimuth), np.full(len(azimuth), height)],
            axis=1,
        )
        places.append(centre + local @ axes)
        cone = np.arcsin(local[:, 0] / np.hypot(distance, height))
        doa.append(cone if dim == 1 else azimuth)
    return RoomLayout(centre + positions @ axes[:dim], places, doa)
