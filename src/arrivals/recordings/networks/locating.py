"""Positions of sources from tables, networks or arrays of signal strength."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from arrivals.measurement_models.signal_strength.fill_values import without
from arrivals.measurements import real_numbers
from arrivals.messages import nearest
from arrivals.recordings.networks.cells import checked, some
from arrivals.recordings.networks.located import Located
from arrivals.recordings.networks.network import Network
from arrivals.recordings.networks.network_files import read_npz
from arrivals.recordings.networks.sensor_tables import named, sensor_table
from arrivals.recordings.networks.steps import as_network, scattered_window
from arrivals.recordings.networks.tables import ReadTable, read_table
from arrivals.recordings.networks.times import FIRST_DATE
from arrivals.recordings.networks.tracking import (
    PathLossSettings,
    SourceSettings,
    locate_sources,
    loss_exponent,
)
from arrivals.trackers.run import Run
from arrivals.validation import positive, real


def locate(
    readings: str | PathLike[str] | Network | ArrayLike,
    sensors: Any = None,
    *,
    time: ArrayLike | None = None,
    group_by: str | None = None,
    window: float | None = None,
    missing: ArrayLike = (),
    n_sources: int | str | None = None,
    **more: Any,
) -> Located:
    """Locate and track sources by readings of signal strength.

    Parameters
    ----------
    readings : str, path, Network or array_like
        Table or npz file; network; or levels (n_steps, n_sensors), dB, NaN where missing.
    sensors : str, path, mapping or array_like, optional
        Table of the sensors, their positions by name, or positions (n_sensors, 2), m. If None,
        the readings have the positions.
    time : array_like, shape (n_steps,), optional
        Times of levels, s; 0, 1, ... if None.
    group_by : str, optional
        Column whose values are the devices, each located by itself; the one with a name of
        devices, if any, if None.
    window : float, optional
        Length of a step of a table, s. If None, readings at one time are a step, and readings at
        scattered times are put in windows that hold about one reading a sensor.
    missing : float or sequence of float
        Levels that stand for a missing reading.
    n_sources : int or "auto", optional
        Number of sources, of each device; estimated if "auto". If None it is 1 for a table with
        one row a reading or with devices; else it is estimated.
    **more : object
        `alpha`, loss exponent: if None, the evidence of the readings decides where the number of
        sources is known, else it is 2. `tracker` and `progress` of `locate_sources`; other names
        are fields of `PathLossSettings` and `SourceSettings`.

    Returns
    -------
    Located

    Raises
    ------
    ValueError, TypeError, OSError
        If an argument or a file is invalid.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> sensors = rng.uniform(0, 100, (30, 2))
    >>> distance = np.hypot(*(sensors - [40.0, 70.0]).T)
    >>> levels = -30 - 20 * np.log10(distance) + 0.5 * rng.standard_normal((5, 30))
    >>> located = locate(levels, sensors, n_sources=1, sigma_db=0.5)
    >>> located.run.position[-1].round(0)
    array([[40., 70.]])
    """
    alpha = more.pop("alpha", None)
    path_loss, source = _settings(more)
    if window is not None:
        positive("window", window)
    fills = np.atleast_1d(real("missing", missing)).tolist()
    if isinstance(readings, str | PathLike) and Path(readings).suffix.lower() != ".npz":
        if time is not None:
            raise ValueError("time must be left out for a table, which has times")
        table = read_table(readings, sensors, fills, group_by)
        with named(readings):
            networks, steps = _in_steps(table, window, source.speed)
        phrases, has_devices = [*table.understood, *steps], table.has_devices
        default: int | str = "auto" if table.is_wide and not has_devices else 1
    else:
        if group_by is not None or window is not None:
            raise ValueError("group_by and window require a table of readings")
        networks = {"": _network(readings, sensors, time, fills)}
        phrases, has_devices, default = [], False, "auto"
    number = _number(default if n_sources is None else n_sources)
    phrases.append(_count_phrase(number, n_sources is None, has_devices))
    progress = more.pop("progress", lambda steps, **_: steps)
    more.update(n_sources=number, source=source)
    if alpha is None and number is not None:
        alpha = loss_exponent(list(networks.values()), path_loss, **more)
        phrases.append(f"loss exponent {alpha:g} (--alpha)")
    more["path_loss"] = path_loss if alpha is None else replace(path_loss, alpha=alpha)
    if len(networks) > 1:
        runs = _of_each(networks, progress(networks, desc="locate"), more)
    else:
        runs = {one: _run(each, progress=progress, **more) for one, each in networks.items()}
    return Located(runs, networks, has_devices, "; ".join(phrases))


def _settings(more: dict[str, Any]) -> tuple[PathLossSettings, SourceSettings]:
    """Return the settings among further arguments, which are taken out."""
    known = [[field.name for field in fields(kind)] for kind in (PathLossSettings, SourceSettings)]
    names = ["tracker", "progress", *known[0], *known[1]]
    unknown = sorted(set(more) - set(names))
    if unknown:
        hint = nearest(unknown[0], {*inspect.signature(locate).parameters, *names} - {"more"})
        raise TypeError(f"locate has no argument {unknown[0]!r}: {hint}")
    parts = [{name: more.pop(name) for name in each if name in more} for each in known]
    return PathLossSettings(**parts[0]), SourceSettings(**parts[1])


def _network(readings: Any, sensors: Any, time: ArrayLike | None, missing: list[float]) -> Network:
    """Return a network that is given, or is made from an npz file or arrays."""
    if isinstance(readings, str | PathLike | Network):
        if sensors is not None or time is not None:
            raise ValueError("sensors and time must be left out where the readings have them")
        if isinstance(readings, Network):
            return replace(readings, rss_db=without(readings.rss_db, missing))
        network = read_npz(readings, missing)
        if network.time[0] < FIRST_DATE:
            return network
        start = float(np.floor(network.time[0]))
        return replace(network, time=network.time - start, start=start)
    if sensors is None:
        raise ValueError("levels require the positions of the sensors")
    table = sensor_table(sensors)
    levels = checked(real_numbers("readings", readings), missing)
    n_sensors = len(table.name)
    if levels.ndim != 2 or levels.shape[1] != n_sensors:
        wanted = f"(n_steps, {n_sensors}), a column for each sensor"
        raise ValueError(f"readings must have shape {wanted}; got {levels.shape}")
    times = None if time is None else real_numbers("time", time)
    if times is not None and times.shape != levels.shape[:1]:
        raise ValueError(f"time must have shape {levels.shape[:1]}; got {times.shape}")
    return Network.fixed(table.name, table.positions, levels, times)


def _in_steps(
    table: ReadTable, window: float | None, speed: float
) -> tuple[dict[str, Network], list[str]]:
    """Return the network of each device, and phrases about the steps."""
    parts, phrases = table.readings, []
    if window is not None:
        if any(each.static_source for each in parts.values()):
            raise ValueError("window must be left out for a survey: its sources are at rest")
        phrases.append(f"steps of {window:g} s")
    elif not table.is_wide:
        found = [scattered_window(each, speed) for each in parts.values()]
        chosen = [one for one in found if one is not None]
        if 2 * len(chosen) > len(found):
            window = float(np.median(chosen))
            phrases.append(f"times are scattered: steps of {window:g} s (--window)")
    networks = {one: as_network(each, window) for one, each in parts.items()}
    n_readings = sum(int(np.isfinite(each.level).sum()) for each in parts.values())
    n_averaged = n_readings - sum(int(np.isfinite(one.rss_db).sum()) for one in networks.values())
    if n_averaged:
        phrases.append(f"readings averaged with others of their sensor and step: {n_averaged}")
    plane = next(iter(networks.values())).plane
    if plane is not None:
        phrases.append(f"x, y from {plane.lat:.6f}, {plane.lon:.6f}")
    return networks, phrases


def _number(n_sources: int | str) -> int | None:
    """Return a number of sources, None if it is to be estimated."""
    if not isinstance(n_sources, str):
        return n_sources
    if n_sources != "auto":
        raise ValueError(f"n_sources must be a number or 'auto'; got {n_sources!r}")
    return None


def _count_phrase(number: int | None, is_default: bool, has_devices: bool) -> str:
    if number is None:
        return "number of sources estimated"
    text = f"{number} source{'s' if number != 1 else ''}{' a device' if has_devices else ''}"
    return text + (" (--sources auto: estimate it)" if is_default else "")


def _of_each(
    networks: Mapping[str, Network], devices: Iterable[str], arguments: dict[str, Any]
) -> dict[str, Run]:
    """Return the runs of several devices; a warning is raised once and names its devices."""
    runs: dict[str, Run] = {}
    raised: dict[tuple[str, type[Warning]], list[str]] = {}
    for device in devices:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            runs[device] = _run(networks[device], **arguments)
        for one in {(str(each.message), each.category) for each in caught}:
            raised.setdefault(one, []).append(device)
    for (text, category), names in raised.items():
        text = f"{text} ({len(names)} of {len(runs)} devices: {some(names)})"
        warnings.warn(text, category, stacklevel=3)
    return runs


def _run(network: Network, **arguments: Any) -> Run:
    """Return a run with latitudes and longitudes where the sensors have them."""
    run = locate_sources(network, **arguments)
    if network.plane is None:
        return run
    lat, lon = network.plane.to_lat_lon(*np.moveaxis(run.position, -1, 0))
    return replace(run, extras={**run.extras, "lat": lat, "lon": lon})
