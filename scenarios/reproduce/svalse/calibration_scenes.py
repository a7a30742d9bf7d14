"""Scenes in which the statements of SVALSE are compared with the truth, with their limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Range = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Coverage:
    """Limits of the shares of errors within the stated 68 and 95 % intervals.

    Parameters
    ----------
    share68, share95 : tuple of two float
        Lowest and highest share.
    """

    share68: Range
    share95: Range

    def holds(self, share68: float, share95: float) -> bool:
        """Return whether both shares are within the limits."""
        (low68, high68), (low95, high95) = self.share68, self.share95
        return low68 <= share68 <= high68 and low95 <= share95 <= high95

    def __str__(self) -> str:
        (low68, high68), (low95, high95) = self.share68, self.share95
        return f"{low68:.0%} to {high68:.0%} and {low95:.1%} to {high95:.1%}"


@dataclass(frozen=True, eq=False)
class CalibrationScene:
    """One scene, and what must hold in it.

    Parameters
    ----------
    scenario : str
    snr_db : float
    parameters : dict
        Of the scenario.
    limits, never_stops : Coverage or None
        Limits of the coverage of the tracker of the scenario, and of that with a walk that never
        stops.
    change : float or None
        Highest paired change of GOSPA due to a walk that may stand still, degrees.
    """

    scenario: str
    snr_db: float
    parameters: dict[str, Any] = field(default_factory=dict)
    limits: Coverage | None = None
    never_stops: Coverage | None = None
    change: float | None = None

    @property
    def label(self) -> str:
        """Name of the scene."""
        details = [_in_words(name, value) for name, value in self.parameters.items()]
        return ", ".join([self.scenario.removeprefix("svalse_"), *details, f"{self.snr_db:g} dB"])


def _in_words(name: str, value: Any) -> str:
    """Return a parameter of a scenario in words."""
    if name == "doas":
        return f"sources at {' and '.join(f'{doa:g}' for doa in value)} degrees"
    nouns = {"n_sources": "sources", "n_bins": "frequencies", "n_snapshots": "snapshots"}
    return "1 source" if (name, value) == ("n_sources", 1) else f"{value} {nouns[name]}"


HONEST = Coverage((0.65, 0.71), (0.93, 0.97))
ON_CIRCLES = Coverage((0.65, 0.71), (0.925, 0.97))
FEW_FREEDOM = {20.0: Coverage((0.66, 0.75), (0.91, 0.97)), 10.0: Coverage((0.60, 0.75), (0.90, 0.97))}  # fmt: skip  # noqa: E501
SOME_STILL = Coverage((0.65, 0.80), (0.93, 0.975))
CONSERVATIVE = Coverage((0.65, 0.87), (0.93, 0.985))
FIGURE_CHANGES = {"fig4": -0.8, "fig5": -0.4, "fig6": -0.4}

BEAM = 2 / 15  # width of the beam in sine, 15 sensors half a wavelength apart


def two_apart(beams: float) -> dict[str, Any]:
    """Return the parameters of two static sources near broadside, some beam widths apart.

    Examples
    --------
    >>> two_apart(0.5)
    {'doas': (5.74, 9.59)}
    """
    sines = np.array([0.1, 0.1 + beams * BEAM])
    return {"doas": tuple(np.rad2deg(np.arcsin(sines)).round(2).tolist())}


def _scenes() -> Iterator[CalibrationScene]:
    for snr_db in (10.0, 20.0, 40.0):
        loud = snr_db == 20
        honest = HONEST if loud else None
        yield CalibrationScene("static", snr_db, never_stops=honest)
        yield CalibrationScene("walk", snr_db, {"n_sources": 1}, honest)
        yield CalibrationScene("walk", snr_db, {"n_sources": 4}, honest, change=0.1)
        if snr_db < 40:
            yield CalibrationScene("switch", snr_db, limits=honest, change=0.1)
            few, data = FEW_FREEDOM[snr_db], ({"n_bins": 5}, {"n_bins": 10}, {"n_snapshots": 10})
            yield CalibrationScene("circle", snr_db, {}, few, change=0.0)
            for each in data:
                yield CalibrationScene("circle", snr_db, each, ON_CIRCLES, change=0.0)
    for figure, change in FIGURE_CHANGES.items():
        for snr_db in (10.0, 20.0, 30.0, 40.0):
            limit = change if snr_db == 20 else None
            yield CalibrationScene(
                f"svalse_{figure}", snr_db, {}, CONSERVATIVE, SOME_STILL, change=limit
            )
    for snr_db in (10.0, 20.0, 40.0):
        for scenario, change in (("scenario1", -0.3), ("scenario2", -0.8)):
            limit = change if snr_db == 20 else None
            yield CalibrationScene(f"svalse_{scenario}", snr_db, change=limit)
    for beams in (0.25, 0.5, 1.0, 2.0):
        yield CalibrationScene("static", 20.0, two_apart(beams))
    for figure in FIGURE_CHANGES:
        yield CalibrationScene(f"svalse_{figure}", 0.0)
    yield CalibrationScene("walk", 0.0, {"n_sources": 4})


SCENES = list(_scenes())
