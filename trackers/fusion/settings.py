"""Settings of the fusion of bearings: detection of tracks by stations, and hypotheses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arrivals.parameters import FrozenModel
from arrivals.validation import count, not_negative, positive, probability


@dataclass(frozen=True)
class BearingDetection(FrozenModel):
    """Detection of tracks by the stations, births and false bearings.

    Parameters
    ----------
    p_survive : float
        Probability that a source survives a unit of time.
    p_detect : float
        Probability that a station that has data in a step has a bearing of a source.
    births, clutter : float
        Expected numbers of new sources in a step, and of false bearings of a station in a step.
    inflation : float
        Factor of the standard deviations of bearings from snapshots.
    resolution : float
        Angle within which a station may detect two tracks as one, rad.
    attraction : float
        Standard deviation of the pull of such a neighbour on a bearing, over the angle to it.

    Raises
    ------
    TypeError, ValueError
        If a number is out of range.

    Examples
    --------
    >>> BearingDetection(clutter=0.5).p_detect
    0.9
    """

    p_survive: float = 0.99
    p_detect: float = 0.9
    births: float = 0.1
    clutter: float = 0.2
    inflation: float = 1.3
    resolution: float = float(np.deg2rad(12.0))
    attraction: float = 0.35

    def __post_init__(self) -> None:
        probability("p_survive", self.p_survive)
        if not 0 < probability("p_detect", self.p_detect) < 1:
            raise ValueError(f"p_detect must lie in (0, 1); got {self.p_detect}")
        for name in ("births", "clutter", "inflation"):
            positive(name, getattr(self, name))
        for name in ("resolution", "attraction"):
            not_negative(name, getattr(self, name))


@dataclass(frozen=True)
class GlobalHypotheses(FrozenModel):
    """Rival sets of tracks, and the challenger that starts anew.

    Parameters
    ----------
    rivals : float
        Log odds, nats, below the best set of births within which another becomes a hypothesis of
        its own; 0 for one hypothesis.
    max_hypotheses : int
        Largest number of hypotheses.
    max_tracks : int
        Largest number of tracks in one hypothesis.
    challenge : int
        Steps for which a set of hypotheses that starts from nothing runs beside the present one;
        0 for no challenger.
    margin : float
        Log odds, nats, by which the challenger must be better to take over.

    Raises
    ------
    TypeError, ValueError
        If a number is out of range.

    Examples
    --------
    >>> GlobalHypotheses(challenge=0).rivals
    6.0
    """

    rivals: float = 6.0
    max_hypotheses: int = 6
    max_tracks: int = 30
    challenge: int = 10
    margin: float = 3.0

    def __post_init__(self) -> None:
        not_negative("rivals", self.rivals)
        not_negative("margin", self.margin)
        count("max_hypotheses", self.max_hypotheses, maximum=100)
        count("max_tracks", self.max_tracks, maximum=1000)
        count("challenge", self.challenge, minimum=0)
