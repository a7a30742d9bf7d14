"""Settings of the mixture over time-frequency bins."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from arrivals.messages import shown
from arrivals.parameters import FrozenModel
from arrivals.validation import count, not_negative, number, one_of, positive, probability

COUNTS = {"iterations": 100, "max_sources": 100, "max_births": 100}
PROBABILITIES = ("background", "birth_share", "min_share", "birth_existence", "min_existence",
                 "unsupported_existence")  # fmt: skip
MAY_BE_ZERO = ("relocation", "model_deviation", "merge", "birth_evidence", "max_loss",
               "min_rate", "floor_db", "floor_rise", "decay")  # fmt: skip
MAX_ONSET_DB = 1000


@dataclass(frozen=True)
class MixtureSettings(FrozenModel):
    """Settings of `WidebandMixture`; times in seconds, so that they hold for any step length.

    Parameters
    ----------
    grid_step : float
        Distance of the scan directions of one angle, rad.
    sphere_step : float
        Mean distance of the scan directions on the sphere, rad. At 4 degrees they are 2578, on the
        half of an array in a plane 1289, and a step takes 8 and 4 times as long as one of azimuth.
    diffuse : bool
        True to replace white noise of the measurement model by diffuse noise; other noise of the
        model is kept.
    source_ratio : float
        Power ξ of a source in its bins over that of the diffuse sound.
    tempering : float
        Number T of bins that count as one independent bin.
    deviation_tempering : float
        The same for the stated standard deviation; calibrated on simulated rooms.
    model_deviation : float
        Part of the stated standard deviation that more bins do not reduce, rad: rounding to the
        grid, noise that is not diffuse, echoes within a window.
    peak_half_width : float
        Part of a density about its peak whose mean and deviation are stated, rad.
    iterations : int
        Variational iterations of a fit.
    background, birth_share, min_share : float
        Shares of the bins: of diffuse sound at the start of a fit, of a new source when its
        direction is searched, and the least that a source has.
    birth_evidence : float
        Log evidence of a new source over ln G, G the number of scan directions.
    birth_existence : float
        Existence of a new source before its first bins are counted.
    max_births, max_sources : int
        New sources in one step, and reported sources.
    merge : float
        Least distance of two sources, rad.
    min_existence : float
        Existence from which a source is active and reported.
    pause, unsupported : float
        Time constants of the existence while no bin counts, and of a source of less than
        `min_share` while others do, s.
    unsupported_existence : float
        Existence to which the latter decays.
    max_loss, max_gain : float
        Most that the log odds of existence lose, 1/s, and gain in a step.
    relocation : float
        Rate at which the density of an inactive source becomes uniform, 1/s: above 0, the label of
        a source that pauses may pass to a new one elsewhere.
    memory, confirm : float
        Time for which an inactive source keeps its label, and for which one that never had a
        label is kept, s.
    min_rate : float
        Counted bins per second below which a step is a pause, 1/s.
    floor_db, floor_rise : float
        Level over its noise floor from which a bin counts, dB; rise of the floor, dB/s.
    onset_db, decay : float
        A bin counts if its level exceeds the highest before, which falls by `decay`, dB/s, by
        `onset_db`, dB, which may be negative: echoes follow later and weaker.

    Raises
    ------
    ValueError, TypeError
        If a number is out of its range.

    Examples
    --------
    >>> MixtureSettings(memory=5.0).replace(max_sources=2).max_sources
    2
    """

    grid_step: float = float(np.deg2rad(3.0))
    sphere_step: float = float(np.deg2rad(4.0))
    diffuse: bool = True
    source_ratio: float = 3.0
    tempering: float = 25.0
    deviation_tempering: float = 5.0
    model_deviation: float = float(np.deg2rad(0.5))
    peak_half_width: float = float(np.deg2rad(18.0))
    iterations: int = 3
    background: float = 0.3
    birth_share: float = 0.15
    min_share: float = 0.05
    birth_evidence: float = 0.5
    birth_existence: float = 0.05
    max_births: int = 2
    max_sources: int = 4
    merge: float = float(np.deg2rad(12.0))
    min_existence: float = 0.5
    pause: float = 0.25
    unsupported: float = 0.106
    unsupported_existence: float = 0.3
    max_loss: float = 23.0
    max_gain: float = 30.0
    relocation: float = 0.0
    memory: float = 2.0
    confirm: float = 0.26
    min_rate: float = 31.0
    floor_db: float = 8.0
    floor_rise: float = 0.67
    onset_db: float = 1.0
    decay: float = 45.0

    def __post_init__(self) -> None:
        one_of("diffuse", self.diffuse, (False, True))
        for name in (field.name for field in fields(self) if field.name != "diffuse"):
            object.__setattr__(self, name, self._checked(name, getattr(self, name)))

    @staticmethod
    def _checked(name: str, value: Any) -> float:
        if name in COUNTS:
            return count(name, value, maximum=COUNTS[name])
        if name in PROBABILITIES:
            return probability(name, value)
        if name == "onset_db":
            if not abs(number(name, value)) <= MAX_ONSET_DB:
                raise ValueError(
                    f"{name} must lie in [-{MAX_ONSET_DB}, {MAX_ONSET_DB}]; got {shown(value)}"
                )
            return float(value)
        return not_negative(name, value) if name in MAY_BE_ZERO else positive(name, value)
