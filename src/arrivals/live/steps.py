"""Steps of a run as a live view shows them, and a ring of the latest."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from arrivals.trackers.estimates import Estimate
from arrivals.typing import Float
from arrivals.validation import count

Rays: TypeAlias = tuple[tuple[float, float, float], ...]
N_STEPS = 1200  # in the ring: 77 s of steps of 64 ms


@dataclass(frozen=True, eq=False)
class LiveStep:
    """One step of a run.

    Parameters
    ----------
    number : int
        Number of the step in the tracks file, from 0.
    time : float
        Middle of the step, s.
    estimate : Estimate
        Estimate after the step.
    lag : float
        Time from the receipt of the step's last sample to the estimate, s; NaN if the input is
        not live.
    elapsed : float
        Wall-clock time since the former step, s; NaN of the first.
    beam_db : ndarray, shape (n_directions,), optional
        Beam power, dB re its maximum in the step.
    channel_db : ndarray, shape (n_channels,), optional
        Level of each channel, dB; minus infinity where it has no power.
    rays : tuple of (float, float, float)
        Bearings of a fused run: x and y of the station, m, and the azimuth, rad.
    """

    number: int
    time: float
    estimate: Estimate
    lag: float = np.nan
    elapsed: float = np.nan
    beam_db: Float | None = None
    channel_db: Float | None = None
    rays: Rays = ()

    def sources(self) -> list[dict[str, Any]]:
        """Return the sources by the names of the columns of the tracks file.

        Examples
        --------
        >>> from arrivals.trackers import DirectionEstimate
        >>> one = np.ones(1)
        >>> estimate = DirectionEstimate(0 * one, 0.01 * one, one, one + 0j, np.array([7]))
        >>> LiveStep(0, 0.5, estimate).sources()[0]["label"]
        7
        """
        columns = self.estimate.columns
        return [
            {name: plain(cell) for name, cell in zip(columns, row, strict=True)}
            for row in self.estimate.rows()
        ]


def plain(cell: Any) -> Any:
    """Return a number of numpy as one of Python.

    Examples
    --------
    >>> plain(np.int64(3)), plain("text")
    (3, 'text')
    """
    return cell.item() if isinstance(cell, np.generic) else cell


@dataclass(frozen=True)
class LiveScene:
    """What a live view knows of a run before its first step.

    Parameters
    ----------
    title : str
        Recording and tracker, in a line.
    kind : str
        "polar" for directions, "sky" for azimuth and elevation, "map" for positions.
    line : bool
        True if directions are counted from broadside, -90 to 90 degrees.
    directions_deg : tuple of float
        Directions of the beam power, degrees; empty without it.
    stations : tuple of (str, float, float)
        Name, x and y of stations on a map, m.
    sensors : tuple of (float, float)
        Sensors of signal strength on a map, m.
    """

    title: str
    kind: str = "polar"
    line: bool = False
    directions_deg: tuple[float, ...] = ()
    stations: tuple[tuple[str, float, float], ...] = ()
    sensors: tuple[tuple[float, float], ...] = ()


@dataclass
class StepHistory:
    """Ring of the latest steps, written by the run and read by pages of other threads.

    Parameters
    ----------
    n_steps : int
        Number of steps that are kept.

    Examples
    --------
    >>> from arrivals.trackers import DirectionEstimate
    >>> history = StepHistory(2)
    >>> for number in range(3):
    ...     history.append(LiveStep(number, 0.1 * number, DirectionEstimate.empty()))
    >>> [step.number for step in history.steps()], history.n_seen
    ([1, 2], 3)
    """

    n_steps: int = N_STEPS
    n_seen: int = 0
    ended: bool = False
    _ring: deque[LiveStep] = field(init=False, repr=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def __post_init__(self) -> None:
        self._ring = deque(maxlen=count("n_steps", self.n_steps))

    def append(self, step: LiveStep) -> None:
        """Add a step; the oldest one leaves a full ring."""
        with self._lock:
            self._ring.append(step)
            self.n_seen += 1

    def steps(self) -> Sequence[LiveStep]:
        """Return the steps that are kept, oldest first."""
        with self._lock:
            return list(self._ring)
