"""Views of fused positions: the map of the stations, and the bearings of each step."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from arrivals.live.steps import LiveScene, Rays
from arrivals.live.views import LiveViews
from arrivals.recordings.fusion.fusing import step_azimuths
from arrivals.recordings.fusion.fusion_steps import FusionSteps
from arrivals.trackers import Fused


def watch_fused(
    views: LiveViews, name: str, fused: Fused, steps: FusionSteps
) -> Callable[[int, list[Any]], None]:
    """Open the views of a fused run, and return a function that shows a step.

    Parameters
    ----------
    views : LiveViews
        Views that are not open yet.
    name : str
        Stations file.
    fused : Fused
        Tracker.
    steps : FusionSteps
        Its measurements.

    Returns
    -------
    callable
        Shows the step of a number, after the tracker was updated by its measurements.
    """
    places = [station.position.tolist() for station in fused.stations]
    names = [station.name or "" for station in fused.stations]
    stations = tuple((each, x, y) for each, (x, y) in zip(names, places, strict=True))
    sensors: tuple[tuple[float, float], ...] = ()
    if steps.strength is not None:
        sensors = tuple((float(x), float(y)) for x, y in steps.strength.model.sensors)
    title = f"{os.path.basename(name)}: {len(places)} stations"
    views.open(LiveScene(title, "map", stations=stations, sensors=sensors), fused)

    def show(step: int, z: Sequence[Any]) -> None:
        if not views.are_shown:
            return
        views.show(step, float(steps.time[step]), fused.estimate, rays=rays_of(fused, z))

    return show


def rays_of(fused: Fused, z: Sequence[Any]) -> Rays:
    """Return places and azimuths of the bearings of a step.

    Parameters
    ----------
    fused : Fused
        After the step.
    z : sequence
        Measurements of the step, one a station.

    Returns
    -------
    tuple of (float, float, float)
        x and y of the station, m, and azimuth, rad.
    """
    return tuple(
        (float(station.position[0]), float(station.position[1]), float(azimuth))
        for station, azimuths in zip(fused.stations, step_azimuths(fused, z), strict=True)
        if azimuths is not None
        for azimuth in np.ravel(azimuths)
    )
